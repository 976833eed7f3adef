"""Topics as rostopic lists and describes them."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from rosz.errors import NotFoundError, near_miss
from rosz.introspect.survey import Survey
from rosz.names import short_type
from rosz.wire import Kind, Token

__all__ = (
    "Topic",
    "by_host",
    "describe",
    "describe_list",
    "end_row",
    "find",
    "in_namespace",
    "info",
    "list_topics",
)


class Topic(msgspec.Struct, frozen=True):
    """A topic.

    Attributes:
        name: Its name.
        types: Names of its types, as ROS 1 spells them; more than one is a fault of somebody.
        publishers: Full names of the nodes that publish, one per publisher.
        subscribers: Full names of the nodes that subscribe, one per subscription.
    """

    name: str
    types: tuple[str, ...]
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]

    @property
    def type_text(self) -> str:
        """Its type, or its types."""
        return ", ".join(self.types)


def list_topics(tokens: Iterable[Token]) -> list[Topic]:
    """Return the topics among some tokens, sorted by name."""
    ends: dict[str, tuple[set[str], list[str], list[str]]] = {}
    for token in tokens:
        if token.kind not in {Kind.PUBLISHER, Kind.SUBSCRIPTION}:
            continue
        types, publishers, subscribers = ends.setdefault(token.name, (set(), [], []))
        types.add(short_type(token.type_name))
        side = publishers if token.kind is Kind.PUBLISHER else subscribers
        side.append(token.node_name)
    return [
        Topic(name, tuple(sorted(types)), tuple(sorted(pubs)), tuple(sorted(subs)))
        for name, (types, pubs, subs) in sorted(ends.items())
    ]


def in_namespace(name: str, namespace: str) -> bool:
    """Tell whether a global name is a namespace, or lies in it; all names lie in ``/``."""
    return name == namespace or name.startswith(f"{namespace.rstrip('/')}/")


def by_host(survey: Survey) -> dict[str, list[Token]]:
    """Return the tokens of every host, by its name."""
    found: dict[str, list[Token]] = {}
    for token in survey.view.tokens:
        found.setdefault(survey.host(token), []).append(token)
    return dict(sorted(found.items()))


def find(topics: Iterable[Topic], type_name: str) -> list[str]:
    """Return the names of the topics of a type, which may be spelled as in ROS 1 or 2."""
    wanted = short_type(type_name)
    return [topic.name for topic in topics if wanted in topic.types]


def describe_list(
    topics: Iterable[Topic], *, publishers: bool = True, subscribers: bool = True, indent: str = ""
) -> str:
    """Return what ``rostopic list -v`` prints.

    Args:
        topics: The topics.
        publishers: Whether to tell what is published.
        subscribers: Whether to tell what is subscribed to.
        indent: What every line begins with.
    """
    known = list(topics)
    lines: list[str] = []
    if publishers:
        lines += ["", f"{indent}Published topics:"]
        lines += (
            _counted(indent, t, len(t.publishers), "publisher") for t in known if t.publishers
        )
    if subscribers:
        lines += [indent, f"{indent}Subscribed topics:"]
        lines += (
            _counted(indent, t, len(t.subscribers), "subscriber") for t in known if t.subscribers
        )
    return "\n".join([*lines, "", ""])


def _counted(indent: str, topic: Topic, count: int, what: str) -> str:
    return f"{indent} * {topic.name} [{topic.type_text}] {count} {what}{'s' * (count > 1)}"


def info(survey: Survey, name: str) -> tuple[Topic, list[Token], list[Token]]:
    """Return a topic with its publishers and its subscriptions.

    Raises:
        NotFoundError: Nobody publishes it or subscribes to it.
    """
    publishers = survey.view.publishers(name)
    subscriptions = survey.view.subscriptions(name)
    if not publishers and not subscriptions:
        raise NotFoundError(f"unknown topic '{name}'{near_miss(name, survey.view.topics())}")
    return list_topics((*publishers, *subscriptions))[0], publishers, subscriptions


def describe(survey: Survey, name: str) -> str:
    """Return what ``rostopic info`` prints about a topic.

    Raises:
        NotFoundError: Nobody publishes it or subscribes to it.
    """
    topic, publishers, subscriptions = info(survey, name)
    mixed = len(topic.types) > 1
    lines = [f"Type: {topic.type_text}", ""]
    for title, tokens in (("Publishers", publishers), ("Subscribers", subscriptions)):
        lines.append(f"{title}: " if tokens else f"{title}: None")
        for token in tokens:
            type_text = f" [{short_type(token.type_name)}]" if mixed else ""
            lines.append(f" * {token.node_name} ({survey.address(token)}){type_text}")
        lines.append("")
    return "\n".join([*lines, ""])


def end_row(survey: Survey, token: Token) -> dict[str, str | int]:
    """Return one end of a topic as plain values."""
    row: dict[str, str | int] = {"node": token.node_name, "type": short_type(token.type_name)}
    process = survey.process(token)
    if process is not None:
        row |= {"host": process.host, "pid": process.pid}
    return row | {"session": token.zid, "hash": token.type_hash}
