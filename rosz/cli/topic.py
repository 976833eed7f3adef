"""``rosz topic``: the commands of rostopic."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import msgspec

from rosz.cli import suggest
from rosz.cli.call import Call, new_group
from rosz.cli.console import (
    MessagePrinter,
    print_json,
    print_json_line,
    print_lines,
    print_result,
    until_stopped,
    warn,
)
from rosz.cli.declare import Argument, Json, Option, at_least, per_second
from rosz.errors import NotFoundError, UsageError

if TYPE_CHECKING:
    from rosz.introspect import EchoOptions, Filter, Target, Topic
    from rosz.message import Message
    from rosz.node import Context, MessageInfo, Node
    from rosz.session import Sample
    from rosz.wire import Token

_Stats = TypeVar("_Stats", bound="msgspec.Struct | None")

app = new_group("List, show, measure and publish topics.")

_TOOL = "rostopic"
_WIDEST = 1000
_PERIOD = 1.0
"""Seconds between two reports."""
_DEPTH = 10_000
"""Messages that wait while the terminal is slow."""

_Window = Annotated[int | None, Option("-w --window COUNT", "Number of messages to average.")]
_Condition = Annotated[
    str,
    Option(
        "--filter EXPRESSION",
        "Use only messages for which a Python expression is true; m is the message, topic its"
        " topic.",
    ),
]
_TopicName = Annotated[str, Argument("TOPIC", source=suggest.topics)]
_TopicOrField = Annotated[str, Argument("TOPIC_OR_FIELD", source=suggest.topics)]


class ListOptions(msgspec.Struct, frozen=True, kw_only=True):
    """The options of ``rosz topic list``."""

    verbose: Annotated[
        bool, Option("-v --verbose", "Print types and numbers of publishers and subscribers.")
    ] = False
    publishers: Annotated[bool, Option("-p", "List only published topics.")] = False
    subscribers: Annotated[bool, Option("-s", "List only subscribed topics.")] = False
    types: Annotated[bool, Option("-t --types", "Print types.")] = False
    host: Annotated[bool, Option("--host", "Group topics by host.")] = False
    json: Json = False


@app.command("list")
def list_command(
    call: Call,
    options: ListOptions,
    namespace: Annotated[str, Argument("NAMESPACE", "Lists all if omitted.", suggest.topics)] = "",
) -> int:
    """List topics."""
    if options.publishers and options.subscribers:
        raise UsageError("-p and -s exclude each other: without them both are listed")
    from rosz.introspect import by_host, in_namespace, list_topics

    space = call.resolve(namespace, _TOOL) if namespace else "/"
    survey = call.survey(processes=options.host)
    groups = by_host(survey) if options.host else {"": list(survey.view.tokens)}
    listing = {
        name: [
            topic
            for topic in list_topics(tokens)
            if in_namespace(topic.name, space)
            and (topic.publishers or not options.publishers)
            and (topic.subscribers or not options.subscribers)
        ]
        for name, tokens in groups.items()
    }
    if options.json:
        print_json(listing if options.host else listing[""])
        return int(call.incomplete)
    for name, topics in listing.items():
        if options.host and topics:
            print_lines([f"Host [{name}]:"])
        print_lines(_format_topics(topics, options))
    return int(call.incomplete)


def _format_topics(topics: list[Topic], options: ListOptions) -> list[str]:
    from rosz.introspect import format_topics

    indent = "  " if options.host else ""
    if options.verbose:
        return format_topics(
            topics,
            publishers=not options.subscribers,
            subscribers=not options.publishers,
            indent=indent,
        ).splitlines()
    if options.types:
        return [f"{indent}{topic.name} [{topic.type_text}]" for topic in topics]
    return [indent + topic.name for topic in topics]


@app.command("info")
def info_command(call: Call, topic: _TopicName, *, json: Json = False) -> None:
    """Print the type, the publishers and the subscribers of a topic."""
    from rosz.introspect import entity_row, find_topic, format_topic

    name = call.resolve(topic, _TOOL)
    survey = call.survey(processes=True, dropped=True)
    if not json:
        print_lines([format_topic(survey, name)])
        return
    entry, publishers, subscriptions = find_topic(survey, name)
    print_json(
        {
            "name": entry.name,
            "types": entry.types,
            "publishers": [entity_row(survey, token) for token in publishers],
            "subscribers": [entity_row(survey, token) for token in subscriptions],
        }
    )


@app.command("type")
def type_command(call: Call, topic: _TopicOrField, *, json: Json = False) -> None:
    """Print the type of a topic, or of a field of its messages."""
    from rosz.introspect import find_target, resolve_field, topic_types

    name = resolve_field(topic, lambda each: call.resolve(each, _TOOL))
    view = call.survey().view
    load = call.types.message
    text = find_target(name, topic_types(view), load).type_text(load)
    row = dict(zip(("type", "field", "field_type"), text.split(" "), strict=False))
    print_result([text], row, as_json=json)


@app.command("find")
def find_command(
    call: Call,
    type_name: Annotated[str, Argument("TYPE", source=suggest.topic_types)],
    *,
    json: Json = False,
) -> None:
    """List the topics of a type."""
    from rosz.introspect import list_topics, topics_of_type

    names = topics_of_type(list_topics(call.survey().view.tokens), type_name)
    print_result(names, names, as_json=json)


class EchoFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The options of ``rosz topic echo``."""

    count: Annotated[int | None, Option("-n COUNT", "Stop after this number of messages.")] = None
    once: Annotated[bool, Option("-1 --once", "Stop after one message.")] = False
    plot: Annotated[bool, Option("-p", "Print comma-separated numbers, for plotting.")] = False
    width: Annotated[int | None, Option("-w WIDTH", "Print numbers with a fixed width.")] = None
    condition: _Condition = ""
    nostr: Annotated[bool, Option("--nostr", "Leave strings out.")] = False
    noarr: Annotated[bool, Option("--noarr", "Leave arrays out.")] = False
    clear: Annotated[bool, Option("-c --clear", "Clear the screen before each message.")] = False
    offset: Annotated[bool, Option("--offset", "Print times as seconds from now.")] = False
    raw: Annotated[bool, Option("--raw", "Print the bytes without decoding them.")] = False
    json: Json = False


