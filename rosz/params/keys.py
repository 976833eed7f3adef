"""Where the parameter store lives in the key space.

Under ``@rosz/<domain>/``::

    param/<path>                 one key per written path: msgpack of the value, or deleted
    change[/<path>]              writes, as replicas tell them to each other
    ack/<zid>                    to the writer of that session: I have applied it
    store/<zid>/write[/<path>]   a write, told to one replica that seems to have missed it
    store/<zid>/sync             asked of one replica: what differs between us
    store/<zid>/tell[/<path>]    writes, told to one replica that was found to lack them
    store/<zid>/ask              asked of one replica: to read for somebody who is none
    store/<zid>/set[/<path>]     asked of one replica: to write for somebody who is none
    replica/<zid>/<start>/<who>  liveliness token of a replica

Where links need keys, the key of a write names a path that all of it lies at or below, so that
rules can tell who may write what; no replica takes in a write that reaches further than its key.

Replicas talk on ``change``, where a batch is one message. What they write also goes to the keys
under ``param`` as soon as anybody subscribes to those: a Zenoh storage, a tool in another language.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

import msgspec

from rosz.errors import DecodeError
from rosz.params.paths import Path, common, from_key, joined, to_key
from rosz.wire import own_key

__all__ = ("Keys", "Member", "check_reach", "matches")


class Member(msgspec.Struct, frozen=True, order=True):
    """A replica, as its liveliness token tells; the younger of two is the greater.

    Attributes:
        start: Time of its clock when it began, in nanoseconds.
        zid: Its session.
        label: Its process, for people.
    """

    start: int
    zid: str
    label: str


class Keys:
    """The keys of one domain.

    Args:
        domain: The ROS domain.
        scoped: Whether the key of a write names how far it reaches.
    """

    def __init__(self, domain: int, *, scoped: bool = False) -> None:
        self.scoped = scoped
        self.params = own_key(domain, "param")
        self.change = own_key(domain, "change")
        self.tokens = own_key(domain, "replica", "**")
        self._domain = domain

    @property
    def below(self) -> str:
        """Key expression of all parameters, the root among them."""
        return f"{self.params}/**"

    def param(self, path: Path) -> str:
        """Return the key of a path."""
        return f"{self.params}/{to_key(path)}" if path else self.params

    def path(self, key: str) -> Path:
        """Return the path of a key.

        Raises:
            DecodeError: It is the key of none.
        """
        if key != self.params and not key.startswith(f"{self.params}/"):
            raise DecodeError("parameter key", 0, f"'{key}', expected '{self.below}'")
        return from_key(key[len(self.params) + 1 :])

    def ack(self, zid: str) -> str:
        """Return the key on which a writer hears that its writes are applied."""
        return own_key(self._domain, "ack", zid)

    def write(self, zid: str) -> str:
        """Return the key on which a replica is told a write once more."""
        return own_key(self._domain, "store", zid, "write")

    def set(self, zid: str) -> str:
        """Return the key on which a replica writes for those who are none."""
        return own_key(self._domain, "store", zid, "set")

    def reaching(self, key: str, paths: Iterable[Path]) -> str:
        """Return the key for a write of some paths, where they are named in it."""
        if not self.scoped:
            return key
        reach = to_key(common(paths))
        return f"{key}/{reach}" if reach else key

    def reach(self, key: str, base: str) -> Path:
        """Return the path that a key for a write names.

        Args:
            key: What the write came on.
            base: What such a key begins with.

        Raises:
            DecodeError: It is no such key.
        """
        if key != base and not key.startswith(f"{base}/"):
            raise DecodeError("parameter key", 0, f"'{key}', expected '{base}/**'")
        return from_key(key[len(base) + 1 :])

    def sync(self, zid: str) -> str:
        """Return the key on which a replica compares itself with others."""
        return own_key(self._domain, "store", zid, "sync")

    def tell(self, zid: str) -> str:
        """Return the key on which a replica is told writes that it was found to lack."""
        return own_key(self._domain, "store", zid, "tell")

    def ask(self, zid: str) -> str:
        """Return the key on which a replica serves those who are none."""
        return own_key(self._domain, "store", zid, "ask")

    def token(self, member: Member) -> str:
        """Return the liveliness token of a replica."""
        label = to_key((member.label or "-",))
        return own_key(self._domain, "replica", member.zid, str(member.start), label)

    def member(self, token: str) -> Member:
        """Return the replica that a liveliness token stands for.

        Raises:
            DecodeError: It is no such token.
        """
        head = own_key(self._domain, "replica") + "/"
        chunks = token.removeprefix(head).split("/")
        if not token.startswith(head) or len(chunks) != 3 or not chunks[1].isdecimal():  # noqa: PLR2004  # zid, start, label
            raise DecodeError(
                "replica token", 0, f"'{token}', expected '{head}<zid>/<start>/<who>'"
            )
        return Member(int(chunks[1]), chunks[0], joined(from_key(chunks[2]))[1:])


def check_reach(paths: Iterable[Path], reach: Path) -> None:
    """Refuse a write that reaches further than its key says.

    Raises:
        DecodeError: It does.
    """
    if not reach:
        return
    for path in paths:
        if path[: len(reach)] != reach:
            raise DecodeError(
                "parameter batch", -1, f"'{joined(path)}' on the key for '{joined(reach)}'"
            )


def matches(expression: str, key: str) -> bool:
    """Tell whether a key expression of Zenoh's includes a key."""
    chunks = key.split("/")
    reached = {0}
    for part in expression.split("/"):
        if not reached:
            return False
        if part == "**":
            reached = set(range(min(reached), len(chunks) + 1))
        else:
            reached = {
                place + 1
                for place in reached
                if place < len(chunks) and _matches_chunk(part, chunks[place])
            }
    return len(chunks) in reached


def _matches_chunk(part: str, chunk: str) -> bool:
    if part == "*":
        return True
    if "$*" not in part:
        return part == chunk
    pattern = ".*".join(re.escape(piece) for piece in part.split("$*"))
    return re.fullmatch(pattern, chunk, re.DOTALL) is not None
