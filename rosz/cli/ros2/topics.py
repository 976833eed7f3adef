"""Messages of topics: printed, measured, published."""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from array import array
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.cli.console import MessagePrinter, print_lines
from rosz.cli.ros2.calls import read_values
from rosz.cli.ros2.graph import CommandFailed, open_node, wait_until
from rosz.errors import RoszError
from rosz.qos import DEFAULT, PARAMETERS, ROSOUT, SENSOR_DATA, QoS
from rosz.ros2.rosidl_runtime_py import (
    FILL_ERRORS,
    Limits,
    fill,
    to_csv,
    to_plain,
    to_repr,
    to_yaml,
)

if TYPE_CHECKING:
    from rosz.node import Context, MessageInfo, Node
    from rosz.session import Sample
    from rosz.wire import Token

_CLEAR = "\x1b[H\x1b[2J\n"
_SECOND = 1_000_000_000
_WAIT_SECONDS = 0.1
_REPLY_SECONDS = 2.0
_WAITS_PER_LINE = 10
_KILO, _MEGA = 1e3, 1e6
_PROFILES = {
    "action_status_default": QoS(depth=1, durability="transient_local"),
    "parameter_events": PARAMETERS,
    "parameters": PARAMETERS,
    "rosout_default": ROSOUT,
    "sensor_data": SENSOR_DATA,
}
_POLICIES = {
    "reliability": ("reliable", "best_effort"),
    "durability": ("volatile", "transient_local"),
    "history": ("keep_last", "keep_all"),
    "liveliness": ("automatic", "manual_by_topic"),
}
_Show = Callable[[Any, "MessageInfo"], str | None]


def _qos(given: Namespace) -> QoS:
    """Return the QoS that options say: a profile, with changes."""
    changes: dict[str, Any] = {}
    for policy, values in _POLICIES.items():
        value = getattr(given, f"qos_{policy}")
        if value in values:  # others are the choice of the system
            changes[policy] = value
    if given.qos_depth is not None and given.qos_depth >= 0:
        changes["depth"] = given.qos_depth
    lease = given.qos_liveliness_lease_duration_seconds
    if lease is not None and lease >= 0:
        changes["lease"] = round(lease * _SECOND)
    return msgspec.structs.replace(_PROFILES.get(given.qos_profile, DEFAULT), **changes)


def _message_class(context: Context, name: str, *, given: bool = True) -> Any:
    try:
        return context.types.message(name)
    except RoszError as error:
        which = "The passed message type" if given else f"The message type '{name}'"
        raise CommandFailed(f"{which} is invalid") from error


def _topic(node: Node, name: str, *, wait: bool = True) -> Token:
    """Return a token of a topic, of a publisher if there is one; wait while there is none."""
    from rosz.graph import View

    topic = node.resolve(name)

    def ends(view: View) -> list[Token]:
        return [*view.publishers(topic), *view.subscriptions(topic)]

    tokens = ends(node.context.graph.refresh())
    if not tokens:
        print_lines([f"WARNING: topic [{name}] does not appear to be published yet"])
        if not wait:
            raise CommandFailed("Could not determine the type for the passed topic")
        tokens = ends(wait_until(node.context, lambda view: bool(ends(view)), f"topic '{topic}'"))
    types = sorted({token.type_name for token in tokens})
    if len(types) > 1:
        raise CommandFailed(
            f"Cannot echo topic '{name}', as it contains more than one type: [{', '.join(types)}]"
        )
    return tokens[0]


# Echo


def echo(given: Namespace) -> None:
    """Print the messages of a topic."""
    fields = None if given.field is None else [part for part in given.field.split(".") if part]
    if fields == []:
        raise CommandFailed(f"Invalid field value '{given.field}'")
    condition = _condition(given)
    with open_node(given.node_name, lasting=not given.once) as node:
        qos = _echo_qos(node, given)
        type_name = given.type or _topic(node, given.name, wait=False).type_name
        cls = _message_class(node.context, type_name, given=given.type is not None)
        printer = MessagePrinter(_shown(given, fields, condition), 1 if given.once else None)
        node.subscription(given.name, cls, printer.receive, qos=qos, raw=given.raw, with_info=True)
        printer.wait(node.context, timeout=given.timeout)


