"""Playing bags: their messages are published again, at the times at which they were recorded."""

from __future__ import annotations

import heapq
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import chain, islice
from typing import TYPE_CHECKING, Any, TypeAlias

import msgspec

from rosz.bags.ahead import ReadAhead
from rosz.bags.bag import BagReader, Channel, Entry, Payload
from rosz.bags.migrate import Conversion, find_conversion
from rosz.bags.pace import Pace
from rosz.errors import MessageError, RoszError
from rosz.node import Publisher
from rosz.qos import QoS

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("PlayOptions", "Player", "Progress")

_NS = 1_000_000_000
_FOREVER = threading.TIMEOUT_MAX / 2
_LOOK_SECONDS = 0.1
"""Time between two reports of progress."""
_RECENT = _NS
"""A latched message this early in a bag is one that was published before the bag began."""
_BATCH = 256
"""Messages that are published at once, before keys and new subscriptions are looked for."""
_CLOCK = "/clock"

_Item: TypeAlias = "tuple[int, Publisher[Any], bytes]"


class PlayOptions(msgspec.Struct, frozen=True, kw_only=True):
    """Options for playing bags.

    Attributes:
        rate: Seconds of the bag per second.
        start: Seconds of the bags to leave out.
        duration: Seconds of the bags to play; None for all.
        loop: Whether to begin again at the end.
        keep_alive: Whether to stay at the end, for what is latched.
        clock: Rate at which ``/clock`` is published, in hertz; 0 for not at all.
        immediate: Whether to publish without waiting.
        paused: Whether to begin with a pause.
        wait_for_subscribers: Whether to wait until each topic has a subscriber.
        prefix: Text put before the names of topics.
        topics: Names of the topics to play; all if empty.
        pause_topics: Names of topics whose messages begin a pause.
        delay: Seconds to wait after the publishers are made.
        queue: Depth of the queues of publishers whose QoS was not recorded.
        skip_empty: Seconds without a message that are skipped if they are more; 0 for none.
        rate_control_topic: Name of a topic whose messages begin with a header. Without
            ``immediate``, the time of the bags stays near the stamp of the latest of them.
        rate_control_max_delay: Seconds of the bags by which their time may be later.
    """

    rate: float = 1.0
    start: float = 0.0
    duration: float | None = None
    loop: bool = False
    keep_alive: bool = False
    clock: float = 0.0
    immediate: bool = False
    paused: bool = False
    wait_for_subscribers: bool = False
    prefix: str = ""
    topics: tuple[str, ...] = ()
    pause_topics: tuple[str, ...] = ()
    delay: float = 0.2
    queue: int = 100
    skip_empty: float = 0.0
    rate_control_topic: str = ""
    rate_control_max_delay: float = 1.0


class Progress(msgspec.Struct, frozen=True):
    """How far a player has come.

    Attributes:
        stamp: Time of the bag, in nanoseconds.
        elapsed: Seconds of the bags that are played.
        duration: Seconds of the bags in all.
        rate: Seconds of the bag per second.
        paused: Whether it stands still.
        delayed: Whether it waits for the topic that controls its rate.
        published: Number of messages that were published.
    """

    stamp: int
    elapsed: float
    duration: float
    rate: float
    paused: bool
    delayed: bool
    published: int


