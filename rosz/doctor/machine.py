"""The finding of a check, and the checks of shared memory, processes and endpoints."""

from __future__ import annotations

import fcntl
import os
import socket
import stat
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Literal

import msgspec

from rosz import names
from rosz.environment import Environment
from rosz.errors import InvalidName, TransportError
from rosz.session import (
    SEGMENTS,
    LocalPeers,
    Session,
    SessionConfig,
    describe_process,
    is_stopped,
    keys_of,
    why_refused,
)
from rosz.wire import Endpoint, ProcessToken

Level = Literal["error", "warning"]
_SHOWN = 8
"""Number of lines of evidence that are shown to people."""

LEAST_FREE = 8 << 20
"""Bytes of shared memory that a few images need."""

_MIB = 1 << 20
_LOCK_SECONDS = 2.0
"""Seconds in which the process that creates a segment locks it."""


class Finding(msgspec.Struct, frozen=True):
    """A fault, or something that may be one.

    Attributes:
        name: Short stable name for programs, such as ``clock-offset``.
        level: ``error`` for a fault; ``warning`` for something that may be intended.
        text: Description in one line.
        evidence: Lines of evidence.
        remedy: Advice about it.
    """

    name: str
    level: Level
    text: str
    evidence: tuple[str, ...]
    remedy: str


def _find(
    level: Level, name: str, text: str, evidence: Iterable[str], remedy: str
) -> Iterator[Finding]:
    """Yield a finding; nothing without evidence."""
    if lines := tuple(evidence):
        yield Finding(name, level, text, lines, remedy)


error = partial(_find, "error")
"""Yields a finding about a fault."""
warning = partial(_find, "warning")
"""Yields a finding about something that may be intended."""


def listed(lines: tuple[str, ...]) -> tuple[str, ...]:
    """Return lines of evidence for people, with the number of those left out."""
    more = len(lines) - _SHOWN
    return (*lines[:_SHOWN], f"and {more} more") if more > 1 else lines


def check_shared_memory(folder: Path = SEGMENTS, least: int = LEAST_FREE) -> Iterator[Finding]:
    """Find shared memory in which fewer bytes are free than the least."""
    try:
        disk = os.statvfs(folder)
    except OSError:
        return  # not Linux: shared memory is elsewhere
    free, size = disk.f_bavail * disk.f_frsize, disk.f_blocks * disk.f_frsize
    if free < least:
        yield Finding(
            "shared-memory-full",
            "error",
            f"{folder} is full: {free / _MIB:.0f} MiB of {size / _MIB:.0f} MiB are free",
            _largest(folder),
            f"remove what is left over there, or give it more: mount -o remount,size=1G {folder}"
            " (docker run --shm-size=1g); without ROSZ_SHM nothing of rosz needs it",
        )


def check_segments(folder: Path = SEGMENTS, born: float = _LOCK_SECONDS) -> Iterator[Finding]:
    """Find segments of Zenoh that no process holds, and that are not in the making."""
    left: list[str] = []
    with suppress(OSError):
        for path in sorted(folder.glob("*.zenoh")):
            with suppress(OSError):  # removed meanwhile, or not readable
                if path.stat().st_ctime < time.time() - born and _is_unlocked(path, "rb"):
                    left.append(f"{path}, {path.stat().st_size} bytes")
    count = "1 segment" if len(left) == 1 else f"{len(left)} segments"
    yield from warning(
        "stale-lock",
        f"{count} of shared memory left by processes that died",
        left,
        "they go when the next rosz process of their owner starts; or remove them by hand",
    )


def _is_unlocked(path: Path, mode: str) -> bool:
    """Return whether nobody holds a lock on a file, which is opened in a mode for that."""
    with path.open(mode) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
    return True


def _largest(folder: Path) -> tuple[str, ...]:
    sizes: list[tuple[int, str]] = []
    with suppress(OSError):
        for path in folder.iterdir():
            with suppress(OSError):
                sizes.append((path.stat().st_size, path.name))
    return tuple(f"{folder / name}: {size / _MIB:.1f} MiB" for size, name in sorted(sizes)[:-4:-1])


def check_package_path(environment: Environment) -> Iterator[Finding]:
    """Find folders on the package path that do not exist."""
    yield from warning(
        "missing-path",
        "ROSZ_PACKAGE_PATH or ROS_PACKAGE_PATH names what is not a folder: its packages are"
        " not found",
        [
            f"{root}: {'it is a file' if root.exists() else 'it does not exist'}"
            for root in environment.package_roots
            if not root.is_dir()
        ],
        "correct the variable where the shell sets it (~/.bashrc, setup.bash)",
    )


