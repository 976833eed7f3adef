"""A small certificate authority: one key that signs those of machines and people.

Certificates are X.509 version 3 (RFC 5280) on the curve P-256. A certificate serves either end of
a link. It contains the name of its holder, for machines the addresses that reach it, and a name of
its own that no other certificate has.

Zenoh reads no revocation lists. But every end of a link checks certificates by that of the
authority, which may exclude names (RFC 5280, section 4.2.1.10). So a certificate is revoked by a
new certificate of the same authority that excludes its own name.
"""

from __future__ import annotations

import datetime as dt
import ipaddress
import os
import re
import secrets
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosz.errors import UsageError, near_miss
from rosz.security.folder import AUTHORITY, CERTIFICATE, KEY, check_private

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
    from cryptography.x509 import Certificate, GeneralName, Name

_HOME = "authority"
_REVOKED = "revoked"
_OWN_DOMAIN = ".key.invalid"
"""End of the own names of certificates, which are not names of hosts (RFC 2606)."""
_NAME = re.compile(r"[A-Za-z0-9]([A-Za-z0-9._-]*[A-Za-z0-9])?")
_LONGEST_NAME = 64
"""The longest common name of a certificate, in characters (RFC 5280, appendix A.1)."""
_AUTHORITY_DAYS = 3650
_CLOCKS_DIFFER = dt.timedelta(hours=1)


class Authority:
    """The authority of a folder of keys.

    Args:
        folder: The folder that `create` made.

    Attributes:
        folder: The folder.
        certificate: The certificate of the authority.

    Raises:
        UsageError: There is no authority, or others may read its key.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        key, certificate = folder / _HOME / KEY, folder / _HOME / CERTIFICATE
        if not key.is_file() or not certificate.is_file():
            raise UsageError(f"no authority in '{folder}': 'rosz keys init {folder}' makes one")
        check_private(key)
        self.certificate = read_certificate(certificate)
        self._key = _read_key(key)

    @classmethod
    def create(cls, folder: Path, name: str = "rosz", days: float = _AUTHORITY_DAYS) -> Authority:
        """Create a new authority.

        Args:
            folder: The folder, which is created if necessary.
            name: The name of the authority in its certificate.
            days: The lifetime of the certificate in days.

        Raises:
            UsageError: There is an authority already, which is left as it is.
        """
        home = folder / _HOME
        if (home / KEY).exists():
            raise UsageError(
                f"'{folder}' has an authority already; keys that it signed would be worth nothing"
                " under a new one. To start anew, move the folder away first"
            )
        key = _new_key()
        subject = _subject(f"{name} authority")
        certificate = _sign(subject, key.public_key(), days, subject, key)
        _write(home, key, certificate)
        return cls(folder)

    def add(self, name: str, addresses: Sequence[str] = (), days: float = 825) -> Path:
        """Create keys for a machine or a person.

        Args:
            name: The host name or user name of the holder, which rules refer to.
            addresses: IP addresses and further host names of the machine.
            days: The lifetime of the certificate in days.

        Returns:
            The folder to copy to the machine.

        Raises:
            UsageError: The name is not valid, or has keys already, which are left as they are.
        """
        reserved = name in {_HOME, _REVOKED}
        if not _NAME.fullmatch(name) or reserved or len(name) > _LONGEST_NAME:
            raise UsageError(
                f"'{name}' is not a name for a holder of keys; expected at most {_LONGEST_NAME}"
                " letters, digits, '.', '_', '-'"
            )
        folder = self.folder / name
        if folder.exists():
            raise UsageError(
                f"'{name}' has keys already: '{folder}'. To replace them, delete that folder first"
            )
        refused = {name, *addresses}.intersection(excluded_names(self.certificate))
        if refused:
            raise UsageError(
                f"'{refused.pop()}' was revoked as a name, with keys of an older rosz: keys for it"
                " are refused everywhere; choose another name"
            )
        key = _new_key()
        issuer = self.certificate.subject
        places = [name, *addresses, f"{secrets.token_hex(8)}{_OWN_DOMAIN}"]
        certificate = _sign(_subject(name), key.public_key(), days, issuer, self._key, places)
        _write(folder, key, certificate)
        _create(folder / AUTHORITY, (self.folder / _HOME / CERTIFICATE).read_bytes())
        return folder

    def revoke(self, name: str) -> Path:
        """Revoke the keys of a holder, who can get new ones afterwards.

        Every machine refuses the keys once it has the new certificate of the authority.

        Args:
            name: The name of the holder.

        Returns:
            The folder that the revoked keys are in now.

        Raises:
            UsageError: The holder has no keys here.
        """
        home = self.folder / name
        if name == _HOME or not _NAME.fullmatch(name) or not (home / CERTIFICATE).is_file():
            holders = sorted(file.parent.name for file in self.folder.glob(f"*/{AUTHORITY}"))
            hint = (
                near_miss(name, holders) or f"; there are keys of {', '.join(holders) or 'nobody'}"
            )
            raise UsageError(f"'{name}' has no keys in '{self.folder}'{hint}")
        own = own_name(read_certificate(home / CERTIFICATE)) or name
        self.certificate = self._excluding([*excluded_names(self.certificate), own])
        data = _pem(self.certificate)
        _replace(self.folder / _HOME / CERTIFICATE, data)
        for copy in self.folder.glob(f"*/{AUTHORITY}"):
            _replace(copy, data)
        gone = self.folder / _REVOKED / f"{name}-{own.partition('.')[0]}"
        gone.parent.mkdir(mode=0o700, exist_ok=True)
        return home.rename(gone)

    def _excluding(self, names: Sequence[str]) -> Certificate:
        """Return a certificate like that of the authority which excludes names."""
        from cryptography import x509
        from cryptography.hazmat.primitives import hashes

        old = self.certificate
        builder = x509.CertificateBuilder(
            old.issuer,
            old.subject,
            self._key.public_key(),
            x509.random_serial_number(),
            old.not_valid_before_utc,
            old.not_valid_after_utc,
        )
        for extension in old.extensions:
            if not isinstance(extension.value, x509.NameConstraints):
                builder = builder.add_extension(extension.value, extension.critical)
        constraints = x509.NameConstraints(None, [x509.DNSName(name) for name in names])
        return builder.add_extension(constraints, True).sign(self._key, hashes.SHA256())


def own_name(certificate: Certificate) -> str:
    """Return the name that only this certificate has; empty if an older rosz made it."""
    from cryptography.x509 import DNSName, SubjectAlternativeName

    names = certificate.extensions.get_extension_for_class(SubjectAlternativeName).value
    own = (name for name in names.get_values_for_type(DNSName) if name.endswith(_OWN_DOMAIN))
    return next(own, "")


def excluded_names(certificate: Certificate) -> list[str]:
    """Return the names that the certificate of an authority excludes."""
    from cryptography import x509

    try:
        constraints = certificate.extensions.get_extension_for_class(x509.NameConstraints).value
    except x509.ExtensionNotFound:
        return []
    return [str(name.value) for name in constraints.excluded_subtrees or ()]


def _sign(
    subject: Name, public: Any, days: float, issuer: Name, key: Any, places: Sequence[str] = ()
) -> Certificate:
    """Sign a certificate; the authority's own has no places, those of holders have some."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes

    authority = not places
    now = dt.datetime.now(dt.UTC)
    try:
        end = now + dt.timedelta(days=days)
    except OverflowError as error:
        raise UsageError(f"{days:g} days from now is not a date; expected fewer") from error
    usage = x509.KeyUsage(
        digital_signature=not authority,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=authority,
        crl_sign=authority,
        encipher_only=False,
        decipher_only=False,
    )
    issuer_key = x509.AuthorityKeyIdentifier.from_issuer_public_key(key.public_key())
    builder = (
        x509.CertificateBuilder(issuer, subject, public)
        .serial_number(x509.random_serial_number())
        .not_valid_before(min(now, end) - _CLOCKS_DIFFER)
        .not_valid_after(end)
        .add_extension(x509.BasicConstraints(authority, 0 if authority else None), True)
        .add_extension(usage, True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public), False)
        .add_extension(issuer_key, False)
    )
    if not authority:
        oid = x509.oid.ExtendedKeyUsageOID
        both_ends = x509.ExtendedKeyUsage([oid.SERVER_AUTH, oid.CLIENT_AUTH])
        names = x509.SubjectAlternativeName([_general_name(place) for place in places])
        builder = builder.add_extension(both_ends, False).add_extension(names, False)
    return builder.sign(key, hashes.SHA256())


