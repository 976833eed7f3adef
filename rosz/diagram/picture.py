"""Boxes and arrows of the graph: nodes, topics and their connections.

The options that select them are those of rqt_graph.

A picture is a value: boxes and arrows. It is made from the tokens of a domain by options, and
`rosz.diagram.layers` gives it a layout.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Literal, TypeAlias

import msgspec

from rosz.errors import UsageError
from rosz.names import is_of_action, namespace, short_type
from rosz.wire import Kind, Token

Content: TypeAlias = Literal["nodes", "active", "all"]
CONTENTS: tuple[Content, ...] = ("nodes", "active", "all")
"""Nodes only; nodes and topics that connect some; nodes and all topics."""

_TF = frozenset({"/tf", "/tf_static"})
_DEBUG_TOPICS = frozenset({"/rosout", "/rosout_agg", "/clock", "/parameter_events"})
_DEBUG_NODES = re.compile(r"/(rosout|rqt\w*|rviz\w*|rosz_web\w*|ros(topic|bag|service|node)_\w+)")
_PARAMETER_SERVICES = (
    "/set_parameters",
    "/get_parameters",
    "/parameter_updates",
    "/parameter_descriptions",
)


class PictureOptions(msgspec.Struct, frozen=True, kw_only=True):
    """Options of a picture; the defaults are those of rqt_graph.

    Attributes:
        content: ``nodes``, ``active`` for topics with both ends too, or ``all`` topics.
        nodes: Pattern that the names of nodes match, with ``*`` and ``?``; several by commas.
        topics: The same for topics.
        group: Number of leading names of a namespace that are drawn as one group; 0 for none.
        hide_debug: Whether to leave out ``/rosout``, ``/clock`` and tools.
        hide_tf: Whether to leave out ``/tf`` and ``/tf_static``.
        hide_parameters: Whether to leave out the topics of dynamic_reconfigure.
        hide_dead_sinks: Whether to leave out topics that nobody publishes.
        hide_leaves: Whether to leave out topics that nobody subscribes to.
        hide_unconnected: Whether to leave out nodes without an arrow.
    """

    content: Content = "nodes"
    nodes: str = ""
    topics: str = ""
    group: int = 0
    hide_debug: bool = True
    hide_tf: bool = False
    hide_parameters: bool = True
    hide_dead_sinks: bool = False
    hide_leaves: bool = False
    hide_unconnected: bool = False


class Box(msgspec.Struct, frozen=True):
    """A node or a topic.

    Attributes:
        key: ``node:`` or ``topic:`` and the name.
        name: Full name.
        kind: ``node`` or ``topic``.
        detail: The type of a topic.
        group: Namespace that it is drawn in; empty for none.
    """

    key: str
    name: str
    kind: Literal["node", "topic"]
    detail: str = ""
    group: str = ""


class Arrow(msgspec.Struct, frozen=True):
    """An arrow from one box to another.

    Attributes:
        start: Key of the box that it begins at.
        end: Key of the box that it ends at.
        topics: The topics that flow.
    """

    start: str
    end: str
    topics: tuple[str, ...]


class Picture(msgspec.Struct, frozen=True):
    """Boxes and arrows.

    Attributes:
        boxes: The boxes, sorted by key.
        arrows: The arrows, sorted by their ends.
    """

    boxes: tuple[Box, ...] = ()
    arrows: tuple[Arrow, ...] = ()


class _Topic:
    """A topic with the nodes at its ends."""

    def __init__(self) -> None:
        self.types: set[str] = set()
        self.publishers: set[str] = set()
        self.subscribers: set[str] = set()


def make_picture(tokens: Iterable[Token], options: PictureOptions) -> Picture:
    """Return the picture of nodes and topics.

    Args:
        tokens: Live tokens.
        options: Choice of nodes and topics.

    Raises:
        UsageError: An option is not valid.
    """
    if options.content not in CONTENTS:
        raise UsageError(f"'{options.content}' is not shown; expected {', '.join(CONTENTS)}")
    nodes, topics = _collect(tokens, options)
    arrows = (_node_arrows if options.content == "nodes" else _topic_arrows)(topics, nodes)
    boxes = [Box(f"node:{name}", name, "node", group=_group(name, options.group)) for name in nodes]
    ends = {end for arrow in arrows for end in (arrow.start, arrow.end)}
    if options.hide_unconnected:
        boxes = [box for box in boxes if box.key in ends]
    for name, topic in topics.items():
        if f"topic:{name}" in ends:
            types, group = ", ".join(sorted(topic.types)), _group(name, options.group)
            boxes.append(Box(f"topic:{name}", name, "topic", types, group))
    return Picture(
        tuple(sorted(boxes, key=lambda box: box.key)),
        tuple(sorted(arrows, key=lambda arrow: (arrow.start, arrow.end))),
    )


def _collect(
    tokens: Iterable[Token], options: PictureOptions
) -> tuple[set[str], dict[str, _Topic]]:
    shows_node, shows_topic = _Chooser(options.nodes), _Chooser(options.topics)
    nodes: set[str] = set()
    topics: dict[str, _Topic] = {}
    for token in tokens:
        name = token.node_name
        if options.hide_debug and _DEBUG_NODES.fullmatch(name):
            continue
        if shows_node(name):
            nodes.add(name)
        if token.kind in {Kind.PUBLISHER, Kind.SUBSCRIPTION} and not is_of_action(token.name):
            topic = topics.setdefault(token.name, _Topic())
            topic.types.add(short_type(token.type_name))
            ends = topic.publishers if token.kind is Kind.PUBLISHER else topic.subscribers
            ends.add(name)
    return nodes, {
        name: topic
        for name, topic in topics.items()
        if shows_topic(name) and _is_shown(name, topic, options)
    }


def _is_shown(name: str, topic: _Topic, options: PictureOptions) -> bool:
    if options.hide_debug and name in _DEBUG_TOPICS:
        return False
    if options.hide_tf and name in _TF:
        return False
    if options.hide_parameters and name.endswith(_PARAMETER_SERVICES):
        return False
    if not topic.publishers and (options.hide_dead_sinks or options.content == "active"):
        return False
    return bool(topic.subscribers) or not (options.hide_leaves or options.content == "active")


def _node_arrows(topics: dict[str, _Topic], nodes: set[str]) -> list[Arrow]:
    topics_of: dict[tuple[str, str], list[str]] = {}
    for name, topic in sorted(topics.items()):
        for start in topic.publishers & nodes:
            for end in topic.subscribers & nodes:
                topics_of.setdefault((start, end), []).append(name)
    return [
        Arrow(f"node:{start}", f"node:{end}", tuple(names))
        for (start, end), names in topics_of.items()
    ]


def _topic_arrows(topics: dict[str, _Topic], nodes: set[str]) -> list[Arrow]:
    arrows: list[Arrow] = []
    for name, topic in topics.items():
        key = f"topic:{name}"
        arrows += [Arrow(f"node:{node}", key, (name,)) for node in topic.publishers & nodes]
        arrows += [Arrow(key, f"node:{node}", (name,)) for node in topic.subscribers & nodes]
    return arrows


def _group(name: str, depth: int) -> str:
    parts = namespace(name).strip("/").split("/")[:depth]
    return "/" + "/".join(parts) if parts != [""] and parts else ""


class _Chooser:
    """A choice of names by patterns; those that begin with ``-`` exclude."""

    def __init__(self, text: str) -> None:
        words = [word.strip() for word in text.split(",") if word.strip()]
        self._wanted = [_pattern(word) for word in words if not word.startswith("-")]
        self._unwanted = [_pattern(word[1:]) for word in words if word.startswith("-")]

    def __call__(self, name: str) -> bool:
        if any(pattern.fullmatch(name) for pattern in self._unwanted):
            return False
        return not self._wanted or any(pattern.fullmatch(name) for pattern in self._wanted)


def _pattern(word: str) -> re.Pattern[str]:
    """Return the expression for a name, with ``*`` and ``?``; all below a name match it too."""
    return re.compile("".join(_translated(word)) + "(/.*)?")


def _translated(word: str) -> Iterator[str]:
    for letter in word.rstrip("/"):
        yield ".*" if letter == "*" else "[^/]" if letter == "?" else re.escape(letter)
