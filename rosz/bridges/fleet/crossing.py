"""The tokens of two sides, and what passes between them because of them.

Each entity on the one side gets a token on the other, under its name there. A topic passes when
the other side has a subscription, and a call when this side has a server. All declarations come
and go on one thread.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from hashlib import blake2b
from typing import Final

import msgspec

from rosz.bridges.fleet.plan import FleetPlan
from rosz.bridges.fleet.relays import (
    Calls,
    Edit,
    Ids,
    QueryRelay,
    TopicRelay,
    log,
    prefix_frames,
    strip_frames,
)
from rosz.errors import ClosedError
from rosz.graph import Graph
from rosz.lifecycle import Closable, Lifecycle, Registration
from rosz.session import Session
from rosz.wire import Kind, Token, entity_key, format_token, gid
from rosz.worker import Worker

__all__ = ("Crossing", "Side", "foreign_id", "mark_of")

_OFFERS: Final = (Kind.PUBLISHER, Kind.SERVICE)
_SESSIONS: Final = 10_000
_TRANSFORMS: Final = "tf2_msgs/msg/TFMessage"


def mark_of(prefix: str) -> str:
    """Return what the ids of sessions begin with in all tokens of the crossing of a prefix."""
    return f"1{_digits(prefix, 9)}"


def foreign_id(prefix: str, zid: str) -> str:
    """Return the id of a session as the other side sees it, the same after each restart.

    It is not one of rosz. So others address what crosses as that of a node of ROS 2, by its topics
    and services alone. It has none of the digits by which nodes of rosz recognise those of ROS 2,
    which want more services.
    """
    return mark_of(prefix) + _digits(zid, 20)


def _digits(text: str, count: int) -> str:
    number = int.from_bytes(blake2b(text.encode(), digest_size=16).digest())
    return f"{number % 10**count:0{count}d}"


class Side:
    """One of the two sides of a crossing.

    Args:
        session: The session.
        domain: The ROS domain.

    Attributes:
        session: The session.
        graph: The entities there.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self.session = session
        self.graph = Graph(session, domain)


class _Direction:
    """One direction of a crossing: declares the tokens of one side on the other side.

    Args:
        source: The side where it exists.
        target: The other side.
        plan: The names that cross.
        outward: Whether the other side is beyond the machine.
    """

    def __init__(self, source: Side, target: Side, plan: FleetPlan, *, outward: bool) -> None:
        self.source, self.target = source, target
        self._plan = plan
        self._outward = outward
        self.mark = mark_of(plan.prefix)
        self.ids = Ids()
        self._zids: dict[str, str] = {}
        self.tokens: dict[str, Closable] = {}
        self.users: dict[tuple[Kind, str, bool], set[str]] = {}
        self.relays: dict[tuple[Kind, str, bool], list[Closable]] = {}

    def mirrored(self, token: Token) -> Token | None:
        """Return a token as it is on the other side; ``None`` if it does not cross."""
        name = token.name
        if token.kind is Kind.NODE:
            if not (self._outward and self._plan.shares_all):
                return None  # its entities make a node known, too
        elif (found := self._name(token.kind, name)) is None:
            return None
        else:
            name = found
        namespace, _, base = self._node(token.node_name).rpartition("/")
        zid = self._there(token.zid)
        return msgspec.structs.replace(
            token, zid=zid, namespace=namespace or "/", node=base, name=name
        )

    def _there(self, zid: str) -> str:
        found = foreign_id(self._plan.prefix, zid)
        self._zids[found] = zid
        while len(self._zids) > _SESSIONS:
            del self._zids[next(iter(self._zids))]
        return found

    def _name(self, kind: Kind, name: str) -> str | None:
        inside = name if self._outward else self._plan.inside(name)
        # Offers on the machine leave it, and so do interests from beyond it.
        leaves = (kind in _OFFERS) is self._outward
        if inside is None:
            return None
        if not (self._plan.shares(inside) if leaves else self._plan.takes(inside)):
            return None
        return self._plan.outside(inside) if self._outward else inside

    def _node(self, name: str) -> str:
        prefix = self._plan.prefix
        if self._outward:
            return f"{prefix}{name}"
        return name.removeprefix(prefix) if name.startswith(f"{prefix}/") else name

    def edit(self, type_name: str) -> Edit:
        """Return what changes in the samples of a type that pass in this direction."""
        if not (self._plan.frames and type_name == _TRANSFORMS):
            return Edit(self.ids)
        change = prefix_frames if self._outward else strip_frames
        return Edit(self.ids, partial(change, self._plan.prefix.strip("/")))

    def rate(self, name: str) -> float:
        """Return the most samples per second of a topic, by its name in the source."""
        return self._plan.rate(name) if self._outward else float("inf")

    def source_ids(self, key: str) -> str:
        """Return a key with the ids of sessions in the source, for one with those in the target."""
        return "/".join(self._zids.get(chunk, chunk) for chunk in key.split("/"))

    def detection(self, key: str) -> str | None:
        """Return the end of the token of a latching publisher as it is in the target.

        Args:
            key: The end in the source, ``/@adv/pub/<zid>/<entity>/_``.

        Returns:
            The end; ``None`` if the crossing itself has declared that token.
        """
        zid, _, rest = key.removeprefix("/@adv/pub/").partition("/")
        return None if zid.startswith(self.mark) else f"/@adv/pub/{self._there(zid)}/{rest}"


