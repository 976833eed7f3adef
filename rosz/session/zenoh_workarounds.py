"""Workarounds for Zenoh's behaviour, seen with eclipse-zenoh 1.10.2; none is reported upstream yet.

What happens without them:

- `prepare_process`: Zenoh receives on several threads, which hand the data of a link from one core
  to another, so a round trip takes a quarter longer. In a router, though, a link that is given up
  blocks its thread for seconds, and with it all links of that thread; so a router gets more. The C
  library returns freed memory to the kernel, so each image is written into new pages, which takes
  longer than to send it.
- `reachable_config`: A client connects to the first of its endpoints only, whether anybody answers
  there or not, and fails although another one answers.
- `connect_to_running`: Peers hear of each other from the one at the rendezvous, so a newcomer finds
  nobody while that process is stopped or has ended. Routers do not hear of each other there at all,
  and a peer between two routers does not forward the tokens of one of them.
- `open_and_listen`: Of two processes that begin to listen at one port at the same moment, Linux may
  refuse both, because each finds the other one about to. Zenoh does not try again, so they would
  never meet.
- `close_links_at_once`: When Zenoh closes a TCP connection, it makes the system wait up to ten
  seconds until the other end has received all data (SO_LINGER, socket(7)), and that on the
  thread that receives for the whole session. A new link to a machine that was cut off would be up
  long before any data came through it. Nothing is lost by not waiting: the system goes on sending.
- `close_links`: Closing a session waits until the links that it is about to open have come about or
  failed, and until all that is queued for its links is sent. That takes ten seconds next to a
  process that is stopped, and beside a connection on which the other end says nothing. Ending the
  connection below makes either fail at once. Data that the system has accepted for a stopped
  process is there when it resumes.
- `remove_abandoned_segments`: Zenoh removes abandoned segments of shared memory only when a session
  with shared memory opens, so the memory of a process that was killed stays allocated until then.
"""

from __future__ import annotations

import fcntl
import logging
import os
import re
import socket
import stat
import struct
import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from ipaddress import ip_address
from pathlib import Path
from typing import Any, Final

import msgspec
import zenoh

from rosz.errors import TransportError
from rosz.lifecycle import Closable
from rosz.session.channels import declare_callback
from rosz.session.config import SessionConfig, insert_setting, read_setting
from rosz.session.declared import Callbacks
from rosz.session.local_peers import (
    LocalPeers,
    describe_process,
    how_to_resume,
    pid_of_peer,
    tcp_ports,
)
from rosz.session.probe import first_listening, is_listening
from rosz.wire import Endpoint
from rosz.worker import start_thread

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
_FIND_SECONDS = 1.5
"""Seconds in which another machine accepts a connection if somebody listens there."""
_ATTEMPTS = 8
_PAUSE = 0.02
_OPEN_FILES: Final = Path("/dev/fd")
_TCP: Final = re.compile(r"(?:tcp|tls)/([^%#?\]]+)(?:%\w+)?(\]?:\d+)")
_NO_WAIT: Final = struct.pack("ii", 0, 0)
_RECEIVED: Final = slice(128, 136)
"""The place of tcpi_bytes_received in the struct tcp_info of Linux."""
_GRACE_SECONDS: Final = 0.1
_AGAIN_SECONDS: Final = 0.01
"""The pause between attempts: after one address of a process, Zenoh tries the next."""
SEGMENTS = Path("/dev/shm")  # noqa: S108  # the place on Linux
"""The folder of the segments."""
_SUFFIX = ".zenoh"
_LOCK = ".lock"
_MIN_AGE = 2.0
"""Seconds that the maker of a segment has between creating and locking it."""

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
    if _RUNTIME in os.environ:
        yield
        return
    count = _ROUTER_RECEIVERS if mode == "router" else 1
    os.environ[_RUNTIME] = f"(rx: (worker_threads: {count}))"
    try:
        yield
    finally:
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
    local = [config.rendezvous]
    if peers.stopped_holder is not None:
        local = peers.running
        if not local and not config.connect:
            raise TransportError(peers.why_unanswered)
    elif config.must_connect and not is_listening(config.rendezvous):
        local += peers.running
    wanted = [*config.connect, *local] if config.must_connect else [*local, *config.connect]
    if wanted == [config.rendezvous]:
        return config
    endpoint = first_listening(wanted, search_seconds(config, peers))
    return msgspec.structs.replace(config, rendezvous=endpoint, connect=()) if endpoint else None


