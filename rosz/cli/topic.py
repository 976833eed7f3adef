"""``rosz topic``: what rostopic does."""

from __future__ import annotations

from typing import Annotated

from rosz.cli.bounds import at_least, per_second
from rosz.cli.declare import Argument, Context, Option
from rosz.cli.group import call_of, new_group, print_json, print_lines
from rosz.errors import UsageError

__all__ = ("app",)

app = new_group("List, show, measure and publish topics.")

_WIDEST = 1000

_Json = Annotated[bool, Option("--json", help="As JSON.")]
_Window = Annotated[
    int | None, Option("-w", "--window", metavar="COUNT", help="Messages to average over.")
]
_Condition = Annotated[
    str,
    Option("--filter", metavar="EXPRESSION", help="Python; m is the message, topic its topic."),
]
_TopicName = Annotated[str, Argument(metavar="TOPIC")]


@app.command("list")
def list_command(
    context: Context,
    namespace: Annotated[str, Argument(metavar="[NAMESPACE]")] = "",
    *,
    verbose: Annotated[
        bool, Option("-v", "--verbose", help="With types and numbers of ends.")
    ] = False,
    publishers: Annotated[bool, Option("-p", help="Only what is published.")] = False,
    subscribers: Annotated[bool, Option("-s", help="Only what is subscribed to.")] = False,
    types: Annotated[bool, Option("-t", "--types", help="With types.")] = False,
    host: Annotated[bool, Option("--host", help="Grouped by host.")] = False,
    json: _Json = False,
) -> None:
    """List topics."""
    if publishers and subscribers:
        raise UsageError("-p and -s exclude each other: without them both are listed")
    from rosz.introspect import topics as library

    call = call_of(context)
    space = call.resolve(namespace, "rostopic") if namespace else "/"
    survey = call.survey(processes=host)
    groups = library.by_host(survey) if host else {"": list(survey.view.tokens)}
    found = {
        name: [
            topic
            for topic in library.list_topics(tokens)
            if library.in_namespace(topic.name, space)
            and (topic.publishers or not publishers)
            and (topic.subscribers or not subscribers)
        ]
        for name, tokens in groups.items()
    }
    if json:
        print_json(found if host else found[""])
        return
    for name, topics in found.items():
        indent = "  " if host else ""
        if host and topics:
            print_lines([f"Host [{name}]:"])
        if verbose:
            print_lines(
                library.format_topics(
                    topics,
                    publishers=not subscribers,
                    subscribers=not publishers,
                    indent=indent,
                ).splitlines()
            )
        elif types:
            print_lines(f"{indent}{topic.name} [{topic.type_text}]" for topic in topics)
        else:
            print_lines(indent + topic.name for topic in topics)


@app.command("info")
def info_command(context: Context, topic: _TopicName, *, json: _Json = False) -> None:
    """Tell the type of a topic, who publishes it and who subscribes to it."""
    from rosz.introspect import topics as library

    call = call_of(context)
    name = call.resolve(topic, "rostopic")
    survey = call.survey(processes=True)
    if not json:
        print_lines([library.format_topic(survey, name)])
        return
    entry, publishers, subscriptions = library.find_topic(survey, name)
    print_json(
        {
            "name": entry.name,
            "types": entry.types,
            "publishers": [library.entity_row(survey, token) for token in publishers],
            "subscribers": [library.entity_row(survey, token) for token in subscriptions],
        }
    )


@app.command("type")
def type_command(
    context: Context,
    topic: Annotated[str, Argument(metavar="TOPIC_OR_FIELD")],
    *,
    json: _Json = False,
) -> None:
    """Print the type of a topic, or of a field of it."""
    from rosz.introspect.fields import find_target
    from rosz.introspect.subscribe import resolve_field, topic_types

    call = call_of(context)
    name = resolve_field(topic, lambda each: call.resolve(each, "rostopic"))
    view = call.survey().view
    load = call.types.message
    text = find_target(name, topic_types(view), load).type_text(load)
    if json:
        print_json(dict(zip(("type", "field", "field_type"), text.split(" "), strict=False)))
    else:
        print_lines([text])


@app.command("find")
def find_command(
    context: Context,
    type_name: Annotated[str, Argument(metavar="TYPE")],
    *,
    json: _Json = False,
) -> None:
    """List the topics of a type."""
    from rosz.introspect import topics as library

    found = library.topics_of_type(
        library.list_topics(call_of(context).survey().view.tokens), type_name
    )
    if json:
        print_json(found)
    else:
        print_lines(found)


