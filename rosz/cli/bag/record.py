"""``rosz bag record``."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING, Annotated, NamedTuple

from msgspec import Struct

from rosz.cli import suggest
from rosz.cli.bag.source import app, compression_of
from rosz.cli.call import Call
from rosz.cli.console import at_first_signal, print_error, takes_escapes, until_stopped
from rosz.cli.declare import Argument, Option, at_least, no_less_than_zero
from rosz.errors import BagError, UsageError

if TYPE_CHECKING:
    from rosz.bags.record import ParameterRecord, Recorder, RecordOptions, Selection, Sink
    from rosz.node import Node

_TOOL = "record"
_LOOK_SECONDS = 0.5
"""Time between two looks at how it goes."""
_SECOND = 1_000_000_000
_UNITS = {"": 1, "s": 1, "m": 60, "h": 3600}
_LITTLE_DISK = 1 << 30
_ENDS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class RecordLine(Struct, frozen=True, kw_only=True):
    """The command line of a recorder."""

    topics: Annotated[list[str] | None, Argument("TOPIC", source=suggest.topics)] = None
    every: Annotated[bool, Option("-a --all", "Record all topics.")] = False
    regex: Annotated[bool, Option("-e --regex", "TOPICs are regular expressions.")] = False
    exclude: Annotated[
        str, Option("-x --exclude REGEX", "Leave out topics that a regular expression matches.")
    ] = ""
    of_node: Annotated[
        str, Option("--node NODE", "Record all topics that a node subscribes to.", suggest.nodes)
    ] = ""
    services: Annotated[
        bool, Option("--services", "Record the calls of services that are introspected.")
    ] = False
    parameters: Annotated[
        bool, Option("--parameters", "Record the parameters, as -a does too.")
    ] = False
    quiet: Annotated[bool, Option("-q --quiet", "Print errors only.")] = False
    prefix: Annotated[
        str, Option("-o --output-prefix PREFIX", "Name the bag PREFIX and the date.")
    ] = ""
    name: Annotated[
        str, Option("-O --output-name NAME", "Name the bag; NAME.bag has ROS 1's format.")
    ] = ""
    split: Annotated[
        bool, Option("--split", "Begin another bag at the limit of --size or --duration.")
    ] = False
    size: Annotated[int, Option("--size MB", "Limit the size of a bag.")] = 0
    duration: Annotated[
        str, Option("--duration TIME", "Limit the duration of a bag: seconds, or 5m, or 2h.")
    ] = ""
    max_splits: Annotated[int, Option("--max-splits COUNT", "Keep the newest bags only.")] = 0
    buffsize: Annotated[
        int, Option("-b --buffsize MB", "Messages that may wait for the disk; 0 for no limit.")
    ] = 256
    chunksize: Annotated[int, Option("--chunksize KB", "Size of chunks in the file.")] = 768
    limit: Annotated[int, Option("-l --limit COUNT", "Record so many messages of a topic.")] = 0
    bz2: Annotated[bool, Option("-j --bz2", "Compress with bz2, which ROS 1's bags have.")] = False
    lz4: Annotated[bool, Option("--lz4", "Compress with lz4.")] = False
    zstd: Annotated[bool, Option("--zstd", "Compress with zstd, which MCAP has.")] = False
    snapshot: Annotated[
        float,
        Option(
            "--snapshot SECONDS",
            "Keep the last seconds in memory, and write them on SIGUSR1 or a call of ~snapshot.",
        ),
    ] = 0.0
    publish: Annotated[
        bool, Option("-p --publish", "Publish the name of the bag on begin_write.")
    ] = False
    # Options of rosbag that change nothing here.
    tcpnodelay: Annotated[bool, Option("--tcpnodelay")] = False
    udp: Annotated[bool, Option("--udp")] = False
    repeat_latched: Annotated[bool, Option("--repeat-latched")] = False

    def check(self) -> None:
        """Check the values, without a network.

        Raises:
            UsageError: A value is out of bounds, or options exclude each other.
        """
        if not (self.topics or self.every or self.of_node or self.services or self.parameters):
            raise UsageError("expected a TOPIC, or -a for all topics")
        if self.prefix and self.name:
            raise UsageError("-o and -O exclude each other")
        compression_of(bz2=self.bz2, lz4=self.lz4, zstd=self.zstd)
        at_least("--size", self.size, 0, "MB")
        at_least("--max-splits", self.max_splits, 0, "bags")
        at_least("-b", self.buffsize, 0, "MB")
        at_least("--chunksize", self.chunksize, 1, "KB", 1 << 20)
        at_least("-l", self.limit, 0, "messages")
        no_less_than_zero("--snapshot", self.snapshot)

    def options(self) -> RecordOptions:
        """Return the names and limits of the bags.

        Raises:
            UsageError: A limit is missing, or is not well-formed.
        """
        from rosz.bags.record import RecordOptions

        options = RecordOptions(
            name=self.name,
            prefix=self.prefix,
            split=self.split,
            size=self.size << 20,
            duration=_nanoseconds(self.duration),
            max_splits=self.max_splits,
            buffer=self.buffsize << 20,
            chunk_size=self.chunksize << 10,
            compression=compression_of(bz2=self.bz2, lz4=self.lz4, zstd=self.zstd) or "none",
        )
        if self.split and not (options.size or options.duration):
            raise UsageError("--split needs a limit: --size or --duration")
        return options

    def selection(self, call: Call) -> Selection:
        """Return the selected topics.

        Raises:
            UsageError: An expression is not valid.
        """
        from rosz.bags.record import Selection

        topics = self.topics or ()
        return Selection(
            tuple(topics if self.regex else (call.resolve(topic, _TOOL) for topic in topics)),
            every=self.every,
            regex=self.regex,
            exclude=self.exclude,
            node=call.resolve(self.of_node, _TOOL) if self.of_node else "",
            services=self.services,
            parameters=self.parameters,
        )


def _nanoseconds(text: str) -> int:
    """Return the duration that rosbag means by a text such as ``30``, ``5m`` or ``2h``."""
    number, unit = (text[:-1], text[-1]) if text[-1:].isalpha() else (text, "")
    try:
        duration = round(float(number or "0") * _UNITS[unit] * _SECOND)
    except (ValueError, KeyError, OverflowError):
        duration = -1
    if duration < 0:
        raise UsageError(f"--duration is '{text}'; expected seconds, or a number with m or h")
    return duration


@app.command("record")
def record_command(call: Call, line: RecordLine) -> int:
    """Record topics into a bag, MCAP or ROS 1's.

    Each bag begins with the last message of every latched topic, and with -a or --parameters with
    the parameters.
    """
    line.check()
    options, selection = line.options(), line.selection(call)
    report: Callable[[str], None] = (lambda _: None) if line.quiet else _say
    with _node(call) as node:
        recording = _Recording(node, selection, options, report, line.limit)
        if line.snapshot:
            _keep_last(recording, round(line.snapshot * _SECOND))
        else:
            _record(recording, publish=line.publish)
    return 0


def _say(text: str) -> None:
    """Print a line; a terminal that is closed must not keep a bag from its end."""
    with suppress(OSError):
        print_error(text)


class _Recording(NamedTuple):
    """The topics, the bags and the node of a recording."""

    node: Node
    selection: Selection
    options: RecordOptions
    report: Callable[[str], None]
    limit: int

    def parameters(self, sink: Sink) -> ParameterRecord | None:
        """Begin to record parameters, if they are selected."""
        from rosz.bags.record import ParameterRecord

        selected = self.selection.parameters
        return ParameterRecord(self.node, sink, self.report) if selected else None

    def recorder(self, sink: Sink, ended: threading.Event) -> Recorder:
        """Begin to record topics."""
        from rosz.bags.record import Recorder

        return Recorder(
            self.node,
            self.selection,
            sink,
            self.report,
            self.limit,
            ended,
            buffer=self.options.buffer,
        )


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


def _record(recording: _Recording, *, publish: bool) -> None:
    from rosz.bags.record import BagFiles

    with ExitStack() as stack:
        ended = stack.enter_context(_end_by_signal())
        files = stack.enter_context(BagFiles(recording.options, recording.report))
        if publish:
            from rosz.msgs.std_msgs.msg import String

            name = String(data=str(files.path))
            recording.node.publisher("begin_write", String, latch=True).publish(name)
        parameters = recording.parameters(files)
        if parameters is not None:
            files.begin = stack.enter_context(parameters).begin
        recorder = stack.enter_context(recording.recorder(files, ended))
        _run(recording, recorder, parameters, files, files.finished)
        if recorder.error is not None:
            raise recorder.error


def _keep_last(recording: _Recording, duration: int) -> None:
    from rosz.bags.record import Ring
    from rosz.msgs.std_srvs.srv import Trigger, TriggerResponse

    node, report = recording.node, recording.report
    ring = Ring(recording.options, duration, report)
    saving = threading.Lock()

    def save() -> str:
        with saving:
            return str(ring.save(node.now()))

    def serve(_: object) -> TriggerResponse:
        try:
            return TriggerResponse(success=True, message=save())
        except BagError as error:
            return TriggerResponse(success=False, message=str(error))

    with ExitStack() as stack:
        ended = stack.enter_context(_end_by_signal())
        parameters = recording.parameters(ring)
        if parameters is not None:
            ring.end = stack.enter_context(parameters).begin
        recorder = stack.enter_context(recording.recorder(ring, ended))
        stack.enter_context(node.service("~snapshot", Trigger, serve))
        signalled = threading.Event()
        before = signal.signal(signal.SIGUSR1, lambda *_: signalled.set())
        stack.callback(signal.signal, signal.SIGUSR1, before)
        report(f"Keeping the last {duration / _SECOND:g} s; SIGUSR1 writes them to a bag.")

        def look() -> None:
            if signalled.is_set():
                signalled.clear()
                try:
                    save()
                except BagError as error:  # the next one may succeed
                    _say(f"ERROR: {error}")

        _run(recording, recorder, parameters, ring, recorder.ended, look)


@contextmanager
def _end_by_signal() -> Iterator[threading.Event]:
    """Set an event on Ctrl-C, SIGTERM or SIGHUP: no exception comes between a bag and its end.

    A later signal ends the process at once, and leaves the bag for ``rosz bag reindex``.
    """
    ended = threading.Event()
    handle = at_first_signal(ended.set)
    with ExitStack() as stack:
        for number in _ENDS:
            if signal.getsignal(number) is not signal.SIG_IGN:
                stack.callback(signal.signal, number, signal.signal(number, handle))
        yield ended


def _run(
    recording: _Recording,
    recorder: Recorder,
    parameters: ParameterRecord | None,
    sink: Sink,
    finished: threading.Event,
    look: Callable[[], None] = lambda: None,
) -> None:
    """Record until the end, and show how it goes."""
    progress = _RecordProgress(recorder, sink, recording.options.folder)
    report = recording.report
    shown = report is _say and takes_escapes(sys.stderr)
    begun = time.monotonic()
    try:
        while not (finished.is_set() or recorder.ended.wait(_LOOK_SECONDS)):
            look()
            if shown:
                progress.show()
            if recording.node.is_shutdown:
                break
    finally:
        if shown:
            progress.end()
        recorder.close()
        if parameters is not None:
            parameters.close()
        lost = recorder.lost + (0 if recorder.error is None else sink.unwritten)
        seconds = time.monotonic() - begun
        report(f"{sink.count} messages in {seconds:.1f} s, {lost} lost")


class _RecordProgress:
    """One line on a terminal: time, rate, size, losses, room on the disk."""

    def __init__(self, recorder: Recorder, sink: Sink, folder: str) -> None:
        self._recorder = recorder
        self._sink = sink
        self._folder = folder
        self._begun = self._last = time.monotonic()
        self._before = 0, 0
        self._warned = False

    def show(self) -> None:
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
            self._print("\r\033[KWARNING: less than 1 GB of disk is left\n")
        self._print(f"\r\033[K{text}")
        self._last, self._before = now, (count, size)

    def end(self) -> None:
        self._print("\n")

    @staticmethod
    def _print(text: str) -> None:
        with suppress(OSError):
            sys.stderr.write(text)
            sys.stderr.flush()