def read_certificate(file: Path) -> Certificate:
    """Read a certificate.

    Raises:
        UsageError: The file does not contain a certificate.
    """
    x509 = _cryptography().x509
    try:
        certificate: Certificate = x509.load_pem_x509_certificate(file.read_bytes())
    except ValueError as error:
        raise UsageError(f"'{file}' is not a certificate: {error}") from error
    return certificate


def _read_key(file: Path) -> EllipticCurvePrivateKey:
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    try:
        key = load_pem_private_key(file.read_bytes(), None)
    except (ValueError, TypeError) as error:
        raise UsageError(f"'{file}' is not a private key: {error}") from error
    if not isinstance(key, EllipticCurvePrivateKey):
        raise UsageError(f"'{file}' is another kind of key than rosz makes; expected one on P-256")
    return key


def _new_key() -> EllipticCurvePrivateKey:
    _cryptography()
    from cryptography.hazmat.primitives.asymmetric import ec

    return ec.generate_private_key(ec.SECP256R1())


def _subject(name: str) -> Name:
    from cryptography import x509

    if len(name) > _LONGEST_NAME:
        raise UsageError(f"'{name}' is too long for a name, expected {_LONGEST_NAME} characters")
    return x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])


def _general_name(text: str) -> GeneralName:
    from cryptography import x509

    try:
        return x509.IPAddress(ipaddress.ip_address(text))
    except ValueError:
        if not _NAME.fullmatch(text):
            raise UsageError(f"'{text}' is not an IP address or a host name") from None
        return x509.DNSName(text)


def _write(folder: Path, key: EllipticCurvePrivateKey, certificate: Certificate) -> None:
    from cryptography.hazmat.primitives import serialization as form

    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    secret = key.private_bytes(form.Encoding.PEM, form.PrivateFormat.PKCS8, form.NoEncryption())
    _create(folder / KEY, secret)
    _create(folder / CERTIFICATE, _pem(certificate))


def _pem(certificate: Certificate) -> bytes:
    from cryptography.hazmat.primitives import serialization as form

    return certificate.public_bytes(form.Encoding.PEM)


def _replace(file: Path, data: bytes) -> None:
    """Replace a file as a whole, so that nobody reads a part of it."""
    fresh = file.with_name(f".{file.name}-{os.getpid()}")
    fresh.unlink(missing_ok=True)
    _create(fresh, data)
    fresh.replace(file)


def _create(file: Path, data: bytes) -> None:
    """Create a file that nobody else can read at any moment."""
    handle = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(handle, "wb") as opened:
        opened.write(data)


def _cryptography() -> Any:
    try:
        import cryptography.x509
    except ImportError as error:
        raise UsageError(
            "making and reading certificates needs the 'cryptography' package:"
            " pip install 'rosz[keys]'"
        ) from error
    return cryptography
