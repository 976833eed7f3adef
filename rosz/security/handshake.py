"""Asking the other end of a link why it refuses, or is to be refused.

Zenoh keeps trying and says little; one handshake with the same keys says what is wrong.
"""

from __future__ import annotations

import socket
import ssl

from rosz.security.folder import KeyFolder

__all__ = ("refusal",)

_ALERT_BY = 0.5
"""Seconds within which the other end of a finished handshake says that it is not content."""


def refusal(endpoint: str, keys: KeyFolder, timeout: float = 2.0) -> str:
    """Return why no link to an endpoint comes about; empty when one does.

    Args:
        endpoint: Such as ``tls/robot1:7447``.
        keys: Those of this machine.
        timeout: Seconds for connection and handshake.
    """
    host, _, port = endpoint.partition("/")[2].partition("?")[0].partition("#")[0].rpartition(":")
    host = host.strip("[]")
    context = ssl.create_default_context(cafile=keys.authority)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    try:
        context.load_cert_chain(keys.certificate, keys.key)
        with (
            socket.create_connection((host, int(port)), timeout) as plain,
            context.wrap_socket(plain, server_hostname=host) as link,
        ):
            # By TLS 1.3 the other end judges this one's certificate after the handshake.
            link.settimeout(_ALERT_BY)
            link.recv(1)
    except TimeoutError as error:
        return "" if "read" in str(error) else f"no answer within {timeout:g} s"
    except ssl.SSLCertVerificationError as error:
        return f"its certificate is refused here: {error.verify_message}"
    except ssl.SSLError as error:
        reason = (error.reason or str(error)).lower().replace("_", " ")
        return f"it refuses: {reason}"
    except (OSError, ValueError) as error:
        return str(error)
    return ""
