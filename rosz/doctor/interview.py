"""Asking all rosz nodes at once: who answers, whom does each see, and what time has it?"""

from __future__ import annotations

import socket
import time
from collections import defaultdict
from collections.abc import Iterator

import msgspec

from rosz.doctor.finding import Finding, error, warning
from rosz.doctor.stopped import state
from rosz.introspect.survey import Survey, process_address, take_survey
from rosz.node.control import NodeInfo, Request, control_key
from rosz.session import Session

__all__ = ("Answer", "check_answers", "check_clocks", "check_sight", "interview")

_SECONDS = 1.5
_AGAIN = 0.4
"""Seconds after which what was only on its way has arrived."""

CLOCK_SECONDS = 0.1
"""An offset beyond which transforms and synchronised topics begin to fail."""

_SECOND = 1_000_000_000
_Node = tuple[str, int]


class Answer(msgspec.Struct, frozen=True):
    """What a node said.

    Attributes:
        info: About itself.
        offset: How far its clock is ahead of the one here, in nanoseconds.
        doubt: By how much that may be wrong, since the answer took its time.
    """

    info: NodeInfo
    offset: int
    doubt: int


def interview(session: Session, domain: int) -> dict[_Node, Answer]:
    """Return the answers of all rosz nodes, by session and number."""
    answers: dict[_Node, Answer] = {}
    question = msgspec.msgpack.encode(Request("info"))
    asked, began = time.time_ns(), time.monotonic_ns()
    key = control_key(domain, "*", "*")
    for reply in session.query(key, timeout=_SECONDS, payload=question):
        if not reply.ok:
            continue
        journey = time.monotonic_ns() - began
        try:
            info = msgspec.msgpack.decode(reply.payload, type=NodeInfo)
            zid, number = reply.key.split("/")[-2:]
            node = zid, int(number)
        except (msgspec.MsgspecError, ValueError):  # no answer of a node's
            continue
        offset = info.now - asked - journey // 2 if info.now else 0
        answers[node] = Answer(info, offset, journey // 2)
    return answers


def check_answers(
    session: Session, survey: Survey, answers: dict[_Node, Answer]
) -> Iterator[Finding]:
    """Find nodes that are listed and do not answer."""
    silent = set(survey.processes) - set(answers)
    if not silent:
        return
    silent &= set(take_survey(session, survey.domain, processes=True).processes)
    silent -= set(interview(session, survey.domain))
    barred = _barred(session, survey, silent, answers)
    silent -= barred
    if barred:
        yield warning(
            "silent-machine",
            f"{len(barred)} nodes are listed, and none of their machines answers",
            sorted(_name(survey, node) for node in barred),
            "nothing, if the rules there are not to let this machine control nodes (control: in"
            " rules.yaml); else they hang, or the link to their machine is broken",
        )
    if silent:
        yield error(
            "unreachable-node",
            f"{len(silent)} nodes are listed and do not answer",
            sorted(_name(survey, node) + _state(survey, node) for node in silent),
            "they hang, are stopped (Ctrl-Z: 'fg' lets them go on), or the link to their machine"
            " is broken: check it with ping, and end them with 'rosz node kill'",
        )


def _barred(
    session: Session, survey: Survey, silent: set[_Node], answers: dict[_Node, Answer]
) -> set[_Node]:
    """Return the nodes that rules may keep from answering: all of a machine that needs keys."""
    if not session.secured:
        return set()
    known = {node: process.host for node, process in survey.processes.items()}
    speak = {known.get(node, "") for node in answers} | {socket.gethostname()}
    return {node for node in silent if node in known and known[node] not in speak}


def check_sight(
    session: Session, survey: Survey, answers: dict[_Node, Answer]
) -> Iterator[Finding]:
    """Find nodes that do not see others which are there."""
    stopped = session.out_of_reach()
    if not _blind(survey, answers, stopped):
        return
    time.sleep(_AGAIN)
    survey, answers = (
        take_survey(session, survey.domain, processes=True),
        interview(session, survey.domain),
    )
    blind = _blind(survey, answers, stopped)
    if not blind:
        return
    lines: list[str] = []
    for here, there in sorted(blind):
        if (there, here) not in blind:
            lines.append(f"{_names(survey, here)} does not see {_names(survey, there)}: one way")
        elif here < there:
            lines.append(
                f"{_names(survey, here)} and {_names(survey, there)} do not see each other"
            )
    yield error(
        "unreachable-peer",
        "nodes that are there do not see each other",
        lines,
        "their machines reach a third one but not each other: run 'rosz core' on each and connect"
        " them (--connect), or open the firewall and let ROSZ_LISTEN name an address that the"
        " others reach; access rules in a Zenoh configuration can cause it, too",
    )


def _blind(survey: Survey, answers: dict[_Node, Answer], stopped: set[str]) -> set[tuple[str, str]]:
    """Return who does not see whom, by session; those that are stopped are seen by no newcomer."""
    there = {zid for zid, _ in survey.processes} - stopped
    sees = {zid: {zid, *answer.info.sees} for (zid, _), answer in answers.items() if zid in there}
    return {
        (zid, other)
        for zid, seen in sees.items()
        for other in there - seen
        if answers_know(answers, zid)
    }


def answers_know(answers: dict[_Node, Answer], zid: str) -> bool:
    """Tell whether a session's nodes say whom they see; those of an older rosz do not."""
    return any(answer.info.sees for (each, _), answer in answers.items() if each == zid)


def check_clocks(survey: Survey, answers: dict[_Node, Answer]) -> Iterator[Finding]:
    """Find machines whose clock is not that of this one."""
    best: dict[str, tuple[_Node, Answer]] = {}
    for node, answer in answers.items():
        zid = node[0]
        if answer.info.now and (zid not in best or answer.doubt < best[zid][1].doubt):
            best[zid] = node, answer
    lines: defaultdict[str, list[str]] = defaultdict(list)
    for node, answer in best.values():
        if abs(answer.offset) - answer.doubt > CLOCK_SECONDS * _SECOND:
            way = "ahead of" if answer.offset > 0 else "behind"
            seconds = abs(answer.offset) / _SECOND
            lines[answer.info.host].append(
                f"{_name(survey, node)}: its clock is {seconds:.2f} s {way} the one here"
                f" (± {answer.doubt / _SECOND:.2f} s)"
            )
    for host, evidence in sorted(lines.items()):
        yield error(
            "clock-offset",
            f"the clock of {host} is not the one here: transforms and stamps do not match",
            sorted(evidence),
            "synchronise the clocks of all machines (chrony, or 'timedatectl set-ntp true')",
        )


def _name(survey: Survey, node: _Node) -> str:
    process = survey.processes.get(node)
    return (
        f"session {node[0]}" if process is None else f"{process.node} ({process_address(process)})"
    )


def _state(survey: Survey, node: _Node) -> str:
    process = survey.processes.get(node)
    return "" if process is None else state(process)


def _names(survey: Survey, zid: str) -> str:
    """Name a session by its nodes."""
    mine = sorted((p for p in survey.processes.values() if p.zid == zid), key=lambda p: p.node)
    if not mine:
        return f"session {zid}"
    more = f" and {len(mine) - 1} more" if len(mine) > 1 else ""
    return f"{mine[0].node}{more} ({process_address(mine[0])})"