def search_seconds(config: SessionConfig, peers: LocalPeers) -> float:
    """Return for how long a client looks for an endpoint that accepts connections."""
    if config.connect and not peers.is_any_running:  # one that runs here may be about to listen
        return min(config.open_timeout, _FIND_SECONDS)
    return config.open_timeout


def connect_to_running(settings: zenoh.Config, peers: LocalPeers, config: SessionConfig) -> None:
    """Connect to all running sessions directly where nobody at the rendezvous introduces them.

    They are tried ever more rarely, because nobody knows who will listen there in an hour.

    Args:
        settings: The settings of the session.
        peers: The other sessions of this machine.
        config: The configuration that the settings were made from.
    """
    pid = peers.stopped_holder
    if pid is not None:
        what = f"{describe_process(pid)} holds the meeting point {peers.rendezvous} and is stopped"
        _log.warning("%s: it is not reached until it resumes (%s)", what, how_to_resume(pid))
    elif not config.rendezvous_is_held and (
        config.hold_rendezvous or is_listening(peers.rendezvous)
    ):
        return
    running = [f"{endpoint}#{_RARE_RETRIES}" for endpoint in peers.running]
    connect = [*running, *read_setting(settings, "connect/endpoints")]
    insert_setting(settings, "connect/endpoints", connect)
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
    listen = settings.get_json("listen/endpoints")
    if not endpoint.is_local or not (endpoint.is_unix or endpoint.protocol == "tcp"):
        return raw
    if rendezvous not in listen and f":{endpoint.port}" not in listen:  # also by another host name
        return raw
    for _ in range(_ATTEMPTS):
        if is_listening(rendezvous):
            break
        raw.close()
        # Two processes that were refused together must not try again together.
        time.sleep(_PAUSE * os.urandom(1)[0] / 256)
        raw = opened()
    return raw


class _DelayingLinks:
    """The connections of this process that lead to stopped processes, or to silent ones.

    Args:
        raw: The session of Zenoh.
        peers: The sessions of this machine.
        ports: The ports at which connections on which nothing has come count as well.
    """

    def __init__(self, raw: Any, peers: LocalPeers, ports: Collection[int]) -> None:
        self._silent = ports
        meeting = Endpoint(peers.rendezvous)
        sessions = {peer.zid for peer in peers.stopped}
        links = [link for link in raw.info.links() if str(link.zid) in sessions]
        self._pids = {peer.pid for peer in peers.stopped}
        self._path = meeting.address if meeting.is_unix else ""
        self._ports = {Endpoint(link.dst).port for link in links}
        self._ports.update(peer.port for peer in peers.stopped)
        self._ports.update(*(tcp_ports(pid) for pid in self._pids))
        if peers.stopped_holder is not None:
            self._ports.add(meeting.port)
        self._ports -= {0, None}

    def change(self, change: Callable[[socket.socket], None]) -> None:
        """Change all these connections."""
        for connection, _, _ in _connections():
            with suppress(OSError):  # it has ended meanwhile
                if self._is_other_end(connection):
                    change(connection)

    def _is_other_end(self, connection: socket.socket) -> bool:
        there = connection.getpeername()
        if connection.family == socket.AF_UNIX:
            ends = (there, connection.getsockname())
            # Private sockets are beside that of the rendezvous, and their names begin with its.
            ours = bool(self._path) and any(str(end).startswith(self._path) for end in ends)
            return ours and pid_of_peer(connection) in self._pids
        if connection.family not in {socket.AF_INET, socket.AF_INET6}:
            return False
        if there[1] in self._ports and ip_address(there[0].partition("%")[0]).is_loopback:
            return True
        used = {there[1], connection.getsockname()[1]}
        return not used.isdisjoint(self._silent) and _has_received_nothing(connection)


def _has_received_nothing(connection: socket.socket) -> bool:
    state = connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, _RECEIVED.stop)
    return len(state) == _RECEIVED.stop and not any(state[_RECEIVED])


def close_links_at_once(raw: Any) -> Closable:
    """Return a watch that makes a session close its TCP links at once, now and in the future."""
    declared = declare_callback(partial(raw.info.declare_link_events_listener, history=True))
    return Callbacks("watch of links", declared, _set_no_wait)


