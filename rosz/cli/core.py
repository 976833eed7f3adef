"""``rosz core``: run a meeting point with a copy of the parameters."""

from __future__ import annotations

import os
import re
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, nullcontext, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from msgspec import Struct
from msgspec.structs import replace

from rosz.cli import suggest
from rosz.cli.console import count, print_error, print_lines, until_stopped
from rosz.cli.declare import App, Option, at_least
from rosz.errors import UsageError

if TYPE_CHECKING:
    from rosz.bridges.fleet import FleetPlan
    from rosz.cli.core_fleet import Places
    from rosz.environment import Environment
    from rosz.params.replica import Replica
    from rosz.security import KeyFolder, KeyWatch
    from rosz.session import Router

_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_LINE = re.compile(r"\S+ +(?:WARN|ERROR) .*?zenoh_link_tls\S*: (?P<reason>.*)")
_MISLEADING = re.compile(r"\.? Hint: .*")
_REVOKED = "NameConstraintViolation"
"""The word in TLS's error for a certificate with a name that the authority excludes."""
_PROBE = "tls handshake eof"
"""A peer has only probed the port, as a peer with keys does first."""
_NUMBER = re.compile(r"\d+")
_EVERY_SECONDS = 60.0
_KINDS = 100
"""Kinds of messages that are remembered: peers that come and go must not fill the memory."""
_STANDARD_OUTPUT = 1
_LAST_PORT = 65535
_MOST_PROCESSES = 1 << 22
"""The limit of Linux for the number of a process."""

app = App()


class CoreOptions(Struct, frozen=True, kw_only=True):
    """The options of ``rosz core``."""

    listen: Annotated[
        list[str] | None,
        Option("--listen ENDPOINT", "Also listen here, such as at tcp/0.0.0.0:7447; repeatable."),
    ] = None
    connect: Annotated[
        list[str] | None,
        Option("--connect ENDPOINT", "Connect here, such as to tcp/robot1:7447; repeatable."),
    ] = None
    keys: Annotated[str, Option("--keys DIR", "Folder of keys for links to other machines.")] = ""
    store: Annotated[str, Option("--store FILE", "Keep parameters in a file.", suggest.files)] = ""
    as_: Annotated[
        str | None, Option("--as NAMESPACE", "Put this machine's names below this one for others.")
    ] = None
    share: Annotated[
        str | None,
        Option("--share PATTERNS", "What leaves with --as, such as /odom,/camera/**@2Hz."),
    ] = None
    frames: Annotated[
        bool, Option("--frames", "With --as, also put the namespace before the frames of tf.")
    ] = False
    fleet: Annotated[
        str | None,
        Option("--fleet FILE", "Read --as, --share and more from a file.", suggest.files),
    ] = None
    ros1: Annotated[
        bool, Option("--ros1", "Also be the master of programs that speak ROS 1's protocol.")
    ] = False
    port: Annotated[str, Option("-p --port PORT", "Port of --ros1, instead of 11311.")] = ""
    address: Annotated[
        str,
        Option(
            "--address ADDRESS",
            "Address of --ros1, instead of 127.0.0.1; 0.0.0.0 for programs on other machines.",
        ),
    ] = ""
    print_config: Annotated[
        bool, Option("--print-config", "Print the configuration for zenohd instead.")
    ] = False
    owner: Annotated[int, Option("--owner PID")] = 0


@app.command()
def core_command(options: CoreOptions) -> None:
    """Run a meeting point with a copy of the parameters, until it is stopped.

    No node needs a core. It links machines, and keeps parameters when no node runs.
    """
    master_at = read_master_place(options.port, options.address, wanted=options.ros1)
    at_least("--owner", options.owner, 0, "as the number of a process", _MOST_PROCESSES)
    from rosz.cli.core_fleet import on_machine, read_fleet
    from rosz.environment import Environment
    from rosz.session import zenoh_configuration
    from rosz.wire import Endpoint

    environment = Environment.read()
    if options.keys:
        environment = replace(environment, keys=Path(options.keys).absolute())
    places = (
        [str(Endpoint.parse(text, "--listen")) for text in options.listen or ()],
        [str(Endpoint.parse(text, "--connect")) for text in options.connect or ()],
    )
    fleet = read_fleet(
        environment, options.as_, options.share, options.fleet, frames=options.frames
    )
    if options.print_config:
        print_lines([zenoh_configuration(*on_machine(fleet, environment, places))])
        return
    _run(options, environment, fleet, places, master_at)


def _run(
    options: CoreOptions,
    environment: Environment,
    fleet: FleetPlan | None,
    places: Places,
    master_at: tuple[str, int] | None,
) -> None:
    from rosz.cli.core_fleet import on_machine, open_fleet
    from rosz.cli.core_restart import CoreWatch, Handover
    from rosz.params.replica import Replica, Storage, StoreFile
    from rosz.session import Router

    own = on_machine(fleet, environment, places)
    file = Path(options.store).absolute() if options.store else None
    logging = nullcontext() if environment.keys is None else _summarize_zenoh_log()
    with logging, until_stopped() as ready, ExitStack() as stack:
        before = Handover.take()
        key_watch = None if environment.keys is None else _watch_keys(environment)
        storage = None
        if file is not None:
            storage = stack.enter_context(closing(Storage(StoreFile(file))))
        router = stack.enter_context(Router(*own))
        domain = environment.domain
        replica = Replica(router.session, domain, storage=storage, handover=before.parameters)
        stack.enter_context(closing(replica))
        _set_core_params(replica)
        crossing = open_fleet(fleet, environment, router, replica, places, stack)
        master = open_master(environment, *master_at, stack) if master_at else []
        watch = CoreWatch(router, replica, domain, before, key_watch=key_watch)
        stack.enter_context(closing(watch))
        ready()
        if before.why:
            kept = count(len(replica.names()), "parameter")
            print_error(f"{before.why}: started afresh, with {kept}")
        else:
            kept = f"parameters of domain {domain} are kept in {file or 'memory'}"
            lines = [*_describe(router, environment.rendezvous), *crossing]
            print_lines([*lines, kept, *master, "started core; press Ctrl-C to end it"])
        watch.restart_when_needed(options.owner)


