"""The keys of one machine, as files.

::

    authority.pem      the certificate of the authority that it trusts
    certificate.pem    its own certificate
    key.pem            its private key; nobody else may read this one
    rules.yaml         what others may do; everything if there is no such file

``rosz keys`` makes such a folder for each machine, inside one that also holds the key of the
authority. Given the outer folder, a machine uses the folder that has its host name. A `KeyWatch`
notices changes while a program runs.
"""

from __future__ import annotations

import logging
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Final

import msgspec

from rosz.errors import RoszError, UsageError
from rosz.security.rules import Permit, Rules, read_rules
from rosz.wire import Kind

_log = logging.getLogger("rosz.keys")

AUTHORITY = "authority.pem"
CERTIFICATE = "certificate.pem"
KEY = "key.pem"
RULES = "rules.yaml"

_VERBS: Final = {
    Kind.PUBLISHER: "publish",
    Kind.SUBSCRIPTION: "subscribe",
    Kind.CLIENT: "call",
    Kind.SERVICE: "serve",
}
_STANDARD: Final = {
    (Kind.PUBLISHER, "/rosout"),
    (Kind.PUBLISHER, "/parameter_events"),
    (Kind.SUBSCRIPTION, "/clock"),
}
"""The entities that every node has."""


class KeyFolder(msgspec.Struct, frozen=True):
    """The keys of this machine.

    Attributes:
        path: The folder.
        rules: Permissions of others; everything when ``None``.
        rules_file: The file of the rules.
        places_of_rules: Where the rules may be; the first file that exists counts.
    """

    path: Path
    rules: Rules | None
    rules_file: Path | None = None
    places_of_rules: tuple[Path, ...] = ()

    @classmethod
    def find(cls, folder: Path, host: str) -> KeyFolder:
        """Find and check the keys of this machine.

        Args:
            folder: The folder of this machine, or the one with a folder for each machine.
            host: The name of this machine.

        Raises:
            UsageError: There are no keys, others may read the private key, or others may write what
                this machine trusts.
            YamlError: The rules cannot be read.
        """
        own = next(
            (candidate for candidate in (folder, folder / host) if (candidate / KEY).is_file()),
            None,
        )
        if own is None:
            raise UsageError(
                f"no key in '{folder}' (ROSZ_KEYS): expected '{KEY}' there or in a folder"
                f" '{host}'; 'rosz keys add {host}' makes one"
            )
        for name in (AUTHORITY, CERTIFICATE):
            if not (own / name).is_file():
                raise UsageError(f"'{own}' has a key but no '{name}'; copy the whole folder")
        check_private(own / KEY)
        check_trusted(own / AUTHORITY)
        rules = tuple(dict.fromkeys((own / RULES, folder / RULES)))
        file = next(filter(os.path.lexists, rules), None)
        return cls(own, None if file is None else load_rules(file), file, rules)

    @property
    def authority(self) -> Path:
        """The certificate of the authority."""
        return self.path / AUTHORITY

    @property
    def certificate(self) -> Path:
        """The certificate of this machine."""
        return self.path / CERTIFICATE

    @property
    def key(self) -> Path:
        """The private key of this machine."""
        return self.path / KEY


