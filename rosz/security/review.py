"""The review of a folder of keys: their holders, when they expire, and mistakes."""

from __future__ import annotations

import datetime as dt
import os
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rosz.errors import RoszError, UsageError
from rosz.security.authority import own_name, read_certificate
from rosz.security.folder import (
    AUTHORITY,
    CERTIFICATE,
    KEY,
    RULES,
    check_private,
    check_trusted,
    load_rules,
)
from rosz.security.rules import ANYBODY, NAME_VERBS, Permit

if TYPE_CHECKING:
    from cryptography.x509 import Certificate

_SOON = dt.timedelta(days=30)
_HOME = "authority"


class Holder(msgspec.Struct, frozen=True):
    """A holder of keys.

    Attributes:
        name: The name in the certificate, which rules refer to.
        places: Further host names and addresses in the certificate.
        until: The end of the certificate.
        folder: The folder of the keys.
    """

    name: str
    places: tuple[str, ...]
    until: dt.datetime
    folder: str


class RuleFile(msgspec.Struct, frozen=True):
    """A file of rules, in words.

    Attributes:
        file: The file.
        allowed: Permissions of each holder, one line for each kind of permission.
    """

    file: str
    allowed: dict[str, list[str]]


class Review(msgspec.Struct):
    """The contents of a folder of keys.

    Attributes:
        holders: The holders of keys.
        rules: All rules that some machine uses.
        wrong: One line for each mistake, and for each certificate that ends soon.
    """

    holders: list[Holder] = []
    rules: list[RuleFile] = []
    wrong: list[str] = []


def review_keys(folder: Path, now: dt.datetime | None = None) -> Review:
    """Review a folder: all keys with their authority, or those of one machine.

    Args:
        folder: The folder.
        now: The current time; by the system's clock when not given.

    Raises:
        UsageError: There are no keys in the folder.
    """
    now = now or dt.datetime.now(dt.UTC)
    review = Review()
    single = (folder / CERTIFICATE).is_file()
    homes = [folder] if single else sorted(file.parent for file in folder.glob(f"*/{CERTIFICATE}"))
    if not homes:
        raise UsageError(f"no keys in '{folder}': 'rosz keys init {folder}' makes an authority")
    for home in homes:
        try:
            _review_keys(home, now, review)
        except RoszError as error:
            review.wrong.append(str(error))
    for file in [folder / RULES, *(home / RULES for home in homes if home != folder)]:
        if os.path.lexists(file):
            _review_rules(file, review, complete=not single)
    return review


def _review_keys(home: Path, now: dt.datetime, review: Review) -> None:
    certificate = read_certificate(home / CERTIFICATE)
    if (home / KEY).is_file():
        check_private(home / KEY)
    elif home.name != _HOME:
        review.wrong.append(f"'{home}' has no '{KEY}'")
    until = certificate.not_valid_after_utc
    name = _name(certificate)
    if until <= now:
        review.wrong.append(f"'{name}' ended on {until:%Y-%m-%d}: 'rosz keys add {name}' anew")
    elif until - now < _SOON:
        review.wrong.append(f"'{name}' ends on {until:%Y-%m-%d}, in {(until - now).days} days")
    if home.name == _HOME:
        return
    review.holders.append(Holder(name, _places(certificate, name), until, str(home)))
    _check_signature(home, certificate)


def _check_signature(home: Path, certificate: Certificate) -> None:
    from cryptography.exceptions import InvalidSignature

    try:
        check_trusted(home / AUTHORITY)
        certificate.verify_directly_issued_by(read_certificate(home / AUTHORITY))
    except (InvalidSignature, ValueError) as error:
        raise UsageError(f"'{home / CERTIFICATE}' is not signed by '{home / AUTHORITY}'") from error
    except FileNotFoundError as error:
        raise UsageError(f"'{home}' has no '{AUTHORITY}'") from error


def _review_rules(file: Path, review: Review, *, complete: bool) -> None:
    try:
        rules = load_rules(file)
    except RoszError as error:
        review.wrong.append(str(error))
        return
    allowed = {name: _allowed(permit) for name, permit in rules.permits.items()}
    review.rules.append(RuleFile(str(file), allowed))
    holders = {holder.name for holder in review.holders} | {ANYBODY}
    if complete:
        review.wrong += [
            f"'{file}' allows '{name}' something, who has no keys"
            for name in rules.permits
            if name not in holders
        ]


def _allowed(permit: Permit) -> list[str]:
    if permit.is_all:
        return ["all"]
    lines = [
        f"{verb} {', '.join(getattr(permit, verb))}" for verb in NAME_VERBS if getattr(permit, verb)
    ]
    lines += ["get all parameters"] if permit.get else []
    lines += ["control nodes"] if permit.control else []
    return lines or ["nothing"]


def _name(certificate: Certificate) -> str:
    from cryptography.x509 import NameOID

    return str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)


def _places(certificate: Certificate, name: str) -> tuple[str, ...]:
    from cryptography.x509 import SubjectAlternativeName

    names = certificate.extensions.get_extension_for_class(SubjectAlternativeName).value
    hidden = {name, own_name(certificate)}
    return tuple(str(place.value) for place in names if str(place.value) not in hidden)
