"""Playing bags: their messages are published again, at the times at which they were recorded."""

from __future__ import annotations

import heapq
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import chain, islice

from rosz.bags.bag import BagReader, Entry, Payload
from rosz.bags.play.ahead import ReadAhead
from rosz.bags.play.options import PlayOptions, Progress
from rosz.bags.play.outputs import Outputs, Played
from rosz.bags.play.pace import BagClock, Pace, RateControl
from rosz.errors import MessageError
from rosz.node import Node

_NS = 1_000_000_000
_FOREVER = threading.TIMEOUT_MAX / 2
_REPORT_SECONDS = 0.1
"""Time between two reports of progress."""
_EARLY = _NS
"""Latched messages of the first second of a bag were usually published before it began."""
_BATCH = 256
"""Messages that ``immediate`` publishes between two looks for keys and new subscriptions."""


class Player:
    """Publishes the messages of bags, merged by time.

    The publishers have the QoS that was recorded. A latched message from before the start is
    published first.

    Args:
        node: The node that publishes.
        readers: The bags.
        options: How they are played.
        warn: Function called with each problem; a topic or message with a problem is left out.
        report: Function called with the progress, some times per second.

    Attributes:
        outputs: The publishers.
        published: Number of messages that were published.
        loop: Whether to begin again at the end.

    Raises:
        UsageError: The options do not fit each other, or the bags.
    """

    def __init__(
        self,
        node: Node,
        readers: Sequence[BagReader],
        options: PlayOptions,
        warn: Callable[[str], object],
        report: Callable[[Progress], object] = lambda _: None,
    ) -> None:
        self._node = node
        self._readers = readers
        self._options = options
        self._report = report
        self._warn = warn
        self.published: int = 0
        self.loop: bool = options.loop
        counted = [reader for reader in readers if reader.count()]
        first = min((reader.start for reader in counted), default=0)
        last = max((reader.end for reader in counted), default=0)
        self._start = first + int(options.start * _NS)
        self._end = last
        if options.duration is not None:
            self._end = min(last, self._start + int(options.duration * _NS))
        self._changed = threading.Condition()
        self._steps = 0
        self._target: int | None = None  # stamp to jump to
        self._pace = Pace(self._start, options.rate, paused=options.paused)
        self._next_report = 0.0
        self._last = self._start
        self._closed = False
        self._clock: BagClock | None = None
        self._control: RateControl | None = None
        self.outputs: Outputs = Outputs(node, options, readers, warn)
        if not counted:
            warn("nothing to play: the bags have no messages")
        elif self._start > last:
            warn(
                f"nothing to play: --start {options.start:g} is behind the end of the bags, which"
                f" have {(last - first) / _NS:.1f} s"
            )

    @property
    def problems(self) -> int:
        """Number of problems."""
        return self.outputs.problems

    # Control, from any thread.

    def toggle(self) -> None:
        """Pause, or go on."""
        with self._changed:
            self._pace.change(paused=not self._pace.paused)
            self._changed.notify_all()

    def step(self) -> None:
        """Publish one message while paused."""
        with self._changed:
            if self._pace.paused:
                self._steps += 1
                self._changed.notify_all()

    def change_rate(self, factor: float) -> None:
        """Play faster or more slowly."""
        self.set_rate(self._pace.rate * factor)

    def set_rate(self, rate: float) -> None:
        """Play at a rate, in seconds of the bag per second."""
        with self._changed:
            self._pace.change(rate=rate)
            self._changed.notify_all()

    def jump(self, elapsed: float) -> None:
        """Go on from another place, in seconds since the start; a paused player stays paused.

        Latched messages from before that place are published first.
        """
        with self._changed:
            self._target = min(max(self._start, self._start + int(elapsed * _NS)), self._end)
            self._steps = 0
            self._changed.notify_all()

    def stop(self) -> None:
        """Stop playing."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    # Publishers.

    def advertise(self) -> None:
        """Make the publishers, and wait until subscriptions have found them.

        Raises:
            ClosedError: The node was shut down meanwhile.
        """
        options = self._options
        for reader in self._readers:
            for channel in reader.channels:
                if channel.topic in self.outputs.topics:
                    self.outputs.output(channel)
        if options.clock:
            self._clock = BagClock(self._node, options.clock, immediate=options.immediate)
        if options.rate_control_topic:
            self._control = RateControl(
                self._node,
                options.rate_control_topic,
                options.rate_control_max_delay,
                self._start,
                self._changed,
                self._warn,
            )
        context = self._node.context
        context.mesh.linked.wait(context.HOLD_TIMEOUT)  # else the publishers would drop
        context.wait_for_shutdown(options.delay)
        if options.wait_for_subscribers:
            for publisher in self.outputs.publishers.values():
                # Every node of ROS 2 publishes its parameters' events, and hardly any subscribes.
                if not publisher.name.endswith("/parameter_events"):
                    publisher.wait_for_subscribers(1, _FOREVER)

    # Messages.

    def run(self) -> None:
        """Publish everything, until the end of the bags, or of the node.

        Raises:
            BagError: A bag cannot be read any more.
        """
        withdraw = self._node.context.on_shutdown(lambda _: self.stop())
        try:
            self._publish_latched(self._start)
            begin = self._start
            while not self._closed:
                self._play(begin)
                with self._changed:
                    target, self._target = self._target, None
                if target is not None:
                    begin = target
                    self._publish_latched(begin)
                elif self.loop:
                    begin = self._start
                else:
                    break
                self._last = begin
                if self._control is not None:
                    self._control.stamp = begin
            while self._options.keep_alive and not self._closed:
                self._wait(_REPORT_SECONDS)
        finally:
            withdraw()

    @property
    def _interrupted(self) -> bool:
        return self._closed or self._target is not None

    def _play(self, begin: int) -> None:
        parts = [self._entries(reader, begin, self._end) for reader in self._readers]
        entries = (
            parts[0] if len(parts) == 1 else heapq.merge(*parts, key=lambda entry: entry.stamp)
        )
        if self._options.immediate:
            self._play_at_once(entries)
            return
        convert = self.outputs.convert
        items = ((len(item[2]), item) for item in map(convert, entries) if item)
        with ReadAhead(items) as ahead:
            ahead.fill()
            batches = iter(ahead)
            some = next(batches, [])
            # Making the publishers, waiting and reading so far do not count as time of the bag.
            self._pace.jump(begin)
            for batch in chain((some,), batches):
                if not self._publish(batch):
                    return
        self._report_progress()

    def _play_at_once(self, entries: Iterator[Entry]) -> None:
        """Publish messages without waiting, but in a pause and for ``/clock``."""
        for first in entries:
            some = chain((first,), islice(entries, _BATCH - 1))
            if self.outputs.pausing or self._clock or self._pace.paused:
                self._publish(item for item in map(self.outputs.convert, some) if item)
            else:
                self._rush(some)
            if self._interrupted:
                return
            if time.monotonic() >= self._next_report:
                self._report_progress()

    def _rush(self, entries: Iterable[Entry]) -> None:
        """Publish messages at once; those that nobody would receive are only counted."""
        # By channel: the functions that publish and convert a message; None without a subscriber.
        routes: dict[int, tuple[Callable[[bytes], None], Callable[[Payload], bytes]] | None] = {}
        stamp, count = self._last, 0
        for entry in entries:
            key = id(entry.channel)
            if key not in routes:
                output = self.outputs.output(entry.channel)
                routes[key] = None
                if output is not None and output.publisher.heard:
                    routes[key] = output.publisher.publish_raw, output.conversion.convert or bytes
            route = routes[key]
            stamp = entry.stamp
            try:
                if route is not None:
                    publish, convert = route
                    publish(convert(entry.data))
                count += 1
            except MessageError as error:
                self.outputs.leave_out(entry.channel, error)
        self._last = stamp
        self.published += count

    def _entries(
        self, reader: BagReader, start: int, end: int, topics: Collection[str] | None = None
    ) -> Iterator[Entry]:
        return reader.messages(
            self.outputs.topics if topics is None else topics,
            start,
            end,
            reverse=topics is not None,
            damaged=lambda error: self.outputs.report(str(error)),
        )

    def _publish(self, items: Iterable[Played]) -> bool:
        """Publish messages when they are due; return False if a jump or the end interrupts it."""
        for stamp, publisher, payload in items:
            if not self._await(stamp, publisher.name) or self._interrupted:
                return False
            try:
                publisher.publish_raw(payload)
                self.published += 1
            except MessageError as error:  # a payload that is not even CDR
                text = f"a message of '{publisher.name}' is left out: {error}"
                self.outputs.report(text)
            self._last = stamp
            if not self.published & 255 and time.monotonic() >= self._next_report:
                self._report_progress()
        return not self._interrupted

    def _await(self, stamp: int, topic: str) -> bool:
        """Wait until a message is due; return False if a jump or the end interrupts it."""
        pace, options = self._pace, self._options
        if topic in self.outputs.pausing and not pace.paused:
            pace.change(paused=True)
        if options.skip_empty and stamp - self._last > options.skip_empty * _NS:
            pace.jump(stamp)
        control = None if options.immediate else self._control
        is_held = True
        while not self._interrupted:
            is_held = is_held and control is not None and control.hold(pace)
            if is_held:
                left = _FOREVER
            elif pace.paused:
                left = _FOREVER
                if self._steps:
                    self._steps -= 1
                    pace.jump(stamp)
                    left = 0.0
            elif options.immediate:
                pace.jump(stamp)
                left = 0.0
            else:
                left = pace.left(stamp)
            if self._clock is not None:
                left = min(left, self._clock.tick(pace, left, stamp))
            if left <= 0:
                return True
            self._wait(left)
        return False

    def _wait(self, seconds: float) -> None:
        """Wait some seconds, or until something changes, and report the progress."""
        if time.monotonic() >= self._next_report:
            self._report_progress()
        with self._changed:
            if not self._interrupted:
                self._changed.wait(min(seconds, _REPORT_SECONDS))

    def _report_progress(self) -> None:
        self._next_report = time.monotonic() + _REPORT_SECONDS
        stamp = max(self._last, min(self._pace.now(), self._end))
        self._report(
            Progress(
                stamp=stamp,
                elapsed=(stamp - self._start) / _NS,
                duration=(self._end - self._start) / _NS,
                rate=self._pace.rate,
                paused=self._pace.paused,
                delayed=self._pace.delayed,
                published=self.published,
            )
        )

    def _publish_latched(self, begin: int) -> None:
        """Publish latched messages from before a stamp.

        If the player starts paused, those of the first second of the bag count as earlier ones.
        """
        early = self._options.paused and not self._options.start and begin == self._start
        end = begin + _EARLY if early else begin - 1
        for reader in self._readers:
            for entry in reversed(list(self._last_latched(reader, end))):
                item = self.outputs.convert(entry)
                if item is not None:
                    item[1].publish_raw(item[2])

    def _last_latched(self, reader: BagReader, end: int) -> Iterator[Entry]:
        """Yield the last latched messages up to a stamp, as many as each channel latches."""
        left = {
            channel: min(qos.depth for qos in channel.qos if qos.latched)
            for channel in reader.channels
            if channel.latched and channel.topic in self.outputs.topics
        }
        if not left or end < reader.start:
            return
        for entry in self._entries(reader, 0, end, {channel.topic for channel in left}):
            if left.get(entry.channel, 0) > 0:
                left[entry.channel] -= 1
                yield entry
                if not any(left.values()):
                    return