class LocalPermissions:
    """The permissions of this machine according to its rules.

    Other machines refuse silently if their rules do not permit something. If all machines have the
    same rules, and these name this machine, it can be warned at once.

    Args:
        holder: The name of the machine in the rules.
        permit: Permissions of the machine.
        file: The file of the rules.
    """

    def __init__(self, holder: str, permit: Permit, file: Path) -> None:
        self._holder = holder
        self._permit = permit
        self._file = file
        self._seen = set(_STANDARD)

    @classmethod
    def find(cls, keys: KeyFolder | None, host: str) -> LocalPermissions | None:
        """Return the permissions of this machine, if rules name it.

        Args:
            keys: The keys of the machine.
            host: The name of the machine. If the rules do not know it, the name of the folder of
                keys is used instead.
        """
        if keys is None or keys.rules is None or keys.rules_file is None:
            return None
        for holder in (host, keys.path.name):
            permit = keys.rules.permit_of(holder)
            if permit is not None:
                return cls(holder, permit, keys.rules_file)
        return None

    def describe_objection(self, kind: Kind, name: str) -> str:
        """Return why an entity has no effect beyond the machine; empty if it has, or the next time.

        Args:
            kind: The kind of the entity.
            name: The global name of its topic or service.
        """
        verb = _VERBS[kind]
        if (kind, name) in self._seen or self._permit.allows(verb, name):
            return ""
        self._seen.add((kind, name))
        return (
            f"the {kind.name.lower()} of '{name}' reaches no other machine: '{self._file}' does not"
            f" allow '{self._holder}' to {verb} it"
        )


def check_private(key: Path) -> None:
    """Check that only its owner can read a private key.

    Raises:
        UsageError: Others can read it.
    """
    mode = stat.S_IMODE(os.stat(key).st_mode)  # noqa: PTH116  # follows links
    if mode & 0o077:
        raise UsageError(
            f"others may read '{key}' (mode {mode:04o}, expected 0600): if nobody did,"
            f" 'chmod 600 {key}'; else make a new one with 'rosz keys add'"
        )


def check_trusted(file: Path) -> None:
    """Check that nobody else can write a file that decides who is trusted.

    Raises:
        UsageError: Anybody can write it.
    """
    mode = stat.S_IMODE(os.stat(file).st_mode)  # noqa: PTH116  # follows links
    if mode & 0o002:
        raise UsageError(
            f"anybody may write '{file}' (mode {mode:04o}): see that it says what it should, then"
            f" 'chmod 600 {file}'"
        )


def load_rules(file: Path) -> Rules:
    """Read a file of rules.

    Raises:
        UsageError: The file cannot be read, or anybody may write it.
        YamlError: The file does not contain rules.
    """
    return read_rules(read_trusted(file), str(file))


def read_trusted(file: Path) -> str:
    """Return the text of a file that others must not write.

    Raises:
        UsageError: The file cannot be read, or anybody may write it.
    """
    try:
        check_trusted(file)
        if not file.is_file():  # opening a pipe would block
            raise UsageError(f"'{file}' is not a regular file")
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"cannot read '{file}': {error}") from error


class KeyWatch:
    """Tells, each time it is called, whether keys and rules are others than at its start.

    A file that is being copied, or has a mistake, changes nothing until it is whole and right.

    Args:
        find: Function that finds and checks the keys; see `KeyFolder.find`.

    Raises:
        UsageError: There are no keys, or others may read or write them.
        YamlError: The rules cannot be read.
    """

    def __init__(self, find: Callable[[], KeyFolder]) -> None:
        self._find = find
        keys = find()
        self._files = (keys.authority, keys.certificate, keys.key, *keys.places_of_rules)
        self._known = self._last = self._read()
        self._folder = keys.path

    def change(self) -> str:
        """Return that keys or rules have changed; empty if they have not."""
        signature, before = self._read(), self._last
        self._last = signature
        if signature == self._known or signature != before:
            return ""
        self._known = signature
        import ssl  # few programs need it

        try:
            keys = self._find()
            context = ssl.create_default_context(cafile=keys.authority)
            context.load_cert_chain(keys.certificate, keys.key)
        except (RoszError, OSError, ValueError) as error:
            _log.warning("changed keys or rules are not used: %s", error)
            return ""
        return f"keys or rules in '{self._folder}' have changed"

    def _read(self) -> tuple[tuple[int, int, int] | None, ...]:
        return tuple(map(_signature, self._files))


def _signature(file: Path) -> tuple[int, int, int] | None:
    """Return numbers that change with the content of a file; None if there is no file."""
    try:
        status = file.stat()
    except OSError:
        return None
    return status.st_ino, status.st_size, status.st_mtime_ns