def _set_no_wait(event: Any) -> None:
    ends = [_TCP.match(locator) for locator in (event.link.src, event.link.dst)]
    if event.kind != zenoh.SampleKind.PUT or None in ends:
        return
    wanted = ["".join(end.groups()) for end in ends if end is not None]
    with suppress(OSError):  # no file can be opened any more: closing the link will take long
        for connection, *addresses in _connections():
            if addresses == wanted:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_WAIT)
                return


@contextmanager
def close_links(raw: Any, rendezvous: str, ports: Collection[int] = ()) -> Iterator[None]:
    """Return a context in which links that delay its end are closed.

    Args:
        raw: The session of Zenoh.
        rendezvous: The endpoint where the sessions of this machine meet; links to those that are
            stopped delay the end.
        ports: Ports at which also connections delay it on which nothing has come.
    """
    peers = LocalPeers.read(rendezvous)
    if not (peers.stopped or ports):
        yield
        return
    links = _DelayingLinks(raw, peers, ports)
    links.change(lambda end: end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NO_WAIT))
    over = threading.Event()

    def cut() -> None:
        links.change(lambda end: end.shutdown(socket.SHUT_RDWR))

    def cut_repeatedly() -> None:
        pause = _GRACE_SECONDS
        while not over.wait(pause):
            cut()
            pause = _AGAIN_SECONDS

    thread = threading.Thread(target=cut_repeatedly, name="rosz-close-links", daemon=True)
    runs = start_thread(thread)
    if not runs:
        cut()
    try:
        yield
    finally:
        over.set()
        if runs:
            thread.join()


def _connections() -> Iterator[tuple[socket.socket, str, str]]:
    """Yield each connected socket of this process with its own and the other address.

    Zenoh does not hand out its sockets. The newest comes first. Addresses are written as in
    endpoints: ``127.0.0.1:7447``, ``[::1]:7447``, ``/run/z.sock``. A socket is a copy, which is
    valid until the next one is yielded.
    """
    for number in sorted((int(file.name) for file in _OPEN_FILES.iterdir()), reverse=True):
        # Not all sockets are connected, and any file may be closed meanwhile.
        with suppress(OSError):
            # Closing the copy of a file would release all locks of this process on it (fcntl(2)).
            if not stat.S_ISSOCK(os.fstat(number).st_mode):
                continue
            with socket.socket(fileno=os.dup(number)) as connection:
                yield (
                    connection,
                    _format(connection.getsockname()),
                    _format(connection.getpeername()),
                )


def _format(address: Any) -> str:
    if not isinstance(address, tuple):
        return str(address)
    return Endpoint.of("tcp", address[0].partition("%")[0], address[1]).address


def remove_abandoned_segments(folder: Path = SEGMENTS, *, min_age: float = _MIN_AGE) -> list[str]:
    """Remove the segments that this user's processes made and that nobody uses any more.

    Each process that uses a segment holds a shared lock on its file, which the kernel releases when
    the process ends, in whatever way. So whoever gets the exclusive lock knows that no process uses
    the segment, not even in another container.

    Args:
        folder: The folder of the segments.
        min_age: Age in seconds below which a segment is left alone, because it may be in the
            making.

    Returns:
        The names of the files removed.
    """
    segments = folder.glob("*" + _SUFFIX)
    return [path.name for path in segments if _remove_abandoned(path, min_age)]


def remove_abandoned_sockets(rendezvous: str) -> None:
    """Remove the private sockets of processes that were killed.

    Zenoh holds a lock on a file beside each socket. Numbers are never used again, so nobody opens
    such a file any more; the socket of the rendezvous itself has no number.
    """
    first = Path(Endpoint(rendezvous).address)
    for lock in first.parent.glob(f"{first.name}.*{_LOCK}"):
        if _remove_abandoned(lock, _MIN_AGE):
            lock.with_name(lock.name.removesuffix(_LOCK)).unlink(missing_ok=True)


def _remove_abandoned(path: Path, min_age: float) -> bool:
    """Remove a file of this user that nobody has locked; return whether it was removed."""
    # Another process may remove it first, use it, or own it.
    with suppress(OSError):
        status = path.stat()
        if status.st_uid != os.getuid() or status.st_ctime >= time.time() - min_age:
            return False
        with path.open("r+b") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            path.unlink()
            return True
    return False
