"""Topics: listing and describing them as rostopic does."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from rosz.errors import NotFoundError, near_miss
from rosz.introspect.survey import Survey
from rosz.names import is_of_action, ros1_type, short_type
from rosz.wire import Kind, Token


class Topic(msgspec.Struct, frozen=True):
    """A topic.

    Attributes:
        name: Full name of the topic.
        types: Names of its types, as ROS 1 spells them; more than one is a fault.
        publishers: Full name of the node of each publisher.
        subscribers: Full name of the node of each subscription.
    """

    name: str
    types: tuple[str, ...]
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]

    @property
    def type_text(self) -> str:
        """The types as one text."""
        return ", ".join(self.types)


def list_topics(tokens: Iterable[Token]) -> list[Topic]:
    """Return the topics of some tokens, sorted by name; those of actions of ROS 2 are left out."""
    topics: dict[str, tuple[set[str], list[str], list[str]]] = {}
    for token in tokens:
        if token.kind not in {Kind.PUBLISHER, Kind.SUBSCRIPTION} or is_of_action(token.name):
            continue
        types, publishers, subscribers = topics.setdefault(token.name, (set(), [], []))
        types.add(ros1_type(token.name, token.type_name))
        side = publishers if token.kind is Kind.PUBLISHER else subscribers
        side.append(token.node_name)
    return [
        Topic(name, tuple(sorted(types)), tuple(sorted(pubs)), tuple(sorted(subs)))
        for name, (types, pubs, subs) in sorted(topics.items())
    ]


def in_namespace(name: str, namespace: str) -> bool:
    """Return whether a global name is a namespace, or is in it; all names are in ``/``."""
    return name == namespace or name.startswith(f"{namespace.rstrip('/')}/")


def by_host(survey: Survey) -> dict[str, list[Token]]:
    """Return the tokens of the nodes of each host, by host name."""
    hosts: dict[str, list[Token]] = {}
    for token in survey.view.tokens:
        hosts.setdefault(survey.host(token), []).append(token)
    return dict(sorted(hosts.items()))


def topics_of_type(topics: Iterable[Topic], type_name: str) -> list[str]:
    """Return the names of the topics of a type, in ROS 1's or ROS 2's spelling."""
    wanted = short_type(type_name)
    return [topic.name for topic in topics if wanted in topic.types]


def format_topics(
    topics: Iterable[Topic], *, publishers: bool = True, subscribers: bool = True, indent: str = ""
) -> str:
    """Return the text of ``rostopic list -v``.

    Args:
        topics: The topics.
        publishers: Whether to list published topics.
        subscribers: Whether to list subscribed topics.
        indent: Beginning of every line.
    """
    listing = list(topics)
    lines: list[str] = []
    if publishers:
        lines += ["", f"{indent}Published topics:"]
        lines += (
            _counted(indent, t, len(t.publishers), "publisher") for t in listing if t.publishers
        )
    if subscribers:
        lines += [indent, f"{indent}Subscribed topics:"]
        lines += (
            _counted(indent, t, len(t.subscribers), "subscriber") for t in listing if t.subscribers
        )
    return "\n".join([*lines, "", ""])


def _counted(indent: str, topic: Topic, count: int, what: str) -> str:
    return f"{indent} * {topic.name} [{topic.type_text}] {count} {what}{'s' * (count > 1)}"


def find_topic(survey: Survey, name: str) -> tuple[Topic, list[Token], list[Token]]:
    """Return a topic with its publishers and its subscriptions.

    Raises:
        NotFoundError: No node publishes it or subscribes to it.
    """
    publishers = survey.view.publishers(name)
    subscriptions = survey.view.subscriptions(name)
    if not publishers and not subscriptions:
        raise NotFoundError(f"unknown topic '{name}'{near_miss(name, survey.view.topics())}")
    return list_topics((*publishers, *subscriptions))[0], publishers, subscriptions


def format_topic(survey: Survey, name: str) -> str:
    """Return the text of ``rostopic info`` about a topic.

    Raises:
        NotFoundError: No node publishes it or subscribes to it.
    """
    topic, publishers, subscriptions = find_topic(survey, name)
    mixed = len(topic.types) > 1
    lines = [f"Type: {topic.type_text}", ""]
    for title, tokens in (("Publishers", publishers), ("Subscribers", subscriptions)):
        lines.append(f"{title}: " if tokens else f"{title}: None")
        for token in tokens:
            type_text = f" [{ros1_type(token.name, token.type_name)}]" if mixed else ""
            count = survey.dropped.get((token.zid, token.entity_id), 0)
            dropped = f", {count} dropped" if count else ""
            lines.append(f" * {token.node_name} ({survey.address(token)}){type_text}{dropped}")
        lines.append("")
    return "\n".join([*lines, ""])


def entity_row(survey: Survey, token: Token) -> dict[str, str | int]:
    """Return a publisher or subscription as values for JSON."""
    row: dict[str, str | int] = {
        "node": token.node_name,
        "type": ros1_type(token.name, token.type_name),
    }
    process = survey.process(token)
    if process is not None:
        row |= {"host": process.host, "pid": process.pid}
    dropped = survey.dropped.get((token.zid, token.entity_id), 0)
    return row | {"session": token.zid, "hash": token.type_hash, "dropped": dropped}
