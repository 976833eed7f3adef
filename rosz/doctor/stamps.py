"""The stamps of samples: they tell the clock, and the release, of those who take no questions."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import msgspec

from rosz.doctor.finding import Finding, error
from rosz.errors import DecodeError
from rosz.introspect.survey import Survey
from rosz.session import Sample, Session
from rosz.wire import Kind, Token, endpoint_key, unpack

__all__ = ("check_stamps",)

_AHEAD = 0.1
"""Seconds by which a stamp may be ahead of its arrival."""

_BEHIND = 1.0
"""Seconds by which it may be behind: longer than a sample should be on its way."""

_SECOND = 1_000_000_000


class _First(msgspec.Struct):
    """The first sample of a topic.

    Attributes:
        age: Nanoseconds between its stamp and its arrival.
        damage: What is wrong with what it carries beside the message.
    """

    age: int = 0
    damage: str = ""


def check_stamps(session: Session, survey: Survey, seconds: float) -> Iterator[Finding]:
    """Listen to topics of ROS 2 nodes until each had one sample, and look at its stamp.

    Args:
        session: Where to listen.
        survey: Who is there.
        seconds: How long, at most.
    """
    mine = {zid for zid, _ in survey.processes}
    foreign = [token for token in survey.view.entities(Kind.PUBLISHER) if token.zid not in mine]
    heard = _listen(session, foreign, seconds) if seconds > 0 else []
    off = [
        f"{_who(survey, token)}: its stamps are {abs(first.age) / _SECOND:.2f} s"
        f" {'ahead of' if first.age < 0 else 'behind'} the clock here"
        for token, first in heard
        if not first.damage and not -_AHEAD * _SECOND <= first.age <= _BEHIND * _SECOND
    ]
    if off:
        yield error(
            "clock-offset",
            "clocks of nodes are not the one here: transforms and stamps do not match",
            sorted(off),
            "synchronise the clocks of all machines (chrony, or 'timedatectl set-ntp true')",
        )
    old = [f"{_who(survey, token)}: {first.damage}" for token, first in heard if first.damage]
    if old:
        yield error(
            "old-rmw-zenoh",
            "nodes send samples in a form that is not that of rmw_zenoh today",
            sorted(old),
            "update rmw_zenoh there to that of a current ROS 2 release",
        )


def _listen(
    session: Session, publishers: list[Token], seconds: float
) -> list[tuple[Token, _First]]:
    """Return the first sample of each topic; what needs no further look is let go at once."""
    found: dict[str, tuple[Token, _First]] = {}
    arrived = threading.Condition()
    topics = {
        endpoint_key(token.domain, token.name, token.type_name, token.type_hash): token
        for token in publishers
    }

    def take(key: str, sample: Sample) -> None:
        first = _look(sample)
        with arrived:
            found.setdefault(key, (topics[key], first))
            arrived.notify_all()

    taps = [session.subscriber(key, lambda sample, key=key: take(key, sample)) for key in topics]  # type: ignore[misc]  # mypy knows no lambda with defaults
    try:
        with arrived:
            arrived.wait_for(lambda: len(found) == len(topics), seconds)
            return list(found.values())
    finally:
        for tap in taps:
            tap.close()


def _look(sample: Sample) -> _First:
    now = time.time_ns()
    try:
        return _First(age=now - unpack(sample.attachment).source_time)
    except DecodeError as fault:
        return _First(damage=fault.reason)


def _who(survey: Survey, token: Token) -> str:
    return f"{token.node_name} ({survey.address(token)}) on {token.name}"
