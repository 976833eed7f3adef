"""The keys of one machine, as files.

::

    authority.pem      whom it believes
    certificate.pem    who it is
    key.pem            what proves it; nobody else may read this one
    rules.yaml         what others may do; everything where there is none

``rosz keys`` makes such a folder for each machine, below one that also holds the authority's own
key. Given that one, a machine takes the folder of its host name.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

import msgspec

from rosz.errors import UsageError
from rosz.security.rules import Rules, read_rules

__all__ = ("AUTHORITY", "CERTIFICATE", "KEY", "RULES", "KeyFolder")

AUTHORITY = "authority.pem"
CERTIFICATE = "certificate.pem"
KEY = "key.pem"
RULES = "rules.yaml"


class KeyFolder(msgspec.Struct, frozen=True):
    """The keys of this machine.

    Attributes:
        path: The folder.
        rules: What others may do; everything when ``None``.
        rules_file: Where that stands.
    """

    path: Path
    rules: Rules | None
    rules_file: Path | None = None

    @classmethod
    def find(cls, folder: Path, host: str) -> KeyFolder:
        """Find and check the keys of this machine.

        Args:
            folder: Its own folder, or the one with a folder for each machine.
            host: Name of this machine.

        Raises:
            UsageError: There are none, others may read the key, or write what is believed.
            YamlError: The rules are no rules.
        """
        own = next((one for one in (folder, folder / host) if (one / KEY).is_file()), None)
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
        file = next((one / RULES for one in (own, folder) if os.path.lexists(one / RULES)), None)
        return cls(own, None if file is None else load_rules(file), file)

    @property
    def authority(self) -> Path:
        """Certificate of the authority."""
        return self.path / AUTHORITY

    @property
    def certificate(self) -> Path:
        """Certificate of this machine."""
        return self.path / CERTIFICATE

    @property
    def key(self) -> Path:
        """Private key of this machine."""
        return self.path / KEY


def check_private(key: Path) -> None:
    """Refuse a key that others could have read.

    Raises:
        UsageError: They can.
    """
    mode = stat.S_IMODE(os.stat(key).st_mode)  # noqa: PTH116  # of the file that a link leads to
    if mode & 0o077:
        raise UsageError(
            f"others may read '{key}' (mode {mode:04o}, expected 0600): if nobody did,"
            f" 'chmod 600 {key}'; else make a new one with 'rosz keys add'"
        )


def check_trusted(file: Path) -> None:
    """Refuse a file by which others could say who is let in, and what each may do.

    Raises:
        UsageError: They can write it.
    """
    mode = stat.S_IMODE(os.stat(file).st_mode)  # noqa: PTH116  # of the file that a link leads to
    if mode & 0o002:
        raise UsageError(
            f"anybody may write '{file}' (mode {mode:04o}): see that it says what it should, then"
            f" 'chmod 600 {file}'"
        )


def load_rules(file: Path) -> Rules:
    """Read a file of rules.

    Raises:
        UsageError: It cannot be read, or anybody may write it.
        YamlError: It holds no rules.
    """
    try:
        check_trusted(file)
        if not file.is_file():  # a pipe would be waited for
            raise UsageError(f"'{file}' is no regular file")
        return read_rules(file.read_text(encoding="utf-8"), str(file))
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"cannot read '{file}': {error}") from error
