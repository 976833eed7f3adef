"""Noticing that the keys or rules of this machine have changed while a program runs."""

from __future__ import annotations

import logging
import ssl
from collections.abc import Callable
from pathlib import Path

from rosz.errors import RoszError
from rosz.security.folder import KeyFolder

__all__ = ("KeyWatch",)

_log = logging.getLogger("rosz.keys")

_Signature = tuple[tuple[int, int, int] | None, ...]


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
        found, before = self._read(), self._last
        self._last = found
        if found == self._known or found != before:
            return ""
        self._known = found
        try:
            keys = self._find()
            context = ssl.create_default_context(cafile=keys.authority)
            context.load_cert_chain(keys.certificate, keys.key)
        except (RoszError, OSError, ValueError) as error:
            _log.warning("changed keys or rules are not used: %s", error)
            return ""
        return f"keys or rules in '{self._folder}' have changed"

    def _read(self) -> _Signature:
        return tuple(map(_signature, self._files))


def _signature(file: Path) -> tuple[int, int, int] | None:
    """Return what changes with the content of a file; None if there is no file."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns
