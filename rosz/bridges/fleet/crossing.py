"""The crossing between two sides: tokens for the entities of each side, and relays.

Each entity on one side gets a token on the other side, with its name there. Samples pass to a side
that has a subscription, and calls pass to a side that has a server. One thread makes and removes
all declarations.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from hashlib import blake2b
from typing import Final

import msgspec

from rosz.bridges.fleet.plan import FleetPlan
from rosz.bridges.fleet.relays import (
    Edit,
    Ids,
    QueryRelay,
    TopicRelay,
    call_worker,
    log,
    rename_frames,
)
from rosz.errors import ClosedError
from rosz.graph import Graph
from rosz.lifecycle import Closable, Lifecycle, Registration
from rosz.session import Session
from rosz.wire import Kind, Token, entity_key, format_token, gid
from rosz.worker import Worker

_OFFERS: Final = (Kind.PUBLISHER, Kind.SERVICE)
_TRANSFORMS: Final = "tf2_msgs/msg/TFMessage"


def mark_of(prefix: str) -> str:
    """Return the text with which all session ids of the crossing of a prefix begin."""
    return f"1{_digits(prefix, 9)}"


def foreign_id(prefix: str, zid: str) -> str:
    """Return the id of a session on the other side; it stays the same after a restart.

    It is not an id of rosz, so others use only topics and services, as for a node of ROS 2. It also
    lacks the digits by which nodes of rosz recognise nodes of ROS 2, which need more services.
    """
    return mark_of(prefix) + _digits(zid, 20)


def _digits(text: str, count: int) -> str:
    number = int.from_bytes(blake2b(text.encode(), digest_size=16).digest())
    return f"{number % 10**count:0{count}d}"


class Side:
    """One of the two sides of a crossing."""

    def __init__(self, session: Session, domain: int) -> None:
        self.session = session
        self.graph = Graph(session, domain)


class _Direction:
    """One direction of a crossing, which declares entities of the source on the target.

    Args:
        outward: Whether the target is outside the machine.
    """

    def __init__(self, source: Side, target: Side, plan: FleetPlan, *, outward: bool) -> None:
        self.source, self.target = source, target
        self._plan = plan
        self._outward = outward
        self.mark = mark_of(plan.prefix)
        self.ids = Ids()
        self.tokens: dict[str, Closable] = {}
        self.users: dict[tuple[Kind, str, bool], set[str]] = {}
        self.relays: dict[tuple[Kind, str, bool], list[Closable]] = {}

    def mirrored(self, token: Token) -> Token | None:
        """Return the token for the target; ``None`` if the entity does not cross."""
        name = token.name
        if token.kind is Kind.NODE:
            if not (self._outward and self._plan.shares_all):
                return None  # the tokens of its entities make a node known
        elif (renamed := self._name(token.kind, name)) is None:
            return None
        else:
            name = renamed
        namespace, _, base = self._node(token.node_name).rpartition("/")
        zid = foreign_id(self._plan.prefix, token.zid)
        return msgspec.structs.replace(
            token, zid=zid, namespace=namespace or "/", node=base, name=name
        )

    def _name(self, kind: Kind, name: str) -> str | None:
        inside = name if self._outward else self._plan.inside(name)
        # Data leaves the machine from its publishers and servers, and for subscriptions and clients
        # outside.
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
        """Return the changes to samples of a type that pass in this direction."""
        if not (self._plan.frames and type_name == _TRANSFORMS):
            return Edit(self.ids)
        head = f"{self._plan.prefix.strip('/')}/"

        def rename(frame: str) -> str:
            return f"{head}{frame.lstrip('/')}" if self._outward else frame.removeprefix(head)

        return Edit(self.ids, partial(rename_frames, rename))

    def rate(self, name: str) -> float:
        """Return the largest number of samples per second of a topic; the name is the source's."""
        return self._plan.rate(name) if self._outward else float("inf")

    def source_ids(self, key: str) -> str:
        """Return a key of the target with the session ids replaced by those of the source."""
        sessions = {token.zid for token in self.source.graph.known().tokens}
        zids = {foreign_id(self._plan.prefix, zid): zid for zid in sessions}
        return "/".join(zids.get(chunk, chunk) for chunk in key.split("/"))

    def detection(self, key: str) -> str | None:
        """Return the end of the key of a latching publisher's token in the target.

        Args:
            key: The end in the source, ``/@adv/pub/<zid>/<entity>/_``.

        Returns:
            The end in the target; ``None`` if the crossing itself has declared the token.
        """
        zid, _, rest = key.removeprefix("/@adv/pub/").partition("/")
        if zid.startswith(self.mark):
            return None
        return f"/@adv/pub/{foreign_id(self._plan.prefix, zid)}/{rest}"


class Crossing:
    """Passes tokens, samples and calls between a machine and other machines, until closed."""

    def __init__(self, plan: FleetPlan, inside: Side, outside: Side) -> None:
        self._lifecycle = Lifecycle(f"the crossing of '{plan.prefix}'", log=log)
        self._calls = call_worker()
        self._lifecycle.keep(Registration(partial(self._calls.close, 0)))
        outward = _Direction(inside, outside, plan, outward=True)
        inward = _Direction(outside, inside, plan, outward=False)
        self._directions = (outward, inward)
        self._reverse = {outward: inward, inward: outward}
        self._changes: Worker[Callable[[], object]] = Worker("rosz-fleet", logger=log)
        for direction in self._directions:
            stop = direction.source.graph.listen(partial(self._changed, direction))
            self._lifecycle.keep(Registration(stop))

    def close(self) -> None:
        """Close the crossing; a second call has no effect."""
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
            return  # a session is being closed

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
            # Samples wait for this, so that a receiver can find the publisher of a sample.
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
        """Return the relays for an entity; they exist before others can see its token."""
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
        """Return what passes queries for earlier samples of latching publishers."""

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
    """Declares on the target the tokens by which subscribers detect latching publishers."""

    def __init__(self, direction: _Direction, key: str, other: str) -> None:
        self._direction, self._key, self._other = direction, key, other
        self._own: dict[str, Closable] = {}
        watch = direction.source.session.watch_tokens
        self._watch = watch(f"{key}/@adv/pub/**", self._changed, many=True)

    def _changed(self, token: str, alive: bool) -> None:
        direction = self._direction
        if not alive:
            own = self._own.pop(token, None)
            if own is not None:
                own.close()
            return
        end = direction.detection(token.removeprefix(self._key))
        if end is not None and token not in self._own:
            self._own[token] = direction.target.session.token(self._other + end)

    def close(self) -> None:
        """Remove the tokens; a second call has no effect."""
        self._watch.close()
        while self._own:
            self._own.popitem()[1].close()


def _place(token: Token) -> tuple[Kind, str, bool]:
    """Return the key by which entities share their relays."""
    return token.kind, _key(token), token.qos is not None and token.qos.latched


def _key(token: Token) -> str:
    return entity_key(token.domain, token.name, token.type_name, token.type_hash)
