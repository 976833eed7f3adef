"""The programs ``relay``, ``throttle`` and ``drop``, which pass on one topic, or some of it."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NoReturn

from rosz.node import MessageInfo, Node, TimerEvent, serve_loggers
from rosz.programs.topic_tools.passing import RawInput, RawOutput, base_name
from rosz.remap import parse
from rosz.wire import Kind

_CDR_HEADER = 4
_NANOSECONDS = 1_000_000_000

_RELAY_USAGE = "usage: relay IN_TOPIC [OUT_TOPIC]"
_DROP_USAGE = """\
usage: drop IN_TOPIC X Y [OUT_TOPIC]
  Drops X of every Y messages. The default of OUT_TOPIC is IN_TOPIC_drop."""
_THROTTLE_USAGE = """\
usage: throttle messages IN_TOPIC MSGS_PER_SEC [OUT_TOPIC]
       throttle bytes IN_TOPIC BYTES_PER_SEC WINDOW [OUT_TOPIC]
  Drops messages so that each comes 1/MSGS_PER_SEC seconds after the one before, or that no more
  than BYTES_PER_SEC bytes come in WINDOW seconds. The default of OUT_TOPIC is
  IN_TOPIC_throttle."""

Accept = Callable[[bytes], bool]
"""Function that returns whether to pass a message on."""


class PeriodLimit:
    """Accept a message if a period has passed since the last one that was accepted.

    The rate is in messages per second, and the clock in nanoseconds.
    """

    def __init__(self, rate: float, now: Callable[[], int]) -> None:
        self._period = _NANOSECONDS / rate
        self._now = now
        self._last = -math.inf

    def __call__(self, _data: bytes) -> bool:
        """Return whether to pass a message on."""
        now = self._now()
        # A clock that was set back begins a new period.
        self._last = min(self._last, now)
        if now - self._last <= self._period:
            return False
        self._last = now
        return True


class ByteLimit:
    """Accept a message if few enough bytes were accepted within a window of time.

    Args:
        size: Number of bytes per window from which on messages are refused.
        window: The window in seconds.
    """

    def __init__(self, size: int, window: float, now: Callable[[], int]) -> None:
        self._size = size
        self._window = window * _NANOSECONDS
        self._now = now
        self._sent: deque[tuple[int, int]] = deque()

    def __call__(self, data: bytes) -> bool:
        """Return whether to pass a message on."""
        now = self._now()
        while self._sent and self._sent[0][0] < now - self._window:
            self._sent.popleft()
        if sum(size for _, size in self._sent) >= self._size:
            return False
        self._sent.append((now, len(data) - _CDR_HEADER))
        return True


class Share:
    """Refuse the first messages of each group of a size."""

    def __init__(self, refused: int, size: int) -> None:
        self._refused = refused
        self._size = size
        self._count = 0

    def __call__(self, _data: bytes) -> bool:
        """Return whether to pass a message on."""
        accepted = self._count >= self._refused
        self._count = (self._count + 1) % self._size
        return accepted


class RelayedTopic:
    """Pass a topic on, except messages that ``accept`` refuses.

    Its private parameters are those of ROS 1: ``lazy`` subscribes only while the output has
    subscribers, ``unreliable``, and for ``relay`` ``stealth``, which subscribes only while others
    subscribe to ``monitor_topic``, looked at each ``monitor_rate`` seconds.

    Args:
        latch: Whether the output latches; as the input does when None.
    """

    def __init__(
        self,
        node: Node,
        source: str,
        target: str,
        accept: Accept | None = None,
        *,
        latch: bool | None = None,
    ) -> None:
        params = node.params
        self._node = node
        self._accept = accept
        self._following = threading.Lock()
        self._lazy = params.get("~lazy", False, type=bool)
        self._stealth = params.get("~stealth", False, type=bool)
        unreliable = params.get("~unreliable", False, type=bool)
        self._input = RawInput(node, source, self._receive, unreliable=unreliable)
        self._output = RawOutput(node, target, latch=latch, changed=self._changed)
        if self._input.name == self._output.name:
            sys.exit(f"relay: the input and the output are both '{self._input.name}'")
        if self._stealth:
            self._monitored = node.resolve(params.get("~monitor_topic", source, type=str))
            graph = node.context.graph
            self._followed = node.keep(graph.follow_entities(Kind.SUBSCRIPTION, self._monitored))
            node.timer(params.get("~monitor_rate", 1.0, type=float), self._monitor)
        self._input.open()

    def _receive(self, data: bytes, info: MessageInfo, source: RawInput) -> None:
        self._output.advertise(info, source)
        if self._stealth and not self._output.subscribed:
            source.close()
        elif self._lazy and not self._output.subscribed:
            self._changed()
        elif self._accept is None or self._accept(data):
            self._output.publish(data, info, source)

    def _changed(self) -> None:
        """Follow the subscribers of the output."""
        if not self._lazy or self._stealth:
            return
        with self._following:
            if self._output.subscribed:
                self._input.open()
            else:
                self._input.close()

    def _monitor(self, _: TimerEvent) -> None:
        if not self._output.advertised:
            return
        others = self._followed.view().subscriptions(self._monitored)
        if any(token.node_name != self._node.name for token in others):
            self._input.open()
        else:
            self._input.close()


def relay() -> None:
    """Pass a topic on under another name."""
    given = list(parse(sys.argv[1:]).rest)
    if len(given) not in {1, 2}:
        sys.exit(_RELAY_USAGE)
    with Node(f"{base_name(given[0])}_relay", anonymous=True) as node:
        serve_loggers(node)
        RelayedTopic(node, given[0], given[1] if given[1:] else f"{given[0]}_relay")
        node.spin()


def drop() -> None:
    """Pass on some of every few messages."""
    given = list(parse(sys.argv[1:]).rest)
    if len(given) not in {3, 4}:
        sys.exit(_DROP_USAGE)
    source, refused, size = given[0], int(_number(given[1], 0)), int(_number(given[2], 1))
    with Node(f"{base_name(source)}_drop", anonymous=True) as node:
        serve_loggers(node)
        target = given[3] if given[3:] else f"{source}_drop"
        RelayedTopic(node, source, target, Share(refused, size), latch=False)
        node.spin()


def throttle() -> None:
    """Pass on a limited number of messages or bytes per second.

    The private parameter ``wall_clock`` makes the clock of the machine count in place of ROS time,
    and ``force_latch`` decides whether the output latches.
    """
    kind, *given = list(parse(sys.argv[1:]).rest) or [""]
    limits = {"messages": 1, "bytes": 2}.get(kind, 0)
    if not limits or len(given) - limits not in {1, 2}:
        sys.exit(_THROTTLE_USAGE)
    source = given[0]
    rate, *window = (_number(word, 0) for word in given[1 : 1 + limits])
    if not rate:
        _refuse(given[1], "a number above 0")
    with Node(f"{base_name(source)}_throttle", anonymous=True) as node:
        serve_loggers(node)
        wall_clock = node.params.get("~wall_clock", False, type=bool)
        now = time.time_ns if wall_clock else node.now
        accept: Accept = PeriodLimit(rate, now)
        if window:
            accept = ByteLimit(int(rate), window[0], now)
        latch = node.params.get("~force_latch", None)
        target = given[-1] if len(given) == 2 + limits else f"{source}_throttle"
        RelayedTopic(node, source, target, accept, latch=None if latch is None else bool(latch))
        node.spin()


def _number(word: str, least: int) -> float:
    """Return a number of the command line; end the program if it is none, or too small."""
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not least <= value < math.inf:
        _refuse(word, f"a number from {least}")
    return value


def _refuse(word: str, expected: str) -> NoReturn:
    sys.exit(f"{sys.argv[0].rpartition('/')[2]}: '{word}': expected {expected}")
