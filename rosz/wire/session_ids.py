"""The ids of rosz's sessions, which tell that they are rosz's, and on which host they are.

Zenoh's ids are up to 32 hexadecimal digits, and those of other programs are random. Ids of rosz
begin with a mark and a number for the host, and have none of the digits ``a`` to ``e``. So key
expressions that match one of these digits match the sessions of other programs: only 6 of a million
random ids have none of them.
"""

from __future__ import annotations

import zlib

__all__ = ("FOREIGN_DIGITS", "host_number", "id_prefix", "is_rosz_id")

FOREIGN_DIGITS = "abcde"
"""The digits that no id of rosz has."""

_MARK = "7052"
_HOST_DIGITS = 6
_DIGITS = 32


def id_prefix(host: str) -> str:
    """Return the first ten digits of the ids of the sessions on a host."""
    return f"{_MARK}{zlib.crc32(host.encode()) % 10**_HOST_DIGITS:0{_HOST_DIGITS}d}"


def is_rosz_id(zid: str) -> bool:
    """Tell whether a session is one of rosz."""
    return len(zid) == _DIGITS and zid.startswith(_MARK) and not any(map(zid.count, FOREIGN_DIGITS))


def host_number(zid: str) -> str:
    """Return a number for the host of a session of rosz; one in a million hosts shares it."""
    return zid[len(_MARK) : len(_MARK) + _HOST_DIGITS]