def read_master_place(port: str, address: str, *, wanted: bool) -> tuple[str, int] | None:
    """Return the address and the port of ROS 1's master, or None if there shall be none.

    Raises:
        UsageError: The port is no number, or there is no master to which they belong.
    """
    if not wanted:
        if port or address:
            raise UsageError(
                "there is no master, and so no port, without --ros1: ROSZ_RENDEZVOUS moves the"
                " meeting point, ROS_DOMAIN_ID keeps groups of nodes apart"
            )
        return None
    if port and not (port.isascii() and port.isdigit() and int(port[:6]) <= _LAST_PORT):
        raise UsageError(f"--port is '{port}': expected a number from 0 to {_LAST_PORT}")
    return address or "127.0.0.1", int(port or 11311)


def open_master(environment: Environment, address: str, port: int, stack: ExitStack) -> list[str]:
    """Start ROS 1's master, and return lines that describe it.

    Raises:
        TransportError: It cannot listen there.
    """
    from rosz.bridges.ros1 import MasterBridge

    bridge = stack.enter_context(MasterBridge(environment, address, port))
    host = "localhost" if address.startswith(("127.", "0.")) else address
    return [f"ROS 1's programs join with ROS_MASTER_URI=http://{host}:{bridge.port}"]


def _describe(router: Router, rendezvous: str) -> list[str]:
    lines = [f"listening on {endpoint}" for endpoint in router.endpoints]
    if router.holder:
        lines.append(f"{rendezvous} is held by {router.holder}: the core takes its place when free")
    lines += [
        f"{'connected to' if reached else 'waiting for'} {endpoint}"
        for endpoint, reached in router.announce().items()
    ]
    return lines


def _watch_keys(environment: Environment) -> KeyWatch:
    from rosz.security import KeyWatch
    from rosz.session import keys_of

    def find() -> KeyFolder:
        keys = keys_of(environment)
        assert keys is not None  # noqa: S101  # the environment names them
        return keys

    return KeyWatch(find)


def _set_core_params(replica: Replica) -> None:
    """Set the parameters that a ROS 1 core sets, unless they are set already."""
    from rosz.launch.run import core_params, write_params

    params = core_params(str(uuid.uuid1()))
    missing = {name: value for name, value in params.items() if not replica.has(name)}
    if missing:
        write_params(replica, missing)


class LogSummary(Struct, eq=False):
    """A summary of what Zenoh logs by itself: each kind of message once per minute.

    Zenoh writes to standard output, one line for each attempt to connect that it refuses; and a
    peer that is refused tries again five times a second, for days.

    It calls a function with each line; the clock is in seconds.
    """

    write: Callable[[str], object]
    clock: Callable[[], float] = time.monotonic
    seen: dict[str, tuple[float, int]] = {}

    def add(self, line: str) -> None:
        """Write a line, unless one of its kind has been written within a minute."""
        line = _COLOUR.sub("", line).strip()
        match = _LINE.fullmatch(line)
        reason = _MISLEADING.sub("", match["reason"]) if match else line
        if _REVOKED in reason:
            reason = "its keys were revoked"
        if reason == _PROBE:
            return
        kind = _NUMBER.sub("0", reason)
        since, more = self.seen.pop(kind, (-_EVERY_SECONDS, 0))
        now = self.clock()
        if now - since < _EVERY_SECONDS:
            self.seen[kind] = (since, more + 1)
            return
        while len(self.seen) >= _KINDS:
            del self.seen[next(iter(self.seen))]
        self.seen[kind] = (now, 0)
        again = f" ({more} times more since)" if more else ""
        self.write(f"WARNING: a link is refused: {reason}{again}" if match else reason)


@contextmanager
def _summarize_zenoh_log() -> Iterator[None]:
    """Write a `LogSummary` of Zenoh's log to standard error, unless ``RUST_LOG`` is set."""
    if "RUST_LOG" in os.environ:
        yield
        return
    before = sys.stdout
    before.flush()
    own = os.dup(_STANDARD_OUTPUT)
    reader, writer = os.pipe()
    os.dup2(writer, _STANDARD_OUTPUT)
    os.close(writer)
    summary = LogSummary(print_error)
    thread = threading.Thread(target=_read, args=(reader, summary), name="rosz-log", daemon=True)
    thread.start()
    try:
        out = os.fdopen(os.dup(own), "w", buffering=1, encoding=before.encoding)
        with out, redirect_stdout(out):
            yield
    finally:
        os.dup2(own, _STANDARD_OUTPUT)
        os.close(own)
        thread.join(1)


def _read(reader: int, summary: LogSummary) -> None:
    with os.fdopen(reader, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            summary.add(line)
