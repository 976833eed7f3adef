"""``rosz topic echo``, ``hz``, ``bw`` and ``delay``: what goes on until it is stopped."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rosz.cli.group import Call, print_lines, until_stopped, warn
from rosz.errors import ClosedError, NotFoundError
from rosz.introspect.subscribe import find_class, find_token, resolve_field, wait_for_target
from rosz.node import Context, Node
from rosz.qos import QoS

if TYPE_CHECKING:
    from msgspec import Struct

    from rosz.introspect.echo import EchoOptions
    from rosz.introspect.fields import Filter, Target
    from rosz.node import MessageInfo
    from rosz.session import Sample
    from rosz.wire import Token

__all__ = ("bw", "delay", "echo", "hz")

_TOOL = "rostopic"
_PERIOD = 1.0
_QUEUE = QoS(depth=10_000)
"""Messages that may wait while the terminal is slow."""


@contextmanager
def _node(call: Call) -> Iterator[Node]:
    """Be a node until stopped."""
    with (
        until_stopped() as ready,
        call.context(lasting=True) as context,
        Node(_TOOL, anonymous=True, context=context) as node,
    ):
        ready()
        yield node


def _target(node: Node, name: str) -> tuple[Target, Token]:
    context = node.context
    full = resolve_field(name, node.resolve)
    target = wait_for_target(context, full, warn)
    return target, find_token(context.graph.view(), target.topic, target.type_name)


def echo(call: Call, name: str, options: EchoOptions, *, count: int | None, raw: bool) -> None:
    """Print messages.

    Args:
        call: The call.
        name: Of a topic, or a field of one.
        options: How they are shown.
        count: How many; for ever when not given.
        raw: Show the bytes.
    """
    with _node(call) as node:
        target, token = _target(node, name)
        printer = _raw_text(options) if raw else _text(node, target, token, options)
        cls = None if raw else find_class(node.context, token)
        run = _Run(count)

        def arrived(message: Any, info: MessageInfo) -> None:
            run.take(message, info, printer)

        node.subscription(target.topic, cls, arrived, qos=_QUEUE, raw=raw, with_info=True)
        run.wait(node.context, target.topic)


def _text(
    node: Node, target: Target, token: Token, options: EchoOptions
) -> Callable[[Any], str | None]:
    from rosz.introspect.echo import Echo

    kind = target.path.type_in(find_class(node.context, token))
    return Echo(target.topic, kind, target.path, options, node.now).text


def _raw_text(options: EchoOptions) -> Callable[[bytes], str]:
    from rosz.introspect.echo import dump_bytes

    if options.as_json:
        return lambda payload: f'{{"payload":"{payload.hex()}"}}\n'
    return lambda payload: f"{dump_bytes(payload)}\n---\n"


class _Run:
    """Prints on the subscription's thread, and tells the main thread when to end."""

    def __init__(self, count: int | None) -> None:
        self._left = count
        self._ended = threading.Event()
        self._error: BaseException | None = None

    def take(self, message: Any, info: MessageInfo, printer: Callable[[Any], str | None]) -> None:
        if self._ended.is_set():
            return
        try:
            if info.lost:
                warn(f"{info.lost} messages are missing here")
            text = printer(message)
            if text is None:
                return
            sys.stdout.write(text)
            sys.stdout.flush()
        except LookupError as error:
            warn(f"a message is left out: {error}")
            return
        except Exception as error:  # noqa: BLE001  # handed to the main thread
            self._finish(error)
            return
        if self._left is not None:
            self._left -= 1
            if not self._left:
                self._finish(None)

    def _finish(self, error: Exception | None) -> None:
        self._error = error
        self._ended.set()

    def wait(self, context: Context, topic: str) -> None:
        """Wait for the end.

        Raises:
            ClosedError: The context was shut down by somebody else.
        """
        withdraw = context.on_shutdown(lambda _: self._ended.set())
        self._ended.wait()
        withdraw()
        if self._error is not None:
            raise self._error
        if context.is_shutdown:
            raise ClosedError(f"no more of '{topic}': {context.reason or 'shut down'}")


def hz(
    call: Call,
    topics: Sequence[str],
    *,
    window: int | None,
    condition: Filter | None,
    wall_time: bool,
    as_json: bool,
) -> None:
    """Print rates."""
    from rosz.introspect.measure import RateMeter, format_rate, format_rates

    with _node(call) as node:
        clock = time.monotonic_ns if wall_time else node.context.clock.steady
        meters: dict[str, RateMeter] = {}
        for name in topics:
            target, token = _target(node, name)
            meter = meters[target.topic] = RateMeter(window)
            if condition is None:
                _tap(node, token, lambda _, tick=meter.tick: tick(clock()))  # type: ignore[misc]
            else:
                _filtered(node, token, condition, meter, clock)
            if not as_json:
                print_lines([f"subscribed to [{token.name}]"])
        while not node.is_shutdown:
            node.context.wait_for_shutdown(_PERIOD)
            found = {name: meter.stats() for name, meter in meters.items()}
            if as_json:
                _print_stats(found)
                continue
            text = format_rates(found) if len(found) > 1 else format_rate(*found.values())
            print_lines([text])


def _tap(node: Node, token: Token, callback: Callable[[Sample], None]) -> None:
    from rosz.introspect.subscribe import subscribe_samples

    subscribe_samples(node, token.name, token.type_name, token.type_hash, callback)


def _print_stats(found: Mapping[str, Struct | None]) -> None:
    """Print what was measured as JSON, a line for each topic that has sent something."""
    import msgspec

    for name, stats in found.items():
        if stats is not None:
            row = {"topic": name, **msgspec.structs.asdict(stats)}
            print_lines([msgspec.json.encode(row).decode()])


def _filtered(node: Node, token: Token, condition: Filter, meter: Any, clock: Any) -> None:
    def arrived(message: Any) -> None:
        if condition.accepts(message, token.name):
            meter.tick(clock())

    node.subscription(token.name, find_class(node.context, token), arrived, qos=_QUEUE)


def bw(call: Call, topic: str, *, window: int | None, as_json: bool) -> None:
    """Print bandwidth."""
    from rosz.introspect.measure import BandwidthMeter, format_bandwidth

    with _node(call) as node:
        meter = BandwidthMeter(window)
        _, token = _target(node, topic)
        _tap(node, token, lambda sample: meter.add(sample.size, time.monotonic_ns()))
        if not as_json:
            print_lines([f"subscribed to [{token.name}]"])
        while not node.is_shutdown:
            node.context.wait_for_shutdown(_PERIOD)
            stats = meter.stats(time.monotonic_ns())
            if as_json:
                _print_stats({token.name: stats})
            elif stats is not None:
                print_lines([format_bandwidth(stats)])


def delay(call: Call, topic: str, *, window: int | None, as_json: bool) -> None:
    """Print ages."""
    from rosz.introspect.measure import DelayMeter, format_delay, read_stamp

    with _node(call) as node:
        meter = DelayMeter(window)
        target, token = _target(node, topic)
        cls = find_class(node.context, token)
        if not cls._has_header:
            raise NotFoundError(
                f"'{cls._type}' of topic '{target.topic}' has no header, so its age cannot be told"
            )

        def arrived(sample: Sample) -> None:
            meter.add(read_stamp(sample.payload, token.type_name), node.now())

        _tap(node, token, arrived)
        if not as_json:
            print_lines([f"subscribed to [{token.name}]"])
        while not node.is_shutdown:
            node.context.wait_for_shutdown(_PERIOD)
            if as_json:
                _print_stats({token.name: meter.stats()})
            elif meter.begun:
                print_lines([format_delay(meter.stats())])
