"""``rosz bag record``."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Annotated

from rosz.cli import suggest
from rosz.cli.bag.group import app
from rosz.cli.call import Call
from rosz.cli.console import print_error, takes_escapes, until_stopped
from rosz.cli.declare import Argument, Option, at_least, no_less_than_zero
from rosz.errors import BagError, UsageError

if TYPE_CHECKING:
    from types import FrameType

    from rosz.bags import Compression
    from rosz.bags.parameters import ParameterRecord
    from rosz.bags.recorder import Recorder
    from rosz.bags.recording import BagFiles, RecordOptions, Selection, Sink
    from rosz.node import Node

__all__ = ()

_TOOL = "record"
_FLUSH_SECONDS = 0.5
"""Time after which a message is in the file, whatever happens to the recorder."""
_SECOND = 1_000_000_000
_UNITS = {"": 1, "s": 1, "m": 60, "h": 3600}
_LITTLE_DISK = 1 << 30
_SAME_REQUEST_SECONDS = 1.0
"""A second signal within this time is the same one, since a terminal and a launch may both send it.
A later one ends the process at once, and leaves the bag for ``rosz bag reindex``."""


@app.command("record")
def record_command(
    call: Call,
    topics: Annotated[list[str] | None, Argument("TOPIC", source=suggest.topics)] = None,
    *,
    every: Annotated[bool, Option("-a --all", "Record all topics.")] = False,
    regex: Annotated[bool, Option("-e --regex", "TOPICs are regular expressions.")] = False,
    exclude: Annotated[
        str, Option("-x --exclude REGEX", "Leave out topics that a regular expression matches.")
    ] = "",
    of_node: Annotated[
        str, Option("--node NODE", "Record all topics that a node subscribes to.", suggest.nodes)
    ] = "",
    services: Annotated[
        bool, Option("--services", "Record the calls of services that are introspected.")
    ] = False,
    quiet: Annotated[bool, Option("-q --quiet", "Print errors only.")] = False,
    prefix: Annotated[
        str, Option("-o --output-prefix PREFIX", "Name the bag PREFIX and the date.")
    ] = "",
    name: Annotated[
        str, Option("-O --output-name NAME", "Name the bag; NAME.bag has ROS 1's format.")
    ] = "",
    split: Annotated[
        bool, Option("--split", "Begin another bag at the limit of --size or --duration.")
    ] = False,
    size: Annotated[int, Option("--size MB", "Limit the size of a bag.")] = 0,
    duration: Annotated[
        str, Option("--duration TIME", "Limit the duration of a bag: seconds, or 5m, or 2h.")
    ] = "",
    max_splits: Annotated[int, Option("--max-splits COUNT", "Keep the newest bags only.")] = 0,
    buffsize: Annotated[
        int, Option("-b --buffsize MB", "Messages that may wait for the disk; 0 for no limit.")
    ] = 256,
    chunksize: Annotated[int, Option("--chunksize KB", "Size of chunks in the file.")] = 768,
    limit: Annotated[int, Option("-l --limit COUNT", "Record so many messages of a topic.")] = 0,
    bz2: Annotated[bool, Option("-j --bz2", "Compress with bz2, which ROS 1's bags have.")] = False,
    lz4: Annotated[bool, Option("--lz4", "Compress with lz4.")] = False,
    zstd: Annotated[bool, Option("--zstd", "Compress with zstd, which MCAP has.")] = False,
    snapshot: Annotated[
        float,
        Option(
            "--snapshot SECONDS",
            "Keep the last seconds in memory, and write them on SIGUSR1 or a call of ~snapshot.",
        ),
    ] = 0.0,
    publish: Annotated[
        bool, Option("-p --publish", "Publish the name of the bag on begin_write.")
    ] = False,
    _tcpnodelay: Annotated[bool, Option("--tcpnodelay")] = False,
    _udp: Annotated[bool, Option("--udp")] = False,
    _repeat_latched: Annotated[bool, Option("--repeat-latched")] = False,
) -> int:
    """Record topics into a bag, MCAP or ROS 1's.

    Each bag begins with the last message of every latched topic, and with the parameters.
    """
    if not (topics or every or of_node or services):
        raise UsageError("expected a TOPIC, or -a for all topics")
    if prefix and name:
        raise UsageError("-o and -O exclude each other")
    if bz2 + lz4 + zstd > 1:
        raise UsageError("--bz2, --lz4 and --zstd exclude each other")
    at_least("--size", size, 0, "MB")
    at_least("--max-splits", max_splits, 0, "bags")
    at_least("-b", buffsize, 0, "MB")
    at_least("--chunksize", chunksize, 1, "KB", 1 << 20)
    at_least("-l", limit, 0, "messages")
    no_less_than_zero("--snapshot", snapshot)
    from rosz.bags.recording import RecordOptions, Selection

    compression: Compression = "bz2" if bz2 else "lz4" if lz4 else "zstd" if zstd else "none"
    options = RecordOptions(
        name=name,
        prefix=prefix,
        split=split,
        size=size << 20,
        duration=_nanoseconds(duration),
        max_splits=max_splits,
        buffer=buffsize << 20,
        chunk_size=chunksize << 10,
        compression=compression,
    )
    if split and not (options.size or options.duration):
        raise UsageError("--split needs a limit: --size or --duration")
    selection = Selection(
        tuple(topics or ()) if regex else tuple(call.resolve(one, _TOOL) for one in topics or ()),
        every=every,
        regex=regex,
        exclude=exclude,
        node=call.resolve(of_node, _TOOL) if of_node else "",
        services=services,
    )
    report = _ignore if quiet else print_error
    with _node(call) as node:
        if snapshot:
            _keep_last(node, selection, options, round(snapshot * _SECOND), report, limit)
        else:
            _record(node, selection, options, report, limit, publish=publish)
    return 0


@contextmanager
def _node(call: Call) -> Iterator[Node]:
    """Open the node of the recorder, which waits for others as any node does."""
    from rosz.node import Context, Node

    with (
        until_stopped() as ready,
        Context(call.environment, call.argv) as context,
        Node(_TOOL, anonymous=True, context=context) as node,
    ):
        ready()
        yield node


def _ignore(_: str) -> None: ...


def _nanoseconds(text: str) -> int:
    """Return the duration that rosbag means by a text such as ``30``, ``5m`` or ``2h``."""
    number, unit = (text[:-1], text[-1]) if text[-1:].isalpha() else (text, "")
    try:
        found = round(float(number or "0") * _UNITS[unit] * _SECOND)
    except (ValueError, KeyError, OverflowError):
        found = -1
    if found < 0:
        raise UsageError(f"--duration is '{text}'; expected seconds, or a number with m or h")
    return found


def _record(
    node: Node,
    selection: Selection,
    options: RecordOptions,
    report: Callable[[str], None],
    limit: int,
    *,
    publish: bool,
) -> None:
    from rosz.bags.parameters import ParameterRecord
    from rosz.bags.recorder import Recorder
    from rosz.bags.recording import BagFiles

    with ExitStack() as stack:
        ended = stack.enter_context(_end_by_signal())
        files = stack.enter_context(BagFiles(options, report))
        if publish:
            _publish_name(node, files)
        parameters = stack.enter_context(ParameterRecord(node, files, report))
        files.begin = parameters.begin
        recorder = stack.enter_context(
            Recorder(node, selection, files, report, limit, ended, buffer=options.buffer)
        )
        _run(node, recorder, parameters, files, options, report, finished=files.finished)
        if recorder.error is not None:
            raise recorder.error


def _publish_name(node: Node, files: BagFiles) -> None:
    from rosz.msgs.std_msgs.msg import String

    node.publisher("begin_write", String, latch=True).publish(String(data=str(files.path)))


def _keep_last(
    node: Node,
    selection: Selection,
    options: RecordOptions,
    duration: int,
    report: Callable[[str], None],
    limit: int,
) -> None:
    from rosz.bags.parameters import ParameterRecord
    from rosz.bags.recorder import Recorder
    from rosz.bags.recording import Ring
    from rosz.msgs.std_srvs.srv import Trigger, TriggerResponse

    ring = Ring(options, duration, report)
    saving = threading.Lock()

    def save() -> str:
        with saving:
            return str(ring.save(node.now()))

    def serve(_: object) -> TriggerResponse:
        try:
            return TriggerResponse(success=True, message=save())
        except BagError as error:
            return TriggerResponse(success=False, message=str(error))

    with (
        _end_by_signal() as ended,
        ParameterRecord(node, ring, report) as parameters,
        Recorder(node, selection, ring, report, limit, ended, buffer=options.buffer) as recorder,
        node.service("~snapshot", Trigger, serve),
        _on_signal() as signalled,
    ):
        ring.end = parameters.begin
        report(f"Keeping the last {duration / _SECOND:g} s; SIGUSR1 writes them to a bag.")

        def look() -> None:
            if signalled.is_set():
                signalled.clear()
                try:
                    save()
                except BagError as error:  # the next one may succeed
                    print_error(f"ERROR: {error}")

        _run(node, recorder, parameters, ring, options, report, finished=recorder.ended, look=look)


@contextmanager
def _on_signal() -> Iterator[threading.Event]:
    """Set an event on SIGUSR1."""
    signalled = threading.Event()

    def handle(_number: int, _frame: FrameType | None) -> None:
        signalled.set()

    before = signal.signal(signal.SIGUSR1, handle)
    try:
        yield signalled
    finally:
        signal.signal(signal.SIGUSR1, before)


@contextmanager
def _end_by_signal() -> Iterator[threading.Event]:
    """Set an event on Ctrl-C or SIGTERM, so that no exception comes between a bag and its end."""
    ended = threading.Event()
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    first: list[float] = []

    def handle(number: int, _frame: FrameType | None) -> None:
        ended.set()
        first.append(time.monotonic())
        if time.monotonic() - first[0] > _SAME_REQUEST_SECONDS:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)

    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, handle)
    try:
        yield ended
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _run(
    node: Node,
    recorder: Recorder,
    parameters: ParameterRecord,
    sink: Sink,
    options: RecordOptions,
    report: Callable[[str], None],
    *,
    finished: threading.Event,
    look: Callable[[], None] = lambda: None,
) -> None:
    """Record until the end, and show how it goes."""
    progress = _Progress(recorder, sink, options.folder)
    shown = report is print_error and takes_escapes(sys.stderr)
    begun = time.monotonic()
    try:
        while not (finished.is_set() or recorder.ended.wait(_FLUSH_SECONDS)):
            sink.tick(node.now())
            look()
            if shown:
                progress.show()
            if node.is_shutdown:
                break
    finally:
        if shown:
            progress.end()
        recorder.close()
        parameters.close()
        lost = recorder.lost + (0 if recorder.error is None else sink.unwritten)
        seconds = time.monotonic() - begun
        report(f"{sink.count} messages in {seconds:.1f} s, {lost} lost")


class _Progress:
    """One line on a terminal: time, rate, size, losses, room on the disk."""

    def __init__(self, recorder: Recorder, sink: Sink, folder: str) -> None:
        self._recorder = recorder
        self._sink = sink
        self._folder = folder
        self._begun = self._last = time.monotonic()
        self._before = 0, 0
        self._warned = False

    def show(self) -> None:
        """Write the line."""
        now = time.monotonic()
        sink, elapsed = self._sink, now - self._last
        if elapsed < 1:
            return
        count, size = sink.count, sink.size
        lost = self._recorder.lost
        disk = os.statvfs(self._folder)
        left = disk.f_bavail * disk.f_frsize
        rate = (count - self._before[0]) / elapsed
        flow = max(size - self._before[1], 0) / elapsed  # a ring may shrink
        text = (
            f"{now - self._begun:6.0f} s  {count} messages ({rate:.0f}/s)"
            f"  {size / 1e6:.1f} MB ({flow / 1e6:.1f} MB/s)"
            f"  {lost} lost  {left / 1e9:.1f} GB of disk left"
        )
        if left < _LITTLE_DISK and not self._warned:
            self._warned = True
            sys.stderr.write("\r\033[KWARNING: less than 1 GB of disk is left\n")
        sys.stderr.write(f"\r\033[K{text}")
        sys.stderr.flush()
        self._last, self._before = now, (count, size)

    def end(self) -> None:
        """Leave the line."""
        sys.stderr.write("\n")
        sys.stderr.flush()
