"""Checks on replies of nodes, parameter replicas and routers, and on the stamps of samples.

The stamps tell the clock, and the release, of nodes that do not take requests.
"""

from __future__ import annotations

import json
import re
import socket
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import suppress
from functools import partial

import msgspec

from rosz.doctor.machine import Finding, error, stopped_note, warning
from rosz.errors import DecodeError
from rosz.introspect import Survey, process_address, take_survey
from rosz.node import NodeInfo, Request, control_key
from rosz.params.wire import (
    BUCKETS,
    Keys,
    ReplicaMember,
    SyncReply,
    SyncRequest,
    decode,
    encode,
    read_digest,
)
from rosz.session import Sample, Session, find_waiting, why_refused
from rosz.wire import Kind, Token, entity_key, read_attachment

_NODE_TIMEOUT = 1.5
_AGAIN = 0.4
"""Seconds after which samples and tokens on their way have arrived."""

_CLOCK_SECONDS = 0.1
"""Offset of a clock from which transforms and synchronised topics begin to fail."""

_SYNCHRONISE = "synchronise the clocks of all machines (chrony, or 'timedatectl set-ntp true')"

_Node = tuple[str, int]
_Pairs = set[tuple[str, str]]


class _NodeReply(msgspec.Struct, frozen=True):
    """The reply of a node, and the offset of its clock in nanoseconds.

    The possible error of the offset is half the time that the reply took.
    """

    info: NodeInfo
    offset: int
    doubt: int


