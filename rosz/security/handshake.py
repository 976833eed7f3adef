"""Asking the other end of a link why it refuses, or is to be refused.

Zenoh keeps trying and says little; one handshake with the same keys says what is wrong.
"""

from __future__ import annotations

import socket
import ssl

from rosz.security.folder import KeyFolder
from rosz.wire import Endpoint

__all__ = ("refusal", "wants_keys")

_OTHER_NAME = {62, 64}
"""What OpenSSL says of a certificate that is for another host name, or address."""
_ALERT_BY = 0.5
"""Seconds within which the other end of a finished handshake says that it is not content."""


def refusal(endpoint: Endpoint, keys: KeyFolder, timeout: float = 2.0) -> str:
    """Return why no link to an endpoint comes about; empty when one does.

    Args:
        endpoint: The endpoint to connect to, such as ``tls/robot1:7447``.
        keys: The keys of this machine.
        timeout: Time limit of connection and of handshake, in seconds.
    """
    context = ssl.create_default_context(cafile=keys.authority)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    # Zenoh does not mind what this forbids, such as a certificate that names no key of its issuer.
    context.verify_flags &= ~ssl.VERIFY_X509_STRICT
    try:
        host, port = endpoint.host, endpoint.port
        context.load_cert_chain(keys.certificate, keys.key)
        with (
            socket.create_connection((host, port), timeout) as plain,
            context.wrap_socket(plain, server_hostname=host) as link,
        ):
            # By TLS 1.3 the other end judges this one's certificate after the handshake.
            link.settimeout(_ALERT_BY)
            link.recv(1)
    except TimeoutError as error:
        if "handshake" in str(error):
            return "it speaks no TLS: 'ROSZ_KEYS' is missing there, or it is no Zenoh"
        return "" if "read" in str(error) else f"no answer within {timeout:g} s"
    except ssl.SSLCertVerificationError as error:
        reason = f"its certificate is refused here: {error.verify_message}"
        if error.verify_code in _OTHER_NAME:
            reason += f" ('rosz keys add' takes --address {host} for it)"
        return reason
    except ssl.SSLError as error:
        reason = (error.reason or str(error)).lower().replace("_", " ")
        return f"it refuses: {reason}"
    except (OSError, ValueError) as error:
        return str(error)
    return ""


def wants_keys(endpoint: Endpoint, timeout: float = 1.0) -> bool:
    """Tell whether what answers at an endpoint is TLS, to which a link needs keys.

    Args:
        endpoint: The endpoint to connect to, such as ``tcp/robot1:7447``.
        timeout: Time limit of connection and of handshake, in seconds; what is not TLS sends
            nothing.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    try:
        with (
            socket.create_connection((endpoint.host, endpoint.port), timeout) as plain,
            context.wrap_socket(plain),
        ):
            return True
    except (OSError, ValueError):
        return False
