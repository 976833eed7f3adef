"""How a command gets into the network.

A short one is a client of whoever holds the rendezvous: one link, and it sees everything at once.
When nobody holds it, because the process that did has ended, those that are left look for a new
meeting point all the time; then the command becomes that point and waits for them. One that stays
for long is a peer from the start, so that it lives on when the process at the rendezvous ends.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rosz.environment import Environment
from rosz.errors import TransportError
from rosz.session import LocalPeers, MeshReadiness, Session, SessionConfig, is_listening, places_of

if TYPE_CHECKING:
    from rosz.node import Context

__all__ = ("command_config", "open_context", "open_session")

_MEET_SECONDS = 0.5
"""Somewhat more than the pause in which a lone peer tries the rendezvous again."""
_SETTLE_SECONDS = 1.0
_LOOK_SECONDS = 0.002
_ANSWER_SECONDS = 1.0
_BUSY_SECONDS = 10.0
"""How long one that is known to be awake may take to answer, as where many start at once."""


def open_session(environment: Environment) -> Session:
    """Open the session of a command that asks and ends.

    Raises:
        TransportError: Nobody answers; the text says what to start.
    """
    peers = LocalPeers.read(environment.rendezvous)
    _check_awake(environment, peers)
    if _may_answer(environment, peers):
        try:
            return Session.open(command_config(environment, peers), peers)
        except TransportError as error:
            _check_free(environment, error)
    session = Session.open(SessionConfig.node(environment))
    try:
        _meet(session, environment)
    except BaseException:
        session.close()
        raise
    return session


def open_context(
    environment: Environment, argv: Sequence[str] = (), *, lasting: bool = False
) -> Context:
    """Open the context of a command that publishes, subscribes or calls.

    Args:
        environment: Settings.
        argv: Remappings and the like of its node.
        lasting: Whether it stays until it is told to end.

    Raises:
        TransportError: Nobody answers; the text says what to start.
    """
    from rosz.node import Context

    peers = LocalPeers.read(environment.rendezvous)
    _check_awake(environment, peers)
    if not lasting and _may_answer(environment, peers):
        try:
            return Context(environment, argv, command_config(environment, peers))
        except TransportError as error:
            _check_free(environment, error)
    context = Context(environment, argv)
    try:
        _meet(context.session, environment)
        context.settled.wait(_SETTLE_SECONDS)
    except BaseException:
        context.close()
        raise
    return context


def command_config(environment: Environment, peers: LocalPeers | None = None) -> SessionConfig:
    """Return what the session of a command that asks and ends is to be.

    It waits longer where a session of rosz is awake: whatever listens there will answer.
    """
    peers = peers or LocalPeers.read(environment.rendezvous)
    awake = not _reaches_beyond(environment) and peers.is_any_running
    return SessionConfig.command(environment, _BUSY_SECONDS if awake else _ANSWER_SECONDS)


def _reaches_beyond(environment: Environment) -> bool:
    return bool(environment.connect or environment.multicast or environment.zenoh_config)


def _check_awake(environment: Environment, peers: LocalPeers) -> None:
    """See that not all who are there are stopped.

    Raises:
        TransportError: They are.
    """
    if not _reaches_beyond(environment) and not peers.is_anybody_there and peers.why_unanswered:
        raise TransportError(peers.why_unanswered)


def _may_answer(environment: Environment, peers: LocalPeers) -> bool:
    """Tell whether it is worth the wait to try as a client."""
    return bool(
        _reaches_beyond(environment)
        or environment.mode == "client"
        or (is_listening(environment.rendezvous) and not peers.is_router_stopped)
    )


def _check_free(environment: Environment, error: TransportError) -> None:
    """See that a failure to connect is not one of something that holds the rendezvous.

    Raises:
        TransportError: Somebody listens there, and does not speak; or a setting is refused.
    """
    places_of(SessionConfig.command(environment))
    stopped = LocalPeers.read(environment.rendezvous).why_unanswered
    if stopped:
        raise TransportError(stopped) from error
    if is_listening(environment.rendezvous):
        raise TransportError(
            f"what listens at {environment.rendezvous} does not answer: it is stopped, or it is no"
            " Zenoh; end it, or set ROSZ_RENDEZVOUS to another endpoint for all"
        ) from error


def _meet(session: Session, environment: Environment) -> None:
    """Wait until a peer is linked to all that are there."""
    deadline = time.monotonic() + _MEET_SECONDS
    while not session.peers():
        if time.monotonic() > deadline:
            raise _nobody(environment)
        time.sleep(_LOOK_SECONDS)
    MeshReadiness(session, _SETTLE_SECONDS, threading.Event()).ready.wait(_SETTLE_SECONDS)


def _nobody(environment: Environment) -> TransportError:
    stopped = LocalPeers.read(environment.rendezvous).why_unanswered
    if stopped:
        return TransportError(stopped)
    where = ", ".join((environment.rendezvous, *environment.connect))
    return TransportError(
        f"nobody answers at {where}: start 'rosz core', a launch or a node, or set ROSZ_CONNECT to"
        " the endpoint of a machine where one runs"
    )
