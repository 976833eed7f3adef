"""Looking through a folder of keys: who has any, until when, and what is wrong."""

from __future__ import annotations

import datetime as dt
import os
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rosz.errors import RoszError, UsageError
from rosz.security.authority import read_certificate
from rosz.security.folder import (
    AUTHORITY,
    CERTIFICATE,
    KEY,
    RULES,
    check_private,
    check_trusted,
    load_rules,
)
from rosz.security.rules import ANYBODY, NAME_VERBS, Permit, Rules

if TYPE_CHECKING:
    from cryptography.x509 import Certificate

__all__ = ("Holder", "Review", "RuleFile", "review")

_SOON = dt.timedelta(days=30)
_HOME = "authority"


class Holder(msgspec.Struct, frozen=True):
    """Somebody who has keys.

    Attributes:
        name: As in the certificate, and in rules.
        places: Host names and addresses that it may be reached at, beside its name.
        until: When the certificate ends.
        folder: Where.
    """

    name: str
    places: tuple[str, ...]
    until: dt.datetime
    folder: str


class RuleFile(msgspec.Struct, frozen=True):
    """Rules, in words.

    Attributes:
        file: Where they stand.
        allowed: A line for each thing that somebody may do.
    """

    file: str
    allowed: dict[str, list[str]]


class Review(msgspec.Struct):
    """What a folder of keys holds.

    Attributes:
        holders: Who has keys.
        rules: All rules that are in force somewhere.
        wrong: A line for each thing that does not work, or will not for long.
    """

    holders: list[Holder] = []
    rules: list[RuleFile] = []
    wrong: list[str] = []


def review(folder: Path, now: dt.datetime | None = None) -> Review:
    """Look through a folder: all keys with their authority, or those of one machine.

    Args:
        folder: It.
        now: What to compare dates with.

    Raises:
        UsageError: There are no keys.
    """
    now = now or dt.datetime.now(dt.UTC)
    found = Review()
    one = (folder / CERTIFICATE).is_file()
    homes = [folder] if one else sorted(file.parent for file in folder.glob(f"*/{CERTIFICATE}"))
    if not homes:
        raise UsageError(f"no keys in '{folder}': 'rosz keys init {folder}' makes an authority")
    for home in homes:
        try:
            _look(home, now, found)
        except RoszError as error:
            found.wrong.append(str(error))
    for file in [folder / RULES, *(home / RULES for home in homes if home != folder)]:
        if os.path.lexists(file):
            _look_at_rules(file, found, complete=not one)
    return found


def _look(home: Path, now: dt.datetime, found: Review) -> None:
    certificate = read_certificate(home / CERTIFICATE)
    if (home / KEY).is_file():
        check_private(home / KEY)
    elif home.name != _HOME:
        found.wrong.append(f"'{home}' has no '{KEY}'")
    until = certificate.not_valid_after_utc
    name = _name(certificate)
    if until <= now:
        found.wrong.append(f"'{name}' ended on {until:%Y-%m-%d}: 'rosz keys add {name}' anew")
    elif until - now < _SOON:
        found.wrong.append(f"'{name}' ends on {until:%Y-%m-%d}, in {(until - now).days} days")
    if home.name == _HOME:
        return
    found.holders.append(Holder(name, _places(certificate, name), until, str(home)))
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


def _look_at_rules(file: Path, found: Review, *, complete: bool) -> None:
    try:
        rules = load_rules(file)
    except RoszError as error:
        found.wrong.append(str(error))
        return
    found.rules.append(RuleFile(str(file), _in_words(rules)))
    known = {holder.name for holder in found.holders} | {ANYBODY}
    if complete:
        found.wrong += [
            f"'{file}' allows '{name}' something, who has no keys"
            for name in rules.permits
            if name not in known
        ]


def _in_words(rules: Rules) -> dict[str, list[str]]:
    return {name: _allowed(permit) for name, permit in rules.permits.items()}


def _allowed(permit: Permit) -> list[str]:
    if permit.is_all:
        return ["all"]
    lines = [
        f"{verb} {', '.join(getattr(permit, verb))}" for verb in NAME_VERBS if getattr(permit, verb)
    ]
    lines += ["get all parameters"] if permit.get or permit.set else []
    lines += ["control nodes"] if permit.control else []
    return lines or ["nothing"]


def _name(certificate: Certificate) -> str:
    from cryptography.x509 import NameOID

    return str(certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)[0].value)


def _places(certificate: Certificate, name: str) -> tuple[str, ...]:
    from cryptography.x509 import SubjectAlternativeName

    names = certificate.extensions.get_extension_for_class(SubjectAlternativeName).value
    return tuple(str(one.value) for one in names if str(one.value) != name)
