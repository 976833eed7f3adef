"""Rules as Zenoh's access control checks them, message by message, on each link.

``ingress`` is what the other end of a link sends here, ``egress`` what is sent to it. Links within
the machine are free; a link from beyond needs a certificate, and what its holder may do is spelt
out for every kind of message that belongs to it (https://zenoh.io/docs/manual/access-control).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final, Literal

from rosz.security.rules import ANYBODY, EVERYTHING, Permit, Rules
from rosz.wire import OWN_SPACE, Kind
from rosz.wire.tokens import SPACE

__all__ = ("access_control",)

Flow = Literal["ingress", "egress"]
_Grant = tuple[Flow, tuple[str, ...], list[str]]
"""Which way, which kinds of messages, and on which keys."""

_DATA: Final = ("put", "delete")
_LISTEN: Final = ("declare_subscriber",)
_ASK: Final = ("query",)
_ANSWER: Final = ("declare_queryable", "reply")
_TOKEN: Final = ("liveliness_token",)
_LOOK: Final = ("liveliness_query", "declare_liveliness_subscriber")
_MESSAGES: Final = (*_DATA, *_LISTEN, *_ASK, *_ANSWER, *_TOKEN, *_LOOK)

_OWN: Final = f"{OWN_SPACE}/*"
_ANY_KEY: Final = ["**", "**/@adv/**", f"{SPACE}/**", f"{OWN_SPACE}/**"]
"""All that goes over a link; wildcards leave out chunks that begin with ``@``."""


def access_control(rules: Rules | None, loopback: Sequence[str]) -> dict[str, Any]:
    """Return the ``access_control`` part of a Zenoh configuration.

    Args:
        rules: Who may do what; whoever has a key may do everything when not given.
        loopback: Network interfaces of links within the machine.
    """
    everything = [_rule("all", flow, _MESSAGES, _ANY_KEY) for flow in ("ingress", "egress")]
    table = list(everything)
    subjects: list[dict[str, Any]] = [
        {"id": "interfaces of this machine", "interfaces": list(loopback)},
        {"id": "sockets of this machine", "link_protocols": ["unixsock-stream"]},
    ]
    policies = [_policy(everything, *(subject["id"] for subject in subjects))]
    permits = {ANYBODY: Permit.all()} if rules is None else rules.permits
    for holder, permit in permits.items():
        subjects.append(_holder(holder))
        own = everything if permit.is_all else list(_rules(holder, permit))
        if not permit.is_all:
            table += own
        policies.append(_policy(own, subjects[-1]["id"]))
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": table,
        "subjects": subjects,
        "policies": policies,
    }


def _holder(name: str) -> dict[str, Any]:
    subject: dict[str, Any] = {"id": f"holder {name}", "link_protocols": ["tls"]}
    if name != ANYBODY:
        subject["cert_common_names"] = [name]
    return subject


def _policy(rules: Iterable[dict[str, Any]], *subjects: str) -> dict[str, Any]:
    return {"rules": [rule["id"] for rule in rules], "subjects": list(subjects)}


def _rules(holder: str, permit: Permit) -> Iterator[dict[str, Any]]:
    for number, (flow, messages, keys) in enumerate(_grants(permit)):
        if keys:
            yield _rule(f"{holder} {number}", flow, messages, keys)


def _rule(name: str, flow: Flow, messages: Sequence[str], keys: Sequence[str]) -> dict[str, Any]:
    return {
        "id": f"{name} {flow}",
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": [_canonical(key) for key in keys],
    }


def _grants(permit: Permit) -> Iterator[_Grant]:
    """Yield all that belongs to what somebody may do; the default being that it may not."""
    yield from _presence()
    yield from _topics(permit.publish, "ingress", "egress")
    yield from _topics(permit.subscribe, "egress", "ingress")
    yield from _services(permit.call, "ingress", "egress")
    yield from _services(permit.serve, "egress", "ingress")
    if permit.get or permit.set:
        yield from _reading()
    yield from _setting(permit.set)
    if permit.control:
        # A newer process of a node's name ends the older one.
        yield "ingress", _TOKEN, [f"{_OWN}/node/**"]
        yield "ingress", _ASK, [f"{_OWN}/control/**", f"{_OWN}/launch/**"]
        yield "egress", _ANSWER, [f"{_OWN}/control/**", f"{_OWN}/launch/**"]
    if EVERYTHING in permit.publish:
        yield "ingress", _DATA, [f"{_OWN}/inbox/**"]
        yield "egress", _LISTEN, [f"{_OWN}/inbox/**"]


def _presence() -> Iterator[_Grant]:
    """Yield what everybody needs: to look around, to be there as a node, to find its peers.

    Looking is free, for what there is to see is given out token by token.
    """
    yield "egress", _TOKEN, [f"{_OWN}/node/**"]
    for flow in _both():
        yield flow, _LOOK, _ANY_KEY
        yield flow, _TOKEN, [f"{SPACE}/*/*/*/*/{Kind.NODE.value}/**"]
        yield flow, (*_ASK, *_ANSWER), [f"{OWN_SPACE}/links/**"]


def _topics(names: Sequence[str], out: Flow, back: Flow) -> Iterator[_Grant]:
    """Yield what belongs to topics whose samples go one way.

    Args:
        names: Patterns of the topics.
        out: The way of the samples.
        back: The other way.
    """
    samples = _data(names)
    kept = [f"{key}/@adv/**" for key in samples]
    yield out, _DATA, samples
    yield back, _LISTEN, samples
    # What a transient-local publisher keeps is asked for, and answered, beside the samples.
    yield back, _ASK, kept
    yield out, _ANSWER, kept + samples
    yield out, _TOKEN, kept + _tokens(Kind.PUBLISHER, names)
    yield back, _TOKEN, kept + _tokens(Kind.SUBSCRIPTION, names)


def _services(names: Sequence[str], asked: Flow, answered: Flow) -> Iterator[_Grant]:
    """Yield what belongs to services whose calls go one way."""
    calls = _data(names)
    yield asked, _ASK, calls
    yield answered, _ANSWER, calls
    yield asked, _TOKEN, _tokens(Kind.CLIENT, names)
    yield answered, _TOKEN, _tokens(Kind.SERVICE, names)


def _reading() -> Iterator[_Grant]:
    """Yield what a replica needs that only takes in, and one who asks a replica."""
    for flow in _both():
        yield flow, _TOKEN, [f"{_OWN}/replica/**"]
        yield flow, _DATA, [f"{_OWN}/ack/*"]
        yield flow, _LISTEN, [f"{_OWN}/ack/*", f"{_OWN}/change/**"]
        # A write that seems to have got lost is told again; what matters is whose key it is for.
        yield flow, _ANSWER, [f"{_OWN}/store/*/write/**"]
    yield "egress", _DATA, [f"{_OWN}/change/**", f"{_OWN}/param/**"]
    yield "ingress", _LISTEN, [f"{_OWN}/param/**"]
    yield "egress", _ASK, [f"{_OWN}/store/*/write/**"]
    yield "ingress", _ASK, [f"{_OWN}/store/*/sync", f"{_OWN}/store/*/ask", f"{_OWN}/param/**"]
    yield "egress", _ANSWER, [f"{_OWN}/store/**", f"{_OWN}/param/**"]


def _setting(names: Sequence[str]) -> Iterator[_Grant]:
    """Yield what belongs to setting parameters; each write says in its key how far it reaches."""
    places = [_chunks(name) for name in names]
    yield "ingress", _DATA, [key for at in places for key in _below(f"{_OWN}/change", at)]
    writes = [key for at in places for key in _below(f"{_OWN}/store/*/write", at)]
    sets = [key for at in places for key in _below(f"{_OWN}/store/*/set", at)]
    tells = [key for at in places for key in _below(f"{_OWN}/store/*/tell", at)]
    yield "ingress", _ASK, writes + sets + tells
    if EVERYTHING in names:
        # Only whom all is believed may be asked what others have missed.
        yield "ingress", _ANSWER, [f"{_OWN}/store/*/{verb}" for verb in ("sync", "tell/**")]
        yield "egress", _ASK, [f"{_OWN}/store/*/{verb}" for verb in ("sync", "tell/**")]
        yield "ingress", _ANSWER, [f"{_OWN}/param/**"]
        yield "egress", _ASK, [f"{_OWN}/param/**"]


def _data(names: Sequence[str]) -> list[str]:
    return [f"*/{_chunks(name)}/*/*" for name in names]


def _tokens(kind: Kind, names: Sequence[str]) -> list[str]:
    """Return the tokens of endpoints, where a whole name is one chunk with ``%`` for ``/``."""
    head = f"{SPACE}/*/*/*/*/{kind.value}/*/*/*"
    return [f"{head}/{chunk}/**" for name in names for chunk in _mangled(name)]


def _mangled(name: str) -> set[str]:
    """Return what the chunk of a name looks like; a wildcard there does not stop at a ``%``."""
    chunk = name.replace("/", "%").replace("**", "*").replace("*", "$*")
    return {"*" if one == "%$*" else one for one in (chunk, chunk.removesuffix("%$*")) if one}


def _chunks(name: str) -> str:
    """Return a pattern of names as chunks of a key expression."""
    parts = name.strip("/").split("/")
    return "/".join(part if part in {"*", "**"} else part.replace("*", "$*") for part in parts)


def _below(head: str, chunks: str) -> list[str]:
    """Return the keys of a place and of all below it."""
    return [f"{head}/{chunks}"] if chunks.endswith("**") else [f"{head}/{chunks}/**"]


def _canonical(key: str) -> str:
    """Return a key expression in the one form that Zenoh takes: ``**`` comes after each ``*``."""
    chunks: list[str] = []
    for chunk in key.split("/"):
        if chunks[-1:] != ["**"] or chunk not in {"*", "**"}:
            chunks.append(chunk)
        elif chunk == "*":
            chunks.insert(-1, chunk)
    return "/".join(chunks)


def _both() -> tuple[Flow, Flow]:
    return "ingress", "egress"