class Crossing:
    """Passes tokens, samples and calls between a machine and other machines, until closed.

    Args:
        plan: The names that cross.
        inside: The machine.
        outside: All others.
    """

    def __init__(self, plan: FleetPlan, inside: Side, outside: Side) -> None:
        self._lifecycle = Lifecycle(f"the crossing of '{plan.prefix}'", log=log)
        self._calls = self._lifecycle.keep(Calls())
        outward = _Direction(inside, outside, plan, outward=True)
        inward = _Direction(outside, inside, plan, outward=False)
        self._directions = (outward, inward)
        self._reverse = {outward: inward, inward: outward}
        self._changes: Worker[Callable[[], object]] = Worker("rosz-fleet", logger=log)
        for direction in self._directions:
            stop = direction.source.graph.listen(partial(self._changed, direction))
            self._lifecycle.keep(Registration(stop))

    def close(self) -> None:
        """End it; a second call has no effect."""
        self._lifecycle.close()
        self._changes.submit(self._undeclare)
        self._changes.close()

    def _undeclare(self) -> None:
        for direction in self._directions:
            for token in direction.tokens.values():
                token.close()
            for relays in direction.relays.values():
                for relay in relays:
                    relay.close()
            direction.tokens.clear()
            direction.relays.clear()

    def _changed(self, direction: _Direction, token: Token, alive: bool) -> None:
        self._changes.submit(partial(self._apply, direction, token, alive))

    def _apply(self, direction: _Direction, token: Token, alive: bool) -> None:
        key = format_token(token)
        if self._lifecycle.closing or token.zid.startswith(direction.mark):
            return
        mirrored = direction.mirrored(token)
        if mirrored is None:
            return
        try:
            if alive:
                self._add(direction, key, token, mirrored)
            else:
                self._remove(direction, key, token)
        except ClosedError:
            return  # a session ends

    def _add(self, direction: _Direction, key: str, token: Token, mirrored: Token) -> None:
        if key in direction.tokens:
            return
        there = format_token(mirrored)
        if token.qos is not None:
            place = _place(token)
            direction.users.setdefault(place, set()).add(key)
            if place not in direction.relays:
                direction.relays[place] = self._relays(direction, token, mirrored)
        direction.tokens[key] = direction.target.session.token(there)
        if token.kind is Kind.PUBLISHER:
            # Samples wait for this, so whoever gets one can look its publisher up.
            direction.ids.add(gid(key), gid(there))

    def _remove(self, direction: _Direction, key: str, token: Token) -> None:
        closable = direction.tokens.pop(key, None)
        if closable is not None:
            closable.close()
        direction.ids.remove(gid(key))
        place = _place(token)
        users = direction.users.get(place, set())
        users.discard(key)
        if not users:
            direction.users.pop(place, None)
            for relay in direction.relays.pop(place, ()):
                relay.close()

    def _relays(self, direction: _Direction, token: Token, mirrored: Token) -> list[Closable]:
        """Return what has to pass because of an entity, before others hear of it."""
        here, there = direction.source.session, direction.target.session
        key, other = _key(token), _key(mirrored)
        assert token.qos is not None  # noqa: S101  # only entities have relays
        if token.kind is Kind.SUBSCRIPTION:
            back = self._reverse[direction]
            rate, edit = back.rate(mirrored.name), back.edit(token.type_name)
            return [TopicRelay(there, other, here, key, qos=token.qos, rate=rate, edit=edit)]
        if token.kind is Kind.SERVICE:
            relay = QueryRelay(
                there, other, here, self._calls, there=lambda _: key, back=lambda _: other
            )
            return [relay]
        if token.kind is Kind.PUBLISHER and token.qos.latched:
            return self._history(direction, key, other, direction.edit(token.type_name))
        return []

    def _history(self, direction: _Direction, key: str, other: str, edit: Edit) -> list[Closable]:
        """Return what replies to those who ask latching publishers for what they sent before."""

        def there(asked: str) -> str:
            return direction.source_ids(key + asked.removeprefix(other))

        relay = QueryRelay(
            direction.target.session,
            f"{other}/@adv/pub/**",
            direction.source.session,
            self._calls,
            there=there,
            back=lambda replied: other + replied.removeprefix(key),
            edit=edit,
        )
        detection = _Detection(direction, key, other)
        return [relay, detection]


class _Detection:
    """Makes known the tokens by which latching publishers are detected.

    Args:
        direction: The direction of the publishers.
        key: The key of the topic in the source.
        other: The key of the topic in the target.
    """

    def __init__(self, direction: _Direction, key: str, other: str) -> None:
        self._direction, self._key, self._other = direction, key, other
        self._own: dict[str, Closable] = {}
        watch = direction.source.session.watch_tokens
        self._watch = watch(f"{key}/@adv/pub/**", self._changed, many=True)

    def _changed(self, token: str, alive: bool) -> None:
        direction = self._direction
        if not alive:
            known = self._own.pop(token, None)
            if known is not None:
                known.close()
            return
        end = direction.detection(token.removeprefix(self._key))
        if end is not None and token not in self._own:
            self._own[token] = direction.target.session.token(self._other + end)

    def close(self) -> None:
        """Take them back; a second call has no effect."""
        self._watch.close()
        while self._own:
            self._own.popitem()[1].close()


def _place(token: Token) -> tuple[Kind, str, bool]:
    """Return what entities that need the same relays have in common."""
    return token.kind, _key(token), token.qos is not None and token.qos.latched


def _key(token: Token) -> str:
    return entity_key(token.domain, token.name, token.type_name, token.type_hash)
