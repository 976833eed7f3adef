"""Finding out why a link with keys is refused, by this machine or by the other end.

Zenoh keeps trying and says little. One TLS handshake with the same keys tells the reason.
"""

from __future__ import annotations

import socket
import ssl
from contextlib import suppress

from rosz.security.folder import KeyFolder
from rosz.wire import Endpoint

_OTHER_NAME = {62, 64}
"""The codes of OpenSSL for a certificate of another host name or address."""
_EXCLUDED = 48
"""The code of OpenSSL for a certificate with a name that its authority excludes."""
_FLIGHTS = 2
"""Number of times that each end has something to send in a handshake."""
_ALERT_BY = 0.5
"""Seconds within which the other end refuses a finished handshake."""


def refusal(endpoint: Endpoint, keys: KeyFolder, timeout: float = 2.0) -> str:
    """Return why a link to an endpoint is refused; empty if it is not.

    Args:
        endpoint: The endpoint to connect to, such as ``tls/robot1:7447``.
        keys: The keys of this machine.
        timeout: Time limit of connection and of handshake, in seconds.
    """
    context = ssl.create_default_context(cafile=keys.authority)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    # Zenoh accepts what this flag forbids, such as a certificate without the key id of its issuer.
    context.verify_flags &= ~ssl.VERIFY_X509_STRICT
    try:
        host, port = endpoint.host, endpoint.port
        context.load_cert_chain(keys.certificate, keys.key)
        with (
            socket.create_connection((host, port), timeout) as plain,
            context.wrap_socket(plain, server_hostname=host) as link,
        ):
            # In TLS 1.3, the other end checks the certificate of this one after the handshake.
            link.settimeout(_ALERT_BY)
            link.recv(1)
    except TimeoutError as error:
        if "handshake" in str(error):
            return (
                f"it says nothing within {timeout:g} s: it hangs, it is not Zenoh, or 'ROSZ_KEYS'"
                " is missing there"
            )
        return "" if "read" in str(error) else f"no answer within {timeout:g} s"
    except ssl.SSLCertVerificationError as error:
        reason = f"its certificate is refused here: {error.verify_message}"
        if error.verify_code in _OTHER_NAME:
            reason += f" ('rosz keys add' takes --address {host} for it)"
        if error.verify_code == _EXCLUDED:
            reason += " (its keys were revoked)"
        return reason
    except ssl.SSLError as error:
        reason = (error.reason or str(error)).lower().replace("_", " ")
        if "certificate unknown" in reason:
            reason += " (the keys of this machine may have been revoked)"
        return f"it refuses: {reason}"
    except (OSError, ValueError) as error:
        return str(error)
    return ""


def wants_keys(endpoint: Endpoint, timeout: float = 1.0) -> bool:
    """Tell whether an endpoint asks for a certificate, so that a link to it needs keys.

    A gateway that answers for others may speak TLS and ask for none.

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
            context.wrap_socket(plain) as link,
        ):
            link.settimeout(_ALERT_BY)
            link.recv(1)
    except ssl.SSLError as error:
        return "CERTIFICATE_REQUIRED" in (error.reason or "")
    except (OSError, ValueError):
        pass
    return False


def certificate_names(keys: KeyFolder) -> tuple[str, ...]:
    """Return the host names and addresses that the certificate of this machine is for.

    ssl decodes no certificate but that of the other end of a link, so this makes a link in memory.

    Args:
        keys: The keys of this machine.

    Returns:
        The names; none if the certificate is not valid.
    """
    server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    client = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client.check_hostname = False
    there, back = ssl.MemoryBIO(), ssl.MemoryBIO()
    try:
        server.load_cert_chain(keys.certificate, keys.key)
        client.load_verify_locations(keys.authority)
        ends = [client.wrap_bio(back, there), server.wrap_bio(there, back, server_side=True)]
        for _ in range(_FLIGHTS):
            for end in ends:
                with suppress(ssl.SSLWantReadError):
                    end.do_handshake()
        certificate = ends[0].getpeercert() or {}
    except (OSError, ValueError):
        return ()
    return tuple(str(entry[1]) for entry in certificate.get("subjectAltName", ()))