@app.command("echo")
def echo_command(
    context: Context,
    topic: Annotated[str, Argument(metavar="TOPIC_OR_FIELD")],
    *,
    count: Annotated[
        int | None, Option("-n", metavar="COUNT", help="End after so many messages.")
    ] = None,
    once: Annotated[bool, Option("-1", "--once", help="End after one message.")] = False,
    plot: Annotated[bool, Option("-p", help="As numbers with commas, for plotting.")] = False,
    width: Annotated[
        int | None, Option("-w", metavar="WIDTH", help="Fixed width of numbers.")
    ] = None,
    condition: _Condition = "",
    nostr: Annotated[bool, Option("--nostr", help="Leave out texts.")] = False,
    noarr: Annotated[bool, Option("--noarr", help="Leave out arrays.")] = False,
    clear: Annotated[bool, Option("-c", "--clear", help="Clear the screen before each.")] = False,
    offset: Annotated[bool, Option("--offset", help="Show times as seconds from now.")] = False,
    raw: Annotated[bool, Option("--raw", help="Show the bytes, not decoded.")] = False,
    json: _Json = False,
) -> None:
    """Print the messages of a topic."""
    from rosz.cli.topic_follow import echo
    from rosz.introspect.echo import EchoOptions
    from rosz.introspect.fields import Filter

    if width is not None:
        at_least("-w", width, 2, "characters", _WIDEST)
    if count is not None:
        at_least("-n", count, 1, "messages")
    options = EchoOptions(
        plot=plot,
        as_json=json,
        clear=clear,
        width=width or 0,
        offset=offset,
        no_arrays=noarr,
        no_strings=nostr,
        condition=Filter(condition) if condition else None,
    )
    if raw and (plot or condition or nostr or noarr):
        raise UsageError(
            "--raw shows bytes: -p, --filter, --nostr and --noarr need decoded messages"
        )
    echo(call_of(context), topic, options, count=1 if once else count, raw=raw)


@app.command("hz")
def hz_command(
    context: Context,
    topics: Annotated[list[str], Argument(metavar="TOPIC...")],
    *,
    window: _Window = None,
    condition: _Condition = "",
    wall_time: Annotated[
        bool, Option("--wall-time", help="Measure wall time, not simulated time.")
    ] = False,
    json: _Json = False,
) -> None:
    """Print every second how many messages come."""
    from rosz.cli.topic_follow import hz
    from rosz.introspect.fields import Filter

    chosen = Filter(condition) if condition else None
    hz(
        call_of(context),
        topics,
        window=_window(window),
        condition=chosen,
        wall_time=wall_time,
        as_json=json,
    )


@app.command("bw")
def bw_command(
    context: Context, topic: _TopicName, *, window: _Window = None, json: _Json = False
) -> None:
    """Print every second how many bytes come."""
    from rosz.cli.topic_follow import bw

    bw(call_of(context), topic, window=_window(window), as_json=json)


@app.command("delay")
def delay_command(
    context: Context, topic: _TopicName, *, window: _Window = None, json: _Json = False
) -> None:
    """Print every second how old messages are, by the stamp in their header."""
    from rosz.cli.topic_follow import delay

    delay(call_of(context), topic, window=_window(window), as_json=json)


def _window(given: int | None) -> int | None:
    if given is None or given < 0:
        return None  # as for ROS 1's tools
    return at_least("-w", given, 2, "messages")  # there is no time between fewer


@app.command("pub")
def pub_command(
    context: Context,
    topic: _TopicName,
    type_name: Annotated[str, Argument(metavar="TYPE")],
    values: Annotated[
        list[str] | None,
        Argument(metavar="[VALUE]...", help="YAML: one dictionary, or a value per field."),
    ] = None,
    *,
    rate: Annotated[
        float | None, Option("-r", "--rate", metavar="HZ", help="Send so often.")
    ] = None,
    once: Annotated[bool, Option("-1", "--once", help="Send one message and end.")] = False,
    latch: Annotated[
        bool, Option("-l", "--latch", help="Latch also with -f, -r and standard input.")
    ] = False,
    file: Annotated[
        str, Option("-f", "--file", metavar="FILE", help="Read messages from a YAML file.")
    ] = "",
    verbose: Annotated[bool, Option("-v", help="Print what is sent.")] = False,
    substitute: Annotated[
        bool,
        Option("-s", "--substitute-keywords", help="Fill in now and auto for each message."),
    ] = False,
    use_rostime: Annotated[
        bool, Option("--use-rostime", help="Take now and auto from ROS time.")
    ] = False,
) -> None:
    """Publish messages."""
    if rate is not None and once:
        raise UsageError("-r and -1 exclude each other")
    if rate is not None:
        per_second("-r", rate)
    if values and file:
        raise UsageError("-f gives the messages: no values are taken beside it")
    from rosz.cli.topic_pub import pub
    from rosz.introspect.publish import SendOptions

    options = SendOptions(
        rate=rate, once=once, verbose=verbose, substitute=substitute, ros_time=use_rostime
    )
    pub(call_of(context), topic, type_name, values or (), options, latch=latch, file=file)