def _condition(given: Namespace) -> Callable[[Any], bool] | None:
    if not given.filter:
        return None
    from rosz.introspect import Filter

    return Filter(given.filter).accepts


def _echo_qos(node: Node, given: Namespace) -> QoS:
    """Return a QoS that gets the messages of all publishers, unless options say another one."""
    qos = _qos(given)
    names = (*_POLICIES, "depth", "liveliness_lease_duration_seconds")
    if any(getattr(given, f"qos_{name}") is not None for name in names):
        return qos
    offered = [token.qos for token in node.context.graph.refresh().publishers(given.name)]
    for policy, best, other in (
        ("reliability", "reliable", "best_effort"),
        ("durability", "transient_local", "volatile"),
    ):
        number = sum(getattr(each, policy) == best for each in offered)
        if offered:
            value = best if number == len(offered) else other
            qos = msgspec.structs.replace(qos, **{policy: value})
        if 0 < number < len(offered):
            kind = f"QoS{policy.title()}Policy"
            print_lines(
                [
                    f"Some, but not all, publishers are offering {kind}.{best.upper()}. Falling"
                    f" back to {kind}.{other.upper()} as it will connect to all publishers"
                ]
            )
    return qos


def _shown(
    given: Namespace, fields: list[str] | None, condition: Callable[[Any], bool] | None
) -> _Show:
    """Return the function that makes the text of a message."""
    limits = _limits(given)
    lost = 0

    def show(message: Any, info: MessageInfo) -> str | None:
        nonlocal lost
        lost += info.lost
        if info.lost and not given.no_lost_messages:
            sys.stdout.write(
                f"A message was lost!!!\n\ttotal count change:{info.lost}"
                f"\n\ttotal count: {lost}---\n"
            )
        for field in fields or ():
            try:
                message = getattr(message, field)
            except AttributeError as error:
                path = ".".join(fields or ())
                raise CommandFailed(f"Invalid field '{path}': {error}") from error
        if condition is not None and not condition(message):
            return None
        return (_CLEAR if given.clear else "") + _text(message, info, given, limits)

    return show


def _limits(given: Namespace) -> Limits:
    length = None if given.full_length else given.truncate_length
    return Limits(length, given.no_arr, given.no_str)


def _text(message: Any, info: MessageInfo, given: Namespace, limits: Limits) -> str:
    origin = {
        "source_timestamp": info.source_time,
        "received_timestamp": info.reception_time,
        "publication_sequence_number": info.sequence,
        "reception_sequence_number": None,
    }
    with_info = given.include_message_info
    if not hasattr(message, "_schema"):
        shown = array("B", message) if isinstance(message, bytes) and not given.raw else message
        before = f"---Got new message, message info:---\n{origin}\n---Message data:---\n"
        return f"{before if with_info else ''}{shown}\n---\n"
    if given.csv:
        row = to_csv(message, limits)
        return f"{','.join(map(str, origin.values()))},{row}\n" if with_info else f"{row}\n"
    before = f"{to_yaml(dict(sorted(origin.items())))}---\n" if with_info else ""
    return f"{before}{to_yaml(message, limits, flow=given.flow_style)}---\n"


