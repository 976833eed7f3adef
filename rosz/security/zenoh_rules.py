"""The access control of Zenoh, made from rules: it checks each message of each link.

``ingress`` is the direction from the other end of a link, ``egress`` that to it. Links within the
machine are unrestricted. A link from another machine needs a certificate, and what its holder may
do is listed for every kind of message involved (https://zenoh.io/docs/manual/access-control).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final, Literal

from rosz.security.rules import ANYBODY, EVERYTHING, Permit, Rules
from rosz.wire import OWN_SPACE, SPACE, Kind

Flow = Literal["ingress", "egress"]
_Grant = tuple[Flow, tuple[str, ...], list[str]]
"""The direction, the kinds of messages, and the key expressions."""

_DATA: Final = ("put", "delete")
_LISTEN: Final = ("declare_subscriber",)
_ASK: Final = ("query",)
_ANSWER: Final = ("declare_queryable", "reply")
_TOKEN: Final = ("liveliness_token",)
_LOOK: Final = ("liveliness_query", "declare_liveliness_subscriber")
_MESSAGES: Final = (*_DATA, *_LISTEN, *_ASK, *_ANSWER, *_TOKEN, *_LOOK)

_OWN: Final = f"{OWN_SPACE}/*"
_BOTH: Final[tuple[Flow, Flow]] = ("ingress", "egress")
_ANY_KEY: Final = ["**", "**/@adv/**", f"{SPACE}/**", f"{OWN_SPACE}/**"]
"""All keys; wildcards do not match chunks that begin with ``@``."""


def access_control(rules: Rules | None, loopback: Sequence[str]) -> dict[str, Any]:
    """Return the ``access_control`` part of a Zenoh configuration.

    Args:
        rules: Permissions of each holder of a key; everything when not given.
        loopback: The network interfaces of links within the machine.
    """
    everything = [_rule("all", flow, _MESSAGES, _ANY_KEY) for flow in _BOTH]
    table = list(everything)
    subjects: list[dict[str, Any]] = [
        {"id": "interfaces of this machine", "interfaces": list(loopback)},
        {"id": "sockets of this machine", "link_protocols": ["unixsock-stream"]},
    ]
    policies = [_policy(everything, *(entry["id"] for entry in subjects))]
    permits = {ANYBODY: Permit.all()} if rules is None else rules.permits
    for holder, permit in permits.items():
        subject: dict[str, Any] = {"id": f"holder {holder}", "link_protocols": ["tls"]}
        if holder != ANYBODY:
            subject["cert_common_names"] = [holder]
        subjects.append(subject)
        own = everything
        if not permit.is_all:
            own = [
                _rule(f"{holder} {number}", *grant)
                for number, grant in enumerate(_grants(permit))
                if grant[2]
            ]
            table += own
        policies.append(_policy(own, subject["id"]))
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": table,
        "subjects": subjects,
        "policies": policies,
    }


def _policy(rules: Iterable[dict[str, Any]], *subjects: str) -> dict[str, Any]:
    return {"rules": [rule["id"] for rule in rules], "subjects": list(subjects)}


def _rule(name: str, flow: Flow, messages: Sequence[str], keys: Sequence[str]) -> dict[str, Any]:
    return {
        "id": f"{name} {flow}",
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": [_canonical(key) for key in keys],
    }


def _grants(permit: Permit) -> Iterator[_Grant]:
    """Yield the messages that a permit allows; all others are refused."""
    yield from _presence()
    yield from _topics(permit.publish, "ingress", "egress")
    yield from _topics(permit.subscribe, "egress", "ingress")
    yield from _services(permit.call, "ingress", "egress")
    yield from _services(permit.serve, "egress", "ingress")
    if permit.get:
        yield from _reading()
    if permit.set:
        yield from _setting(permit.set, reads=permit.get)
    if permit.control:
        # A newer node ends an older one of the same name, which asks it for its age.
        yield "ingress", _TOKEN, [f"{_OWN}/node/**"]
        yield "egress", _ASK, [f"{_OWN}/control/**"]
        yield "ingress", _ANSWER, [f"{_OWN}/control/**"]
        yield "ingress", _ASK, [f"{_OWN}/control/**", f"{_OWN}/launch/**"]
        yield "egress", _ANSWER, [f"{_OWN}/control/**", f"{_OWN}/launch/**"]
    if EVERYTHING in permit.publish:
        yield "ingress", _DATA, [f"{_OWN}/inbox/**"]
        yield "egress", _LISTEN, [f"{_OWN}/inbox/**"]


def _presence() -> Iterator[_Grant]:
    """Yield the messages that everybody needs: to watch tokens, be a node, and find peers.

    Watching is unrestricted, because each token that could be seen is restricted itself.
    """
    yield "egress", _TOKEN, [f"{_OWN}/node/**"]
    for flow in _BOTH:
        yield flow, _LOOK, _ANY_KEY
        yield flow, _TOKEN, [f"{SPACE}/*/*/*/*/{Kind.NODE.value}/**"]
        yield flow, (*_ASK, *_ANSWER), [f"{OWN_SPACE}/links/**", f"{_OWN}/dropped/*"]
        # Announcements say no more than the size of samples, which topics restrict.
        yield flow, (*_DATA, *_LISTEN), [f"{_OWN}/inbox/*/*/large"]


def _topics(names: Sequence[str], out: Flow, back: Flow) -> Iterator[_Grant]:
    """Yield the messages of topics whose samples go in one direction."""
    samples = _data(names)
    kept = [f"{key}/@adv/**" for key in samples]
    yield out, _DATA, samples
    yield back, _LISTEN, samples
    # The samples that a transient-local publisher keeps are queried with keys of their own.
    yield back, _ASK, kept
    yield out, _ANSWER, kept + samples
    yield out, _TOKEN, kept + _tokens(Kind.PUBLISHER, names)
    yield back, _TOKEN, kept + _tokens(Kind.SUBSCRIPTION, names)


def _services(names: Sequence[str], asked: Flow, answered: Flow) -> Iterator[_Grant]:
    """Yield the messages of services whose calls go in one direction."""
    calls = _data(names)
    yield asked, _ASK, calls
    yield answered, _ANSWER, calls
    yield asked, _TOKEN, _tokens(Kind.CLIENT, names)
    yield answered, _TOKEN, _tokens(Kind.SERVICE, names)


def _reading() -> Iterator[_Grant]:
    """Yield the messages of a replica that only receives, and of a client of a replica."""
    for flow in _BOTH:
        yield flow, _TOKEN, [f"{_OWN}/replica/**", f"{_OWN}/elder/**"]
        yield flow, _DATA, [f"{_OWN}/ack/*"]
        yield flow, _LISTEN, [f"{_OWN}/ack/*", f"{_OWN}/change/**"]
        # A write that seems lost is queried again; its key says which parameter it is for.
        yield flow, _ANSWER, [f"{_OWN}/store/*/write/**"]
    yield "egress", _DATA, [f"{_OWN}/change/**", f"{_OWN}/param/**"]
    yield "ingress", _LISTEN, [f"{_OWN}/param/**"]
    yield "egress", _ASK, [f"{_OWN}/store/*/write/**"]
    yield "ingress", _ASK, [f"{_OWN}/store/*/sync", f"{_OWN}/store/*/ask", f"{_OWN}/param/**"]
    yield "egress", _ANSWER, [f"{_OWN}/store/**", f"{_OWN}/param/**"]


def _setting(names: Sequence[str], *, reads: bool) -> Iterator[_Grant]:
    """Yield the messages that set parameters; the key of a write says which ones it sets.

    Args:
        names: The patterns of the parameters.
        reads: Whether the holder may read parameters too. If not, its replica sees those here, so
            that it waits for them, and they do not see it, because it cannot acknowledge writes.
    """
    # A name, and all names below it.
    places = [at if at.endswith("**") else f"{at}/**" for at in map(_chunks, names)]
    yield "ingress", _DATA, [f"{_OWN}/change/*/{at}" for at in places]
    if EVERYTHING in names:
        yield "ingress", _DATA, [f"{_OWN}/change"]
    verbs = ("write", "set", "tell") if reads else ("write", "set")
    yield "ingress", _ASK, [f"{_OWN}/store/*/{verb}/{at}" for verb in verbs for at in places]
    if not reads:
        yield "egress", _TOKEN, [f"{_OWN}/replica/**", f"{_OWN}/elder/**"]
        yield "egress", _LISTEN, [f"{_OWN}/change/**"]
        yield "ingress", _LISTEN, [f"{_OWN}/ack/*"]
        yield "egress", _DATA, [f"{_OWN}/ack/*"]
        yield "egress", _ANSWER, [f"{_OWN}/store/*/{verb}/**" for verb in verbs]
    elif EVERYTHING in names:
        # Only a holder that may set everything is queried for writes that others have missed.
        missed = [f"{_OWN}/store/*/sync", f"{_OWN}/store/*/tell/**"]
        yield "ingress", _ANSWER, missed
        yield "egress", _ASK, missed
        yield "ingress", _ANSWER, [f"{_OWN}/param/**"]
        yield "egress", _ASK, [f"{_OWN}/param/**"]


def _data(names: Sequence[str]) -> list[str]:
    return [f"*/{_chunks(name)}/*/*" for name in names]


def _tokens(kind: Kind, names: Sequence[str]) -> list[str]:
    """Return the keys of tokens, in which a whole name is one chunk with ``%`` for ``/``."""
    head = f"{SPACE}/*/*/*/*/{kind.value}/*/*/*"
    return [f"{head}/{chunk}/**" for name in names for chunk in _mangled(name)]


def _mangled(name: str) -> set[str]:
    """Return the chunks for a pattern of names; a wildcard in them also matches ``%``."""
    chunk = name.replace("/", "%").replace("**", "*").replace("*", "$*")
    return {"*" if part == "%$*" else part for part in (chunk, chunk.removesuffix("%$*")) if part}


def _chunks(name: str) -> str:
    """Return a pattern of names as chunks of a key expression."""
    parts = name.strip("/").split("/")
    return "/".join(part if part in {"*", "**"} else part.replace("*", "$*") for part in parts)


def _canonical(key: str) -> str:
    """Return a key expression in canonical form, as Zenoh requires: ``**`` comes after ``*``."""
    chunks: list[str] = []
    for chunk in key.split("/"):
        if chunks[-1:] != ["**"] or chunk not in {"*", "**"}:
            chunks.append(chunk)
        elif chunk == "*":
            chunks.insert(-1, chunk)
    return "/".join(chunks)
