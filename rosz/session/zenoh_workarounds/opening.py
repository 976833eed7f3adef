"""What a session needs while it opens.

Seen with eclipse-zenoh 1.10.2. None of it is reported upstream yet.

- Zenoh receives on several threads, which hand the data of a link from one core to another: without
  `prepare_process`, a round trip takes a quarter longer. In a router, though, a link that is given
  up blocks its thread for seconds, and with it all links of that thread; so a router gets more.
- The C library returns freed memory to the kernel: without `prepare_process`, each image is written
  into new pages, which takes longer than to send it.
- A client connects to the first of its endpoints only, whether anybody answers there or not:
  without `reachable_config`, it fails although another one answers.
- Peers hear of each other from the one at the rendezvous: without `connect_to_running`, a newcomer
  finds nobody while that process is stopped.
- Of two processes that begin to listen at one port at the same moment, Linux may refuse both,
  because each finds the other one about to. Zenoh does not try again: without `open_and_listen`,
  they would never meet.
"""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import zenoh

from rosz.errors import TransportError
from rosz.session.config import SessionConfig
from rosz.session.local_peers import LocalPeers
from rosz.session.probe import first_listening, is_listening
from rosz.session.processes import describe_process, how_to_resume
from rosz.wire import Endpoint

__all__ = ("connect_to_running", "open_and_listen", "prepare_process", "reachable_config")

_RUNTIME = "ZENOH_RUNTIME"
_ROUTER_RECEIVERS = 16
_KEPT_BYTES = 31 << 20
"""Just below the largest block that glibc adapts to."""
_RARE_RETRIES = (
    "retry_period_init_ms=100;retry_period_max_ms=86400000;retry_period_increase_factor=1.25"
)
"""Options of an endpoint where a session listens soon, or never.

A session that opens slowly is registered seconds before it listens. The small factor finds it after
a quarter more of that time.
"""
_ATTEMPTS = 8
_PAUSE = 0.02

_log = logging.getLogger("rosz.session")


@contextmanager
def prepare_process(mode: str) -> Iterator[None]:
    """Set the number of receiving threads, unless the user does, and keep freed memory.

    Zenoh reads the number once, when the first session of the process opens. Measured with images
    of 1 MB, two and a half times as many per second come through when memory is kept. glibc keeps
    twice the size of the largest block that was ever mapped on its own and freed, so that is 62 MB;
    no page of this block is touched. Other C libraries ignore it.
    """
    bytes(_KEPT_BYTES)
    given = _RUNTIME in os.environ
    if not given:
        count = _ROUTER_RECEIVERS if mode == "router" else 1
        os.environ[_RUNTIME] = f"(rx: (worker_threads: {count}))"
    try:
        yield
    finally:
        if not given:
            os.environ.pop(_RUNTIME, None)


def reachable_config(config: SessionConfig, peers: LocalPeers) -> SessionConfig | None:
    """Return the configuration of a client, reduced to the first endpoint that answers.

    A command prefers the endpoints that it was given to this machine. A node is a client of the
    router of this machine first.

    Returns:
        The configuration, unchanged if it is not of a client; ``None`` if nobody answers anywhere.

    Raises:
        TransportError: The process at the rendezvous is stopped, and there is no other endpoint.
    """
    if config.mode != "client" or config.config_file:
        return config
    local = _local_endpoints(config, peers)
    wanted = (*config.connect, *local) if config.must_connect else (*local, *config.connect)
    if wanted == (config.rendezvous,):
        return config
    endpoint = first_listening(wanted, config.open_timeout)
    return msgspec.structs.replace(config, rendezvous=endpoint, connect=()) if endpoint else None


def _local_endpoints(config: SessionConfig, peers: LocalPeers) -> tuple[str, ...]:
    """Return the rendezvous, or the endpoints of running sessions if its holder is stopped."""
    if peers.stopped_holder is None:
        return (config.rendezvous,)
    running = tuple(peer.endpoint for peer in peers if peer.port and not peer.is_stopped)
    if not running and not config.connect:
        raise TransportError(peers.why_unanswered)
    return running


def connect_to_running(settings: zenoh.Config, peers: LocalPeers) -> None:
    """Connect a peer to all running sessions directly if the rendezvous is held by a stopped one.

    They are tried ever more rarely, because nobody knows who will listen there in an hour.
    """
    pid = peers.stopped_holder
    if pid is None:
        return
    _log.warning(
        "%s holds the meeting point %s and is stopped: it is not reached until it goes on (%s)",
        describe_process(pid),
        peers.rendezvous,
        how_to_resume(pid),
    )
    running = [
        f"{peer.endpoint}#{_RARE_RETRIES}" for peer in peers if peer.port and not peer.is_stopped
    ]
    connect = [*running, *json.loads(settings.get_json("connect/endpoints"))]
    settings.insert_json5("connect/endpoints", json.dumps(connect))
    settings.insert_json5("connect/timeout_ms", "-1")  # in the background


def open_and_listen(settings: zenoh.Config, rendezvous: str, opened: Callable[[], Any]) -> Any:
    """Open a session, and make sure that somebody listens at the rendezvous afterwards.

    Args:
        settings: The configuration.
        rendezvous: The endpoint of the rendezvous. Nothing is checked if it is on another machine,
            or if the configuration does not listen at it.
        opened: Function that opens a session by the configuration, with a new id each time.

    Raises:
        zenoh.ZError: The session cannot be opened.
    """
    raw: Any = opened()
    endpoint = Endpoint(rendezvous)
    if _can_be_refused(endpoint) and _listens_at(endpoint, settings):
        for _ in range(_ATTEMPTS):
            if is_listening(rendezvous):
                break
            raw.close()
            # Two processes that were refused together must not try again together.
            time.sleep(_PAUSE * os.urandom(1)[0] / 256)
            raw = opened()
    return raw


def _can_be_refused(endpoint: Endpoint) -> bool:
    return endpoint.is_local and (endpoint.is_unix or endpoint.protocol == "tcp")


def _listens_at(endpoint: Endpoint, settings: zenoh.Config) -> bool:
    """Tell whether a configuration listens at an endpoint, also under another host name."""
    endpoints = settings.get_json("listen/endpoints")
    return str(endpoint) in endpoints or f":{endpoint.port}" in endpoints