def echo_service(given: Namespace) -> None:
    """Print the events of a service that is introspected."""
    from rosz.msgs.service_msgs.msg import ServiceEventInfo
    from rosz.node.ros2 import event_class

    names = {
        value: name
        for name, value in vars(ServiceEventInfo).items()
        if name.isupper() and isinstance(value, int)
    }
    topic, limits = f"{given.name}/_service_event", _limits(given)
    decoders: list[Callable[[bytes], Any]] = []

    def show(payload: bytes, _: MessageInfo) -> str:
        message = decoders[0](payload)
        if given.csv:
            return f"{to_csv(message, limits)}\n"
        plain = to_plain(message, limits)
        plain["info"]["event_type"] = names[plain["info"]["event_type"]]
        return f"{to_yaml(plain, flow=given.flow_style)}---\n"

    printer = MessagePrinter(show)
    with open_node(lasting=True) as node:
        view = node.context.graph.refresh()
        if given.type is None:
            types = view.services().get(node.resolve(given.name))
            if types is None:
                raise CommandFailed("Could not load the type for the passed service")
            given.type = types[0]
        if not view.publishers(node.resolve(topic)):
            print_lines(
                [
                    f"No publishers on topic '{topic}'; is service introspection on the client or"
                    " server enabled?"
                ]
            )
        try:
            decoders.append(node.context.decoder(event_class(node.context.types, given.type)))
        except (RoszError, ValueError) as error:
            raise CommandFailed(f"The service type '{given.type}' is invalid") from error
        node.subscription(topic, None, printer.receive, qos=DEFAULT, raw=True, with_info=True)
        printer.wait(node.context)


# Measuring


def _tap(node: Node, token: Token, receive: Callable[[Sample], None]) -> None:
    from rosz.introspect import subscribe_samples

    subscribe_samples(node, token.name, token.type_name, token.type_hash, receive)


def _report(node: Node, text: Callable[[], str | None]) -> None:
    """Print a text each second."""
    while not node.context.wait_for_shutdown(1.0):
        shown = text()
        if shown:
            print_lines([shown])


def hz(given: Namespace) -> None:
    """Print the rates of topics."""
    from rosz.introspect import RateMeter

    condition = _condition(given)
    # Ctrl-C is the regular end of this command, unlike others.
    with suppress(KeyboardInterrupt), open_node(lasting=True) as node:
        clock = time.monotonic_ns if given.wall_time else node.clock.steady
        meters = {name: RateMeter(given.window + 1) for name in given.names}
        for name, meter in meters.items():
            cls = _message_class(node.context, _topic(node, name).type_name, given=False)

            def receive(message: Any, meter: RateMeter = meter) -> None:
                if condition is None or condition(message):
                    meter.tick(clock())

            raw = condition is None
            node.subscription(name, cls, receive, qos=SENSOR_DATA, raw=raw)
            if len(meters) > 1:
                print_lines([f"Subscribed to [{name}]"])
        _report(node, lambda: _rates(meters))


def _rates(meters: dict[str, Any]) -> str | None:
    from rosz.introspect import format_rate, rate_table

    stats = {name: meter.stats() for name, meter in meters.items()}
    measured = {name: _counted(each) for name, each in stats.items() if each is not None}
    if len(meters) == 1:
        return next(map(format_rate, measured.values()), None)
    rows = [
        (
            name,
            *(f"{value:.3f}" for value in (s.rate, s.min_delta, s.max_delta)),
            f"{s.std_dev:.5f}",
            str(s.window),
        )
        for name, s in measured.items()
    ]
    return rate_table(rows) if rows else None


def _counted(stats: Any) -> Any:
    """Return statistics that count the times between messages, as ROS 2 does."""
    return msgspec.structs.replace(stats, window=stats.window - 1)