class Player:
    """Publishes the messages of bags, merged by time.

    The publishers have the QoS that was recorded. A latched message from before the start is
    published first.

    Args:
        node: The node that publishes.
        readers: The bags.
        options: How they are played.
        warn: Function called with each problem; what has it is left out.
        report: Function called with the progress, some times per second.

    Attributes:
        problems: Number of problems.
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
        self._warn = warn
        self._report = report
        self.problems: int = 0
        self.published: int = 0
        self.loop: bool = options.loop
        counted = [one for one in readers if one.count()]
        first = min((one.start for one in counted), default=0)
        last = max((one.end for one in counted), default=0)
        self._start = first + int(options.start * _NS)
        self._end = last
        if options.duration is not None:
            self._end = min(last, self._start + int(options.duration * _NS))
        self._changed = threading.Condition()
        self._steps = 0
        self._target: int | None = None  # where to go on, in place of the next message
        self._pace = Pace(self._start, options.rate, paused=options.paused)
        self._next_report = 0.0
        self._next_tick = 0.0
        self._last = self._start
        self._closed = False
        self._failed: set[int] = set()
        self._pausing: set[str] = set()
        self._outputs: dict[int, tuple[Channel, Publisher[Any], Conversion] | None] = {}
        self._made: dict[Any, Publisher[Any]] = {}
        self._tick: Callable[[int], None] | None = None
        self._controlled = self._start  # the latest stamp of the topic that controls the rate
        self._topics = self._chosen_topics()
        if not counted:
            self._warn("nothing to play: the bags have no messages")
        elif self._start > last:
            self._warn(
                f"nothing to play: --start {options.start:g} is behind the end of the bags, which"
                f" have {(last - first) / _NS:.1f} s"
            )

    def _chosen_topics(self) -> set[str]:
        known = {channel.topic for one in self._readers for channel in one.channels}
        wanted = {_absolute(one) for one in self._options.topics}
        missing = sorted(wanted - known)
        if missing:
            self._problem(
                f"no topic '{missing[0]}' in the bags; they have {', '.join(sorted(known))}"
            )
        for one in sorted(set(map(_absolute, self._options.pause_topics)) - known):
            self._warn(f"no topic '{one}' to pause at in the bags")
        chosen = wanted & known if wanted else known
        if self._options.clock and _CLOCK in chosen:
            chosen.discard(_CLOCK)
            self._warn("the recorded /clock is not played, since --clock publishes it")
        return chosen

    def _problem(self, text: str) -> None:
        self.problems += 1
        self._warn(text)

    # Control, from any thread.

    def toggle(self) -> None:
        """Pause, or go on."""
        with self._changed:
            self._pace.paused = not self._pace.paused
            self._changed.notify_all()

    def step(self) -> None:
        """Publish the next message of a pause."""
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
            self._pace.rate = rate
            self._changed.notify_all()

    def jump(self, elapsed: float) -> None:
        """Go on from another place, in seconds since the start; a pause stays one.

        Latched messages from before that place are published first.
        """
        with self._changed:
            self._target = min(max(self._start, self._start + int(elapsed * _NS)), self._end)
            self._steps = 0
            self._changed.notify_all()

    def stop(self) -> None:
        """End."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    # Publishers.

    def advertise(self) -> None:
        """Make the publishers, and wait until subscriptions have found them.

        Raises:
            ClosedError: The node was shut down meanwhile.
        """
        for reader in self._readers:
            for channel in reader.channels:
                if channel.topic in self._topics:
                    self._output(channel)
        if self._options.clock:
            self._tick = self._make_clock()
        if self._options.rate_control_topic:
            self._follow_control(self._options.rate_control_topic)
        context = self._node.context
        context.mesh.linked.wait(context.HOLD_TIMEOUT)  # else the publishers would drop
        context.wait_for_shutdown(self._options.delay)
        if self._options.wait_for_subscribers:
            for publisher in self._made.values():
                publisher.wait_for_subscribers(1, _FOREVER)

    def _make_clock(self) -> Callable[[int], None]:
        from rosz.msgs.builtin_interfaces.msg import Time
        from rosz.msgs.rosgraph_msgs.msg import Clock

        publisher = self._node.publisher(_CLOCK, Clock, qos=QoS(depth=1))
        return lambda stamp: publisher.publish(Clock(clock=Time.from_nsec(stamp)))

    def _follow_control(self, topic: str) -> None:
        warned: list[str] = []

        def receive(message: Any) -> None:
            if not message._has_header:
                if not warned:
                    warned.append(message._type)
                    self._warn(
                        f"'{topic}' controls nothing: '{message._type}' does not begin with a"
                        " header"
                    )
                return
            with self._changed:
                self._controlled = message.header.stamp.to_nsec()
                self._changed.notify_all()

        self._node.subscription(topic, callback=receive)

    def _output(self, channel: Channel) -> tuple[Channel, Publisher[Any], Conversion] | None:
        """Return the publisher of a channel, and how its messages are converted; None for none."""
        key = id(channel)
        if key not in self._outputs:
            # The channel is kept, so that no other one gets its identity.
            self._outputs[key] = self._make_output(channel)
        return self._outputs[key]

    def _make_output(self, channel: Channel) -> tuple[Channel, Publisher[Any], Conversion] | None:
        try:
            conversion = find_conversion(channel, self._node.context.types)
        except RoszError as error:
            if channel not in [one[0] for one in self._outputs.values() if one]:
                self._problem(f"topic '{channel.topic}' is left out: {error}")
            return None
        cls = conversion.message_type
        key = channel.topic, cls._type_hash, channel.qos, channel.node
        if key not in self._made:
            if conversion.added:
                self._warn(
                    f"topic '{channel.topic}': the bag lacks {', '.join(conversion.added)} of"
                    f" '{cls._type}', which get their defaults"
                )
            name = self._node.resolve(self._options.prefix + channel.topic)
            express = not self._options.immediate
            made = Publisher(self._node, name, cls, self._qos(channel), waits=True, express=express)
            self._made[key] = self._node.keep(made)
            if channel.topic in map(_absolute, self._options.pause_topics):
                self._pausing.add(made.name)
        return channel, self._made[key], conversion

    def _qos(self, channel: Channel) -> QoS:
        """Return the QoS of a channel; where it joins several, the one that offers most."""
        if not channel.qos or (channel.encoding == "ros1" and not channel.latched):
            return (
                QoS(depth=self._options.queue) if self._options.queue else QoS(history="keep_all")
            )
        best = max(channel.qos, key=lambda one: (one.latched, one.reliable, one.depth))
        return msgspec.structs.replace(
            best, reliability=max(one.reliability for one in channel.qos)
        )

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
                self._last = self._controlled = begin
            while self._options.keep_alive and not self._closed:
                self._wait(_LOOK_SECONDS)
        finally:
            withdraw()

    @property
    def _interrupted(self) -> bool:
        return self._closed or self._target is not None

    def _play(self, begin: int) -> None:
        parts = [self._entries(one, begin, self._end) for one in self._readers]
        entries = parts[0] if len(parts) == 1 else heapq.merge(*parts, key=lambda one: one.stamp)
        if self._options.immediate:
            self._play_at_once(entries)
            return
        items = ((len(item[2]), item) for item in map(self._convert, entries) if item)
        with ReadAhead(items) as ahead:
            ahead.fill()
            batches = iter(ahead)
            some = next(batches, [])
            # Making the publishers, waiting and reading so far do not count as time of the bag.
            self._pace.jump(begin)
            for batch in chain((some,), batches):
                if not self._publish(batch):
                    return
        self._look()

    def _play_at_once(self, entries: Iterator[Entry]) -> None:
        """Publish messages without waiting, but in a pause and for ``/clock``."""
        for first in entries:
            some = chain((first,), islice(entries, _BATCH - 1))
            if self._pausing or self._tick or self._pace.paused:
                self._publish(item for item in map(self._convert, some) if item)
            else:
                self._rush(some)
            if self._interrupted:
                return
            if time.monotonic() >= self._next_report:
                self._look()

    def _rush(self, entries: Iterable[Entry]) -> None:
        """Publish messages at once; those that nobody would receive are only counted."""
        # The publisher of each channel, None where nobody would receive it, and its conversion.
        known: dict[int, tuple[Callable[[bytes], None] | None, Callable[[Payload], bytes]]] = {}
        stamp, count = self._last, 0
        for entry in entries:
            found = known.get(id(entry.channel))
            if found is None:
                output = self._output(entry.channel)
                if output is not None and output[1].heard:
                    found = output[1].publish_raw, output[2].convert or bytes
                else:
                    found = None, bytes
                known[id(entry.channel)] = found
            publish, convert = found
            stamp = entry.stamp
            try:
                if publish is not None:
                    publish(convert(entry.data))
                count += 1
            except MessageError as error:
                self._leave_out(entry.channel, error)
        self._last = stamp
        self.published += count

    def _entries(
        self, reader: BagReader, start: int, end: int, topics: Collection[str] | None = None
    ) -> Iterator[Entry]:
        return reader.messages(
            self._topics if topics is None else topics,
            start,
            end,
            reverse=topics is not None,
            damaged=lambda error: self._problem(str(error)),
        )

    def _convert(self, entry: Entry) -> _Item | None:
        output = self._output(entry.channel)
        if output is None:
            return None
        _, publisher, conversion = output
        try:
            return entry.stamp, publisher, (conversion.convert or bytes)(entry.data)
        except MessageError as error:
            self._leave_out(entry.channel, error)
            return None

    def _leave_out(self, channel: Channel, error: MessageError) -> None:
        """Count a message that cannot be published, and tell the first of a channel."""
        self.problems += 1
        if id(channel) not in self._failed:
            self._failed.add(id(channel))
            self._warn(f"messages of '{channel.topic}' are left out: {error} (told once)")

    def _publish(self, items: Iterable[_Item]) -> bool:
        """Publish messages when they are due; return False at the end of the node."""
        for item in items:
            if not self._await(item[0], item[1].name) or self._interrupted:
                return False
            self._send(item)
            self._last = item[0]
            if not self.published & 255 and time.monotonic() >= self._next_report:
                self._look()
        return not self._interrupted

    def _send(self, item: _Item) -> None:
        try:
            item[1].publish_raw(item[2])
            self.published += 1
        except MessageError as error:  # a payload that is not even CDR
            self._problem(f"a message of '{item[1].name}' is left out: {error}")

    def _await(self, stamp: int, topic: str) -> bool:
        """Wait until a message is due; return False at the end of the node, and to jump."""
        pace, options = self._pace, self._options
        if topic in self._pausing and not pace.paused:
            pace.paused = True
        if options.skip_empty and stamp - self._last > options.skip_empty * _NS:
            pace.jump(stamp)
        ahead = True
        while not self._interrupted:
            ahead = ahead and self._is_ahead()
            if ahead:
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
            if self._tick is not None:
                left = min(left, self._clock(left, stamp))
            if left <= 0:
                return True
            self._wait(left)
        return False

    def _is_ahead(self) -> bool:
        """Return whether the time of the bags is too late for the topic that controls the rate."""
        options, pace = self._options, self._pace
        if not options.rate_control_topic or options.immediate:
            return False
        ahead = pace.now() - self._controlled > options.rate_control_max_delay * _NS
        if ahead != pace.held:
            pace.held = ahead
        return ahead

    def _clock(self, left: float, stamp: int) -> float:
        """Publish the time if its turn has come; return the seconds until its next turn."""
        now = time.monotonic()
        if self._tick is not None and (now >= self._next_tick or self._options.immediate):
            self._tick(min(self._pace.now(), stamp) if left > 0 else stamp)
            period = 1 / self._options.clock
            self._next_tick = max(self._next_tick + period, now)
        return max(self._next_tick - now, 0.0001) if left > 0 else 0.0

    def _wait(self, seconds: float) -> None:
        """Wait, or until something changes, and report the progress."""
        if time.monotonic() >= self._next_report:
            self._look()
        with self._changed:
            if not self._interrupted:
                self._changed.wait(min(seconds, _LOOK_SECONDS))

    def _look(self) -> None:
        self._next_report = time.monotonic() + _LOOK_SECONDS
        stamp = max(self._last, min(self._pace.now(), self._end))
        self._report(
            Progress(
                stamp=stamp,
                elapsed=(stamp - self._start) / _NS,
                duration=(self._end - self._start) / _NS,
                rate=self._pace.rate,
                paused=self._pace.paused,
                delayed=self._pace.held,
                published=self.published,
            )
        )

    # What is latched.

    def _publish_latched(self, begin: int) -> None:
        """Publish latched messages from before a stamp.

        With a pause at the start, those that were published before the bag began are such, too.
        """
        early = self._options.paused and not self._options.start and begin == self._start
        for reader in self._readers:
            latched = [one for one in reader.channels if one.latched and one.topic in self._topics]
            end = begin + _RECENT if early else begin - 1
            if not latched or end < reader.start:
                continue
            for entry in reversed(list(self._last_messages(reader, latched, end))):
                item = self._convert(entry)
                if item is not None:
                    item[1].publish_raw(item[2])

    def _last_messages(
        self, reader: BagReader, channels: Sequence[Channel], end: int
    ) -> Iterator[Entry]:
        """Yield the last messages of channels up to a stamp, as many as each latches."""
        left = {one: min(qos.depth for qos in one.qos if qos.latched) for one in channels}
        for entry in self._entries(reader, 0, end, {one.topic for one in channels}):
            if left.get(entry.channel, 0) > 0:
                left[entry.channel] -= 1
                yield entry
                if not any(left.values()):
                    return


def _absolute(name: str) -> str:
    return name if name.startswith("/") else f"/{name}"