@app.command("echo")
def echo_command(call: Call, topic: _TopicOrField, flags: EchoFlags) -> None:
    """Print the messages of a topic."""
    from rosz.introspect import EchoOptions, Filter

    at_least("-w", flags.width, 2, "characters", _WIDEST)
    at_least("-n", flags.count, 1, "messages")
    options = EchoOptions(
        plot=flags.plot,
        as_json=flags.json,
        clear=flags.clear,
        width=flags.width or 0,
        offset=flags.offset,
        no_arrays=flags.noarr,
        no_strings=flags.nostr,
        condition=Filter(flags.condition) if flags.condition else None,
    )
    if flags.raw and (flags.plot or flags.condition or flags.nostr or flags.noarr):
        raise UsageError(
            "--raw shows bytes: -p, --filter, --nostr and --noarr need decoded messages"
        )
    from rosz.introspect import find_class

    with call.lasting_node(_TOOL) as node:
        target, token = _wait_for(node, topic)
        cls = None if flags.raw else find_class(node, token)
        to_text = _raw_text(options) if cls is None else _text(node, target, cls, options)

        def show(message: Any, info: MessageInfo) -> str | None:
            if info.lost:
                warn(f"{info.lost} messages are missing here")
            try:
                return to_text(message)
            except LookupError as error:
                warn(f"a message is left out: {error}")
                return None

        printer = MessagePrinter(show, 1 if flags.once else flags.count)
        node.subscription(
            target.topic, cls, printer.receive, queue_size=_DEPTH, raw=flags.raw, with_info=True
        )
        printer.wait(node.context, topic=target.topic)


def _wait_for(node: Node, name: str) -> tuple[Target, Token]:
    """Wait for a topic, or a field, and return it with a token of the topic."""
    from rosz.introspect import resolve_field, wait_for_target

    return wait_for_target(node, resolve_field(name, node.resolve), warn)