def query_nodes(session: Session, domain: int) -> dict[_Node, _NodeReply]:
    """Query all rosz nodes at once, and return their replies by session and node id."""
    replies: dict[_Node, _NodeReply] = {}
    request = msgspec.msgpack.encode(Request("info"))
    asked, began = time.time_ns(), time.monotonic_ns()
    key = control_key(domain, "*", "*")
    for reply in session.query(key, timeout=_NODE_TIMEOUT, payload=request):
        if not reply.ok:
            continue
        round_trip = time.monotonic_ns() - began
        try:
            info = msgspec.msgpack.decode(reply.payload, type=NodeInfo)
            zid, number = reply.key.split("/")[-2:]
            node = zid, int(number)
        except (msgspec.MsgspecError, ValueError):  # not the reply of a node
            continue
        offset = info.now - asked - round_trip // 2 if info.now else 0
        replies[node] = _NodeReply(info, offset, round_trip // 2)
    return replies


def check_silent(
    session: Session, survey: Survey, replies: dict[_Node, _NodeReply]
) -> Iterator[Finding]:
    """Find nodes that are listed and do not reply."""
    silent = set(survey.processes) - set(replies)
    if not silent:
        return
    silent &= set(take_survey(session, survey.domain, processes=True).processes)
    silent -= set(query_nodes(session, survey.domain))
    barred = _barred(session, survey, silent, replies)
    silent -= barred
    yield from warning(
        "silent-machine",
        f"{_listed(barred)}, but nothing on those machines answers",
        sorted(_name(survey, node) for node in barred),
        "nothing, if the rules there are not to let this machine control nodes (control: in"
        " rules.yaml); else they hang, or the link to their machine is broken",
    )
    yield from error(
        "unreachable-node",
        f"{_listed(silent)} without an answer",
        sorted(_name(survey, node) + stopped_note(survey.processes[node]) for node in silent),
        "they hang, are stopped (Ctrl-Z: 'fg' lets them go on), or the link to their machine"
        " is broken: check it with ping, and end them with 'rosz node kill'",
    )


def _listed(nodes: set[_Node]) -> str:
    return "1 node is listed" if len(nodes) == 1 else f"{len(nodes)} nodes are listed"


def _barred(
    session: Session, survey: Survey, silent: set[_Node], replies: dict[_Node, _NodeReply]
) -> set[_Node]:
    """Return the nodes that access rules may keep from replying: all those of a machine."""
    if not session.secured:
        return set()
    hosts = {node: process.host for node, process in survey.processes.items()}
    speak = {hosts.get(node, "") for node in replies} | {socket.gethostname()}
    return {node for node in silent if node in hosts and hosts[node] not in speak}


def check_visibility(
    session: Session, survey: Survey, replies: dict[_Node, _NodeReply]
) -> Iterator[Finding]:
    """Find nodes that do not see other running nodes."""
    stopped = session.out_of_reach()
    if not _blind(survey, replies, stopped):
        return
    time.sleep(_AGAIN)
    survey = take_survey(session, survey.domain, processes=True)
    replies = query_nodes(session, survey.domain)
    blind = _blind(survey, replies, stopped)
    lines: list[str] = []
    for pair in sorted(blind):
        here, there = (_names(survey, zid) for zid in pair)
        if pair[::-1] not in blind:
            lines.append(f"{here} does not see {there}: one way")
        elif pair[0] < pair[1]:
            lines.append(f"{here} and {there} do not see each other")
    yield from error(
        "unreachable-peer",
        "running nodes do not see each other",
        lines,
        "their machines reach a third one but not each other: run 'rosz core' on each and connect"
        " them (--connect), or open the firewall and let ROSZ_LISTEN name an address that the"
        " others reach; access rules in a Zenoh configuration can cause it, too",
    )


def _blind(survey: Survey, replies: dict[_Node, _NodeReply], stopped: set[str]) -> _Pairs:
    """Return pairs of sessions of which one does not see the other, stopped ones aside."""
    there = {zid for zid, _ in survey.processes} - stopped
    sees = {
        zid: {zid, *reply.info.sees}
        for (zid, _), reply in replies.items()
        if zid in there and reply.info.sees  # older releases do not say whom they see
    }
    return {(zid, other) for zid, seen in sees.items() for other in there - seen}


def check_waiting(session: Session) -> Iterator[Finding]:
    """Find endpoints that cores and nodes connect to and do not reach."""
    for dialler in find_waiting(session, _NODE_TIMEOUT, everywhere=True):
        reason = why_refused(dialler.endpoint) if dialler.host == socket.gethostname() else ""
        yield from warning(
            "waiting-for",
            f"{dialler.host} is waiting for {dialler.endpoint}",
            [reason or "there is no link yet"],
            "start 'rosz core --listen tcp/0.0.0.0:7447' there, or check the name, the port and the"
            " firewalls between; it is connected to as soon as it is up",
        )


def check_clocks(survey: Survey, replies: dict[_Node, _NodeReply]) -> Iterator[Finding]:
    """Find machines whose clock differs from the one here."""
    best: dict[str, tuple[_Node, _NodeReply]] = {}
    for node, reply in replies.items():
        zid = node[0]
        if reply.info.now and (zid not in best or reply.doubt < best[zid][1].doubt):
            best[zid] = node, reply
    lines: defaultdict[str, list[str]] = defaultdict(list)
    for node, reply in best.values():
        if abs(reply.offset) - reply.doubt > _CLOCK_SECONDS * _SECOND:
            way = "ahead of" if reply.offset > 0 else "behind"
            seconds = abs(reply.offset) / _SECOND
            lines[reply.info.host].append(
                f"{_name(survey, node)}: its clock is {seconds:.2f} s {way} the one here"
                f" (± {reply.doubt / _SECOND:.2f} s)"
            )
    for host, evidence in sorted(lines.items()):
        yield from error(
            "clock-offset",
            f"the clock of {host} is not the one here: transforms and stamps do not match",
            sorted(evidence),
            _SYNCHRONISE,
        )


def _name(survey: Survey, node: _Node) -> str:
    process = survey.processes.get(node)
    return (
        f"session {node[0]}" if process is None else f"{process.node} ({process_address(process)})"
    )


def _names(survey: Survey, zid: str) -> str:
    """Return a description of a session by its nodes."""
    nodes = sorted((p for p in survey.processes.values() if p.zid == zid), key=lambda p: p.node)
    if not nodes:
        return f"session {zid}"
    more = f" and {len(nodes) - 1} more" if len(nodes) > 1 else ""
    return f"{nodes[0].node}{more} ({process_address(nodes[0])})"


_AHEAD = 0.1
"""Seconds that a stamp may be ahead of its arrival."""

_BEHIND = 1.0
"""Seconds that a stamp may be behind its arrival; no sample should take that long."""

_SECOND = 1_000_000_000


class _First(msgspec.Struct):
    """The age of a topic's first sample in nanoseconds, or why its stamp cannot be read."""

    age: int = 0
    damage: str = ""


def check_stamps(session: Session, survey: Survey, seconds: float) -> Iterator[Finding]:
    """Find ROS 2 nodes whose samples have stamps of another clock or an old form.

    Args:
        session: The session to subscribe with.
        survey: The nodes that are running.
        seconds: Time limit for the first sample of each topic, in seconds.
    """
    own = {zid for zid, _ in survey.processes}
    foreign = [token for token in survey.view.entities(Kind.PUBLISHER) if token.zid not in own]
    heard = _listen(session, foreign, seconds) if seconds > 0 else []
    off = [
        f"{_who(survey, token)}: its stamps are {abs(first.age) / _SECOND:.2f} s"
        f" {'ahead of' if first.age < 0 else 'behind'} the clock here"
        for token, first in heard
        if not first.damage and not -_AHEAD * _SECOND <= first.age <= _BEHIND * _SECOND
    ]
    yield from error(
        "clock-offset",
        "clocks of nodes are not the one here: transforms and stamps do not match",
        sorted(off),
        _SYNCHRONISE,
    )
    old = [f"{_who(survey, token)}: {first.damage}" for token, first in heard if first.damage]
    yield from error(
        "old-rmw-zenoh",
        "nodes send samples in a form that is not that of rmw_zenoh today",
        sorted(old),
        "update rmw_zenoh there to that of a current ROS 2 release",
    )


def _listen(
    session: Session, publishers: list[Token], seconds: float
) -> list[tuple[Token, _First]]:
    """Return the first sample of each topic that has one in time."""
    samples: dict[str, tuple[Token, _First]] = {}
    arrived = threading.Condition()
    topics = {
        entity_key(token.domain, token.name, token.type_name, token.type_hash): token
        for token in publishers
    }

    def receive(key: str, sample: Sample) -> None:
        now = time.time_ns()
        try:
            first = _First(age=now - read_attachment(sample.attachment)[1])
        except DecodeError as fault:
            first = _First(damage=fault.reason)
        with arrived:
            samples.setdefault(key, (topics[key], first))
            arrived.notify_all()

    subscribers = [session.subscriber(key, partial(receive, key)) for key in topics]
    try:
        with arrived:
            arrived.wait_for(lambda: len(samples) == len(topics), seconds)
            return list(samples.values())
    finally:
        for subscriber in subscribers:
            subscriber.close()


def _who(survey: Survey, token: Token) -> str:
    return f"{token.node_name} ({survey.address(token)}) on {token.name}"


_OLDEST_ZENOH = (1, 4)
"""Release that rmw_zenoh of ROS 2 Humble and Jazzy began with in its present form."""

_TIMEOUT = 1.0
_ADMIN_SECONDS = 0.5
_LOOKS = 4
_PAUSE = 0.25
_VERSION = re.compile(r"v?(\d+)\.(\d+)")


def check_replicas(session: Session, domain: int) -> Iterator[Finding]:
    """Find parameter replicas that differ from the others, or do not reply."""
    keys = Keys(domain)
    digests: dict[str, list[int]] = {}
    for look in range(_LOOKS):
        if look:
            time.sleep(_PAUSE)  # a write on its way reaches all meanwhile
        members = [keys.member(token) for token in session.live_tokens(keys.tokens, _TIMEOUT)]
        before, digests = digests, _digests(session, keys, members)
        if len(members) == len(digests) and len(set(map(tuple, digests.values()))) <= 1:
            return
    silent = [member for member in members if member.zid not in digests]
    yield from error(
        "replica-silent",
        "replicas of the parameters do not reply: a write may wait for them to time out",
        sorted(f"{member.label} (session {member.zid})" for member in silent),
        "they hang or are stopped: let them go on, or end them",
    )
    lines = sorted(
        f"{member.label} (session {member.zid}): other writes in {count} of {BUCKETS} buckets"
        for member in members
        if (count := _differing(member.zid, before, digests))
    )
    yield from error(
        "replica-out-of-step",
        "replicas of the parameters differ, and stay so",
        lines,
        "it does not hear what the others write, or they do not hear it: check the link to its"
        " machine, then start it again",
    )


def _digests(session: Session, keys: Keys, members: list[ReplicaMember]) -> dict[str, list[int]]:
    request = encode(SyncRequest())
    asked = {
        member.zid: session.query(keys.of(member.zid, "sync"), timeout=_TIMEOUT, payload=request)
        for member in members
    }
    return {
        zid: read_digest(decode(reply.payload, SyncReply).digest)
        for zid, replies in asked.items()
        for reply in replies
        if reply.ok
    }


def _differing(zid: str, before: dict[str, list[int]], now: dict[str, list[int]]) -> int:
    """Return how many buckets of a replica differ from those of most, and have not changed.

    Where somebody writes all the time, buckets differ at each look, and change between them.
    """
    if zid not in before or zid not in now:
        return 0
    (usual, _) = Counter(map(tuple, now.values())).most_common(1)[0]
    numbers = zip(before[zid], now[zid], usual, strict=True)
    return sum(own == past != most for past, own, most in numbers)


def check_versions(session: Session) -> Iterator[Finding]:
    """Find routers and peers of an old Zenoh, as far as they have an admin space."""
    old: list[str] = []
    for reply in session.get("@/*/*", timeout=_ADMIN_SECONDS):
        _, zid, *kind = reply.key.split("/") if reply.ok else ("", "")
        if kind not in (["router"], ["peer"]):
            continue
        with suppress(ValueError, AttributeError):  # not JSON, or without a version
            version = str(json.loads(reply.payload).get("version"))
            match = _VERSION.match(version)
            if match and (int(match[1]), int(match[2])) < _OLDEST_ZENOH:
                old.append(f"{kind[0]} {zid}: Zenoh {version}")
    yield from warning(
        "old-zenoh",
        f"parts of the network have a Zenoh before {'.'.join(map(str, _OLDEST_ZENOH))}",
        sorted(old),
        "update them: latched topics and the presence of nodes rely on what came since",
    )
