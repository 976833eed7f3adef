"""The session of a command.

A short command is a client of the process at the rendezvous: it has one link and sees everything at
once. If no process listens there, since the one that did has ended, the command connects to another
process of this machine. A command that runs for long is a peer, so that it does not depend on the
process at the rendezvous. No command listens there, so that a core that starts meanwhile can.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeVar

import msgspec

from rosz.environment import Environment
from rosz.errors import TransportError
from rosz.session import (
    LocalPeers,
    MeshReadiness,
    Session,
    SessionConfig,
    connect_endpoint,
    find_waiting,
    is_listening,
    linked_session,
    places_of,
)

if TYPE_CHECKING:
    from rosz.node import Context

T = TypeVar("T")

_PEER_TIMEOUT = 0.5
"""Time limit for a first peer: more than the pause between its attempts to connect."""
_READY_TIMEOUT = 1.0
_LOOK_SECONDS = 0.002
_REPLY_TIMEOUT = 1.0
_WAITING_TIMEOUT = 0.5
_BUSY_TIMEOUT = 10.0
"""Time limit for a process that runs but is busy, as where many start at once."""


def open_session(environment: Environment) -> Session:
    """Open the session of a short command.

    Args:
        environment: Settings of this machine.

    Raises:
        TransportError: No process answers; the text says what to start.
    """
    client = _open_client(environment, Session.open)
    if client is not None:
        return client
    session = Session.open(_peer_config(environment))
    try:
        _wait_for_peers(session, environment)
    except BaseException:
        session.close()
        raise
    return session


def open_context(
    environment: Environment, argv: Sequence[str] = (), *, lasting: bool = False
) -> Context:
    """Open the context of a command that publishes, subscribes or calls.

    Args:
        environment: Settings of this machine.
        argv: Command line of its node, such as remappings.
        lasting: Whether the command runs until it is stopped.

    Raises:
        TransportError: No process answers; the text says what to start.
    """
    from rosz.node import Context

    client = _open_client(
        environment, lambda config, _: Context(environment, argv, config), allowed=not lasting
    )
    if client is not None:
        return client
    context = Context(environment, argv, _peer_config(environment))
    try:
        _wait_for_peers(context.session, environment)
        context.mesh.ready.wait(_READY_TIMEOUT)
    except BaseException:
        context.close()
        raise
    return context


def find_unreached(session: Session, environment: Environment) -> dict[str, str]:
    """Return the endpoints beyond this machine that a command does not reach.

    A command that was given several endpoints needs only one of them.

    Args:
        session: Session of the command, a client.
        environment: Settings of this machine.

    Returns:
        Who was to connect to each endpoint, as "by laptop".
    """
    links = session.links()
    unreached = {
        waiting.endpoint: f"by {waiting.host}"
        for waiting in find_waiting(session, _WAITING_TIMEOUT)
    }
    dialled = environment.connect
    if environment.keys is not None:
        dialled = tuple(map(connect_endpoint, dialled))
    if not any(linked_session(endpoint, links) for endpoint in dialled):
        unreached |= dict.fromkeys(environment.connect, "as ROSZ_CONNECT says")
    return unreached


def command_config(environment: Environment, peers: LocalPeers | None = None) -> SessionConfig:
    """Return the configuration of the session of a short command.

    Its time limit is longer if a process of rosz runs here, which will answer, and for the answer
    of another machine that accepts connections.

    Args:
        environment: Settings of this machine.
        peers: Processes of rosz on this machine; looked up when not given.
    """
    peers = peers or LocalPeers.read(environment.rendezvous)
    awake = not _reaches_beyond(environment) and peers.is_any_running
    patient = awake or _depends_on_others(environment)
    return SessionConfig.command(environment, _BUSY_TIMEOUT if patient else _REPLY_TIMEOUT)


def _peer_config(environment: Environment) -> SessionConfig:
    # Without the registrations that Linux has, others must find the command at the rendezvous.
    hold = sys.platform != "linux"
    return msgspec.structs.replace(SessionConfig.node(environment), hold_rendezvous=hold)


def _depends_on_others(environment: Environment) -> bool:
    """Tell whether a command is a client of another machine, so that no peer could do without."""
    return environment.mode == "client" and bool(environment.connect)


def _reaches_beyond(environment: Environment) -> bool:
    return bool(environment.connect or environment.multicast or environment.zenoh_config)


def _open_client(
    environment: Environment,
    open_client: Callable[[SessionConfig, LocalPeers], T],
    *,
    allowed: bool = True,
) -> T | None:
    """Open a client of the process at the rendezvous; return None where a peer is needed."""
    peers = LocalPeers.read(environment.rendezvous)
    beyond = _reaches_beyond(environment)
    if not beyond and not peers.has_peers and peers.why_unanswered:
        raise TransportError(peers.why_unanswered)
    occupied = is_listening(environment.rendezvous)
    if allowed and (
        beyond
        or environment.mode == "client"
        or (occupied and not peers.is_router_stopped)
        or (not occupied and peers.is_any_running)
    ):
        try:
            return open_client(command_config(environment, peers), peers)
        except TransportError as error:
            _check_free(environment, error)
            if _depends_on_others(environment):
                raise
    return None


def _check_free(environment: Environment, error: TransportError) -> None:
    """Check that a client failed to connect because the rendezvous is free, or raise the reason."""
    places_of(SessionConfig.command(environment))
    stopped = LocalPeers.read(environment.rendezvous).why_unanswered
    if stopped:
        raise TransportError(stopped) from error
    if is_listening(environment.rendezvous):
        raise TransportError(
            f"what listens at {environment.rendezvous} does not answer: it is stopped, or it is not"
            " Zenoh; end it, or set ROSZ_RENDEZVOUS to another endpoint for all"
        ) from error


def _wait_for_peers(session: Session, environment: Environment) -> None:
    """Wait until a peer is connected to all others."""
    deadline = time.monotonic() + _PEER_TIMEOUT
    while not session.peers():
        if time.monotonic() > deadline:
            where = ", ".join((environment.rendezvous, *environment.connect))
            raise TransportError(
                LocalPeers.read(environment.rendezvous).why_unanswered
                or f"nobody answers at {where}: start 'rosz core', a launch or a node, or set"
                " ROSZ_CONNECT to the endpoint of a machine where one runs"
            )
        time.sleep(_LOOK_SECONDS)
    MeshReadiness(session, _READY_TIMEOUT, threading.Event()).ready.wait(_READY_TIMEOUT)