def bandwidth(given: Namespace) -> None:
    """Print the bandwidth of a topic."""
    from rosz.introspect import BandwidthMeter

    meter = BandwidthMeter(given.window)

    def text() -> str | None:
        stats = meter.stats(time.monotonic_ns())
        if stats is None:
            return None
        scale, form = (1.0, "{:.0f} B") if stats.bytes_per_second < _KILO else (_KILO, "{:.2f} KB")
        if stats.bytes_per_second >= _MEGA:
            scale, form = _MEGA, "{:.2f} MB"
        sizes = (stats.bytes_per_second, stats.mean, stats.min_size, stats.max_size)
        rate, mean, low, high = (form.format(size / scale) for size in sizes)
        count = stats.window
        return f"{rate}/s from {count} messages\n\tMessage size mean: {mean} min: {low} max: {high}"

    def add(sample: Sample) -> None:
        meter.add(sample.size, time.monotonic_ns())

    with open_node(lasting=True) as node:
        _tap(node, _topic(node, given.name), add)
        print_lines([f"Subscribed to [{given.name}]"])
        _report(node, text)


def delay(given: Namespace) -> None:
    """Print the age of the messages of a topic."""
    from rosz.introspect import DelayMeter, format_delay, read_stamp

    meter = DelayMeter(given.window + 1)
    with open_node(lasting=True) as node:
        token = _topic(node, given.name)
        if not _message_class(node.context, token.type_name, given=False)._has_header:
            raise CommandFailed("msg does not have header")

        def add(sample: Sample) -> None:
            meter.add(read_stamp(sample.payload, token.type_name), node.now())

        def text() -> str | None:
            stats = meter.stats()
            if stats is None:
                return "no new messages" if meter.begun else None
            return format_delay(_counted(stats))

        _tap(node, token, add)
        _report(node, text)


# Publishing


def publish(given: Namespace) -> str | None:
    """Publish messages."""
    times = 1 if given.once else given.times
    wanted = given.wait_matching_subscriptions
    wanted = int(times != 0) if wanted is None else wanted
    with open_node(given.node_name, lasting=times != 1) as node:
        cls = _message_class(node.context, given.type)
        values = read_values(sys.stdin.read() if given.stdin else given.values)
        if not isinstance(values, dict):
            return "The passed value needs to be a dictionary in YAML format"
        if not wanted and given.max_wait_time_secs is not None:
            return (
                "--max-wait-time-secs option is only effective with"
                " --wait-matching-subscriptions, --once or --times"
            )
        publisher = node.publisher(given.name, cls, qos=_qos(given))
        late = _await_subscriptions(publisher, wanted, given.max_wait_time_secs)
        if late:
            return late
        message = cls()
        try:
            stamps = fill(message, values, stamped=True)
        except FILL_ERRORS as error:
            return f"Failed to populate field: {error}"
        print_lines(["publisher: beginning loop"])
        count, due = 0, time.monotonic()
        while True:
            for stamp in stamps:
                stamp.sec, stamp.nanosec = divmod(node.now(), 1_000_000_000)
            count += 1
            if given.print and count % given.print == 0:
                print_lines([f"publishing #{count}: {to_repr(message)}\n"])
            publisher.publish(message)
            if count == times:
                break
            due += 1 / given.rate
            node.context.wait_for_shutdown(max(0.0, due - time.monotonic()))
        node.context.wait_for_shutdown(given.keep_alive)
    return None


def _await_subscriptions(publisher: Any, wanted: int, most: float | None) -> str:
    """Wait for subscriptions of a publisher; return what to print if there are too few in time."""
    waits = 0
    while wanted and (number := _subscriptions(publisher)) < wanted:
        if waits % _WAITS_PER_LINE == 0:
            print_lines([f"Waiting for at least {wanted} matching subscription(s)..."])
        if most is not None and waits * _WAIT_SECONDS >= most:
            return (
                f"Timed out waiting for subscribers: Expected {wanted} subcribers but only got"
                f" {number} subscribers"
            )
        time.sleep(_WAIT_SECONDS)
        waits += 1
    return ""


def _subscriptions(publisher: Any) -> int:
    """Return the number of subscriptions that a publisher reaches, as the network tells now."""
    view = publisher.others.refresh(_REPLY_SECONDS)
    return sum(map(publisher.matches, view.subscriptions(publisher.name)))