def _text(
    node: Node, target: Target, cls: type[Message], options: EchoOptions
) -> Callable[[Any], str | None]:
    from rosz.introspect import Echo

    kind = target.path.type_in(cls)
    return Echo(target.topic, kind, target.path, options, node.now).text


def _raw_text(options: EchoOptions) -> Callable[[Any], str]:
    from rosz.introspect import dump_bytes

    if options.as_json:
        return lambda payload: f'{{"payload":"{payload.hex()}"}}\n'
    return lambda payload: f"{dump_bytes(payload)}\n---\n"


@app.command("hz")
def hz_command(
    call: Call,
    topics: Annotated[list[str], Argument("TOPIC", source=suggest.topics)],
    *,
    window: _Window = None,
    condition: _Condition = "",
    wall_time: Annotated[bool, Option("--wall-time", "Use wall time, not simulated time.")] = False,
    json: Json = False,
) -> None:
    """Print once per second how many messages arrive per second."""
    from rosz.introspect import Filter, RateMeter, format_rate, format_rates

    accepted = Filter(condition) if condition else None
    size = _window(window)
    with call.lasting_node(_TOOL) as node:
        clock = time.monotonic_ns if wall_time else node.clock.steady
        meters: dict[str, RateMeter] = {}
        for name in topics:
            target, token = _wait_for(node, name)
            meter = meters[target.topic] = RateMeter(size)
            _measure(node, token, lambda meter=meter: meter.tick(clock()), accepted)  # type: ignore[misc]
            if not json:
                print_lines([f"subscribed to [{token.name}]"])
        _report(
            node,
            lambda: {name: meter.stats() for name, meter in meters.items()},
            lambda rates: format_rates(rates) if len(rates) > 1 else format_rate(*rates.values()),
            as_json=json,
        )


def _measure(node: Node, token: Token, tick: Callable[[], None], condition: Filter | None) -> None:
    """Call a function for every message of a topic, or for those that meet a condition."""
    from rosz.introspect import find_class

    if condition is None:
        _open_tap(node, token, lambda _: tick())
        return

    def receive(message: Any) -> None:
        if condition.accepts(message, token.name):
            tick()

    cls = find_class(node, token)
    node.subscription(token.name, cls, receive, queue_size=_DEPTH)


@app.command("bw")
def bw_command(
    call: Call, topic: _TopicName, *, window: _Window = None, json: Json = False
) -> None:
    """Print once per second how many bytes arrive per second."""
    from rosz.introspect import BandwidthMeter, format_bandwidth

    meter = BandwidthMeter(_window(window))
    with call.lasting_node(_TOOL) as node:
        _, token = _wait_for(node, topic)
        _open_tap(node, token, lambda sample: meter.add(sample.size, time.monotonic_ns()))
        if not json:
            print_lines([f"subscribed to [{token.name}]"])
        _report(
            node,
            lambda: {token.name: meter.stats(time.monotonic_ns())},
            lambda rates: "".join(format_bandwidth(rate) for rate in rates.values() if rate),
            as_json=json,
        )


@app.command("delay")
def delay_command(
    call: Call, topic: _TopicName, *, window: _Window = None, json: Json = False
) -> None:
    """Print once per second the age of the messages, by the stamp in their header."""
    from rosz.introspect import DelayMeter, find_class, format_delay, read_stamp

    meter = DelayMeter(_window(window))
    with call.lasting_node(_TOOL) as node:
        target, token = _wait_for(node, topic)
        cls = find_class(node, token)
        if not cls._has_header:
            raise NotFoundError(
                f"'{cls._type}' of topic '{target.topic}' has no header, so its age cannot be told"
            )

        def receive(sample: Sample) -> None:
            meter.add(read_stamp(sample.payload, token.type_name), node.now())

        _open_tap(node, token, receive)
        if not json:
            print_lines([f"subscribed to [{token.name}]"])
        _report(
            node,
            lambda: {token.name: meter.stats()},
            lambda delays: format_delay(delays[token.name]) if meter.begun else "",
            as_json=json,
        )


def _window(given: int | None) -> int | None:
    if given is None or given < 0:
        return None  # as in ROS 1's tools
    at_least("-w", given, 2, "messages")  # there is no time between fewer messages
    return given