def check_namespace(environment: Environment) -> Iterator[Finding]:
    """Find a ``ROS_NAMESPACE`` with which no node starts."""
    try:
        names.check(environment.namespace)
    except InvalidName as fault:
        yield from error(
            "refused-name",
            f"no node starts here, as ROS_NAMESPACE is '{environment.namespace}'",
            [str(fault)],
            "set ROS_NAMESPACE to a name such as /robot1, or unset it",
        )


def check_stopped(environment: Environment) -> Iterator[Finding]:
    """Find processes of this machine that are stopped, as by Ctrl-Z."""
    peers = LocalPeers.read(environment.rendezvous)
    stopped = sorted({peer.pid for peer in peers.stopped})
    note = f", which holds the meeting point {environment.rendezvous}"
    ids = " ".join(map(str, stopped))
    yield from error(
        "stopped-process",
        "stopped processes (Ctrl-Z) receive nothing and do not answer",
        (
            f"{describe_process(pid)}{note if pid == peers.stopped_holder else ''}"
            for pid in stopped
        ),
        f"let it go on with 'fg' in its terminal or 'kill -CONT {ids}', or end it with"
        f" 'kill -9 {ids}'",
    )


def stopped_note(process: ProcessToken) -> str:
    """Return a note if the process of a node is stopped and runs on this machine."""
    here = process.host == socket.gethostname()
    return ": it is stopped" if here and is_stopped(process.pid) else ""


_CONNECT_SECONDS = 1.0
_GREETING_SECONDS = 1.0
_PLAIN = frozenset({"tcp", "unixsock-stream"})


def check_rendezvous(environment: Environment) -> Iterator[Finding]:
    """Find a program at the rendezvous that is not Zenoh."""
    endpoint = environment.rendezvous
    if not why_refused(endpoint, _CONNECT_SECONDS) and not _greets(endpoint, environment):
        yield from error(
            "rendezvous-held",
            f"something that is not Zenoh, or hangs, holds the rendezvous {endpoint}",
            [f"it accepts connections and says nothing within {_GREETING_SECONDS:g} s"],
            f"find it with 'ss -ltnp' and end it, or set ROSZ_RENDEZVOUS to another endpoint for"
            f" all processes in place of {endpoint}",
        )


def check_connect(environment: Environment) -> Iterator[Finding]:
    """Find endpoints in ``ROSZ_CONNECT`` at which no Zenoh listens."""
    for endpoint in environment.connect:
        reason = why_refused(endpoint, _CONNECT_SECONDS)
        if not reason and not _greets(endpoint, environment):
            reason = f"what listens there says nothing within {_GREETING_SECONDS:g} s: it hangs, or"
            reason += " it is not Zenoh"
        if reason:
            yield from error(
                "nobody-listens",
                f"ROSZ_CONNECT names {endpoint}, where no Zenoh answers",
                [reason],
                "on that machine run 'rosz core --listen tcp/0.0.0.0:7447', or set ROSZ_LISTEN"
                " there; check the name, the port, and the firewalls between",
            )


def check_socket_files(environment: Environment) -> Iterator[Finding]:
    """Find unix sockets that dead processes left at endpoints to listen at."""
    for endpoint in (environment.rendezvous, *environment.listen):
        place = Endpoint(endpoint)
        path = Path(place.address)
        if not place.is_unix or not _is_socket(path) or not why_refused(endpoint, _CONNECT_SECONDS):
            continue
        lock = Path(f"{path}.lock")
        ours = os.access(path.parent, os.W_OK) and _is_free(lock)
        make = warning if ours else error
        yield from make(
            "stale-lock",
            f"the process that listened at {path} died and left its socket",
            [
                f"{path}: {why_refused(endpoint, _CONNECT_SECONDS)}",
                f"{lock}: {'not locked' if ours else 'held by another process or user'}",
            ],
            f"rm {path} {lock}" + ("; the next process to start does it" if ours else ""),
        )


def _greets(endpoint: str, environment: Environment) -> bool:
    """Return whether a Zenoh session opens at an endpoint; true where it needs certificates."""
    if Endpoint(endpoint).protocol not in _PLAIN:
        return True
    config = SessionConfig(
        mode="client",
        rendezvous=endpoint,
        must_connect=True,
        open_timeout=_GREETING_SECONDS,
        keys=keys_of(environment),
        override=environment.zenoh_override,
    )
    try:
        Session.open(config).close()
    except TransportError:
        return False
    return True


def _is_socket(path: Path) -> bool:
    try:
        return stat.S_ISSOCK(path.stat().st_mode)
    except OSError:
        return False


def _is_free(lock: Path) -> bool:
    try:
        return _is_unlocked(lock, "r+b")
    except FileNotFoundError:
        return True
    except OSError:
        return False