def _open_tap(node: Node, token: Token, callback: Callable[[Sample], None]) -> None:
    from rosz.introspect import subscribe_samples

    subscribe_samples(node, token.name, token.type_name, token.type_hash, callback)


def _report(
    node: Node,
    stats: Callable[[], dict[str, _Stats]],
    to_text: Callable[[dict[str, _Stats]], str],
    *,
    as_json: bool,
) -> None:
    """Print statistics by topic once per period, until the node is shut down."""
    while not node.is_shutdown:
        node.context.wait_for_shutdown(_PERIOD)
        figures = stats()
        if as_json:
            rows = {name: figure for name, figure in figures.items() if figure is not None}
            for name, row in rows.items():
                print_json_line({"topic": name, **msgspec.structs.asdict(row)})
        elif text := to_text(figures):
            print_lines([text])


class PubOptions(msgspec.Struct, frozen=True, kw_only=True):
    """The options of ``rosz topic pub``."""

    rate: Annotated[float | None, Option("-r --rate HZ", "Publish at this rate.")] = None
    once: Annotated[bool, Option("-1 --once", "Publish one message and stop.")] = False
    latch: Annotated[bool, Option("-l --latch", "Latch also with -f, -r and stdin.")] = False
    file: Annotated[str, Option("-f --file FILE", "Read messages in YAML.", suggest.files)] = ""
    verbose: Annotated[bool, Option("-v", "Print what is published.")] = False
    substitute: Annotated[
        bool, Option("-s --substitute-keywords", "Replace 'now' and 'auto' in each message.")
    ] = False
    use_rostime: Annotated[bool, Option("--use-rostime", "'now' and 'auto' mean ROS time.")] = False


@app.command("pub")
def pub_command(
    call: Call,
    topic: _TopicName,
    type_name: Annotated[str, Argument("TYPE", source=suggest.topic_type)],
    options: PubOptions,
    values: Annotated[
        list[str] | None,
        Argument(
            "VALUE",
            "The message in YAML: one dictionary, or one value per field; read from standard"
            " input if omitted.",
            suggest.pub_values,
        ),
    ] = None,
) -> None:
    """Publish messages."""
    if options.rate is not None and options.once:
        raise UsageError("-r and -1 exclude each other")
    per_second("-r", options.rate)
    if values and options.file:
        raise UsageError("-f gives the messages: no values are taken beside it")
    from rosz.introspect import list_arguments, read_arguments, read_file, read_stream

    arguments = read_arguments(values or ())
    documents: Iterable[Any] | None = read_file(Path(options.file)) if options.file else None
    with until_stopped() as ready, call.context(lasting=not options.once) as context:
        cls = context.types.message(type_name)
        ready()
        if not options.file and not arguments and cls.__slots__:
            if sys.stdin.isatty():
                raise UsageError(f"no values are given; they are: {list_arguments(cls)}")
            documents = read_stream(sys.stdin.buffer, warn)
        _publish(context, topic, cls, options, arguments, documents)


def _publish(
    context: Context,
    topic: str,
    cls: type[Any],
    options: PubOptions,
    arguments: list[Any],
    documents: Iterable[Any] | None,
) -> None:
    from rosz.introspect import DEFAULT_RATE, Sender, SendOptions, listing_arguments
    from rosz.node import Node

    rate, latched = options.rate, options.rate is None or options.latch
    if documents is not None and rate is None and not options.latch and not options.once:
        rate = DEFAULT_RATE
    how = SendOptions(
        rate=rate,
        once=options.once,
        verbose=options.verbose,
        substitute=options.substitute,
        ros_time=options.use_rostime,
    )
    with Node(_TOOL, anonymous=True, context=context) as node:
        publisher = node.publisher(topic, cls, latch=latched, queue_size=100)
        sender = Sender(node, publisher, how, lambda line: print_lines([line]))
        with listing_arguments(cls):
            if documents is None:
                sender.send(arguments)
            else:
                only_one = isinstance(documents, list) and len(documents) == 1
                sender.send_documents(documents, only_one=only_one)
