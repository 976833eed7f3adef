"""rostopic: the topics of the network, their types and nodes."""

from __future__ import annotations

import functools
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any

from rosz.errors import NotFoundError, RoszError, TypeNotFound, UsageError
from rosz.introspect.fields import FieldPath, find_target
from rosz.introspect.survey import Survey
from rosz.introspect.topics import format_topic, list_topics, topics_of_type
from rosz.names import ros1_type
from rosz.ros1.genpy import get_message_class
from rosz.ros1.importer import type_store
from rosz.ros1.rosgraph.masterapi import Master
from rosz.ros1.state import find, ready_context, survey
from rosz.wire import Kind

__all__ = (
    "NAME",
    "ROSTopicException",
    "ROSTopicIOException",
    "find_by_type",
    "get_info_text",
    "get_topic_class",
    "get_topic_list",
    "get_topic_type",
    "msgevalgen",
)

NAME = "rostopic"
_LOOK_SECONDS = 0.1

FieldReader = Callable[[Any], Any]
Found = tuple[str, str, FieldReader | None] | tuple[None, None, None]
"""Type name, topic, and the reader of a field; the reader is None for the whole message."""


class ROSTopicException(Exception):
    """A topic, its type or a message is wrong."""


class ROSTopicIOException(ROSTopicException):
    """The network did not answer."""


def msgevalgen(pattern: str) -> FieldReader | None:
    """Return a function that reads a field of a message.

    Args:
        pattern: Path of the field, such as ``/pose/position/x`` or ``/ranges[0]``.

    Returns:
        A function of a message, which writes to stderr and returns None if there is no such field;
        None if the pattern is empty, or invalid, which is written to stderr.
    """
    try:
        path = FieldPath(pattern)
    except UsageError as error:
        sys.stderr.write(f"{error}\n")
        return None
    return functools.partial(_follow, path, path.steps) if path.steps else None


def _follow(path: FieldPath, steps: Sequence[Any], value: Any) -> Any:
    """Return the field at the end of some steps; None, and a line on stderr, if there is none."""
    for number, step in enumerate(steps, 1):
        try:
            value = getattr(value, step.name)
        except AttributeError:
            sys.stderr.write(f"no field named {step.name} in {path.text}\n")
            return None
        if step.index is None:
            continue
        try:
            value = value[step.index]
        except (LookupError, TypeError) as error:
            sys.stderr.write(f"{error}: {path.text}\n")
            return None
        if isinstance(step.index, slice) and not isinstance(value, str):
            return [_follow(path, steps[number:], one) for one in value]
    return value


def get_topic_type(topic: str, blocking: bool = False) -> Found:
    """Return the type of a topic.

    Args:
        topic: Name of the topic; the path of a field may follow.
        blocking: Whether to wait until the topic has a publisher or subscriber.

    Returns:
        Type name, name of the topic, and the reader of the field; or None three times.
    """
    found = _find(topic)
    if found[0] is None and blocking:
        sys.stderr.write(f"WARNING: topic [{topic}] does not appear to be published yet\n")
        pause = threading.Event()
        while found[0] is None and not ready_context().is_shutdown:
            pause.wait(_LOOK_SECONDS)
            found = _find(topic)
    return found


def _find(topic: str) -> Found:
    try:
        target = find(lambda view: find_target(topic, view.topics(), type_store().message))
    except TypeNotFound:
        raise
    except NotFoundError:
        return None, None, None
    return ros1_type(target.topic, target.type_name), target.topic, msgevalgen(target.path.text)


def get_topic_class(
    topic: str, blocking: bool = False
) -> tuple[type[Any] | None, str | None, FieldReader | None]:
    """Return the message class of a topic; see `get_topic_type`.

    Raises:
        ROSTopicException: The definition of the type is not found.
    """
    type_name, name, read = get_topic_type(topic, blocking)
    if type_name is None:
        return None, None, None
    found = get_message_class(type_name)
    if found is None:
        raise ROSTopicException(
            f"Cannot load message class for [{type_name}]. Is its package on ROSZ_PACKAGE_PATH?"
        )
    return found, name, read


def find_by_type(topic_type: str) -> list[str]:
    """Return the names of the topics of a type."""
    return topics_of_type(list_topics(survey().view.tokens), topic_type)


def get_topic_list(master: Master | None = None) -> tuple[list[Any], list[Any]]:  # noqa: ARG001
    """Return the topics that have publishers, and those that have subscribers.

    Args:
        master: Ignored.

    Returns:
        Two lists of topics, each with its type and the names of its nodes.
    """
    found = survey()
    return _with_nodes(found, Kind.PUBLISHER), _with_nodes(found, Kind.SUBSCRIPTION)


def _with_nodes(found: Survey, kind: Kind) -> list[Any]:
    topics: dict[str, tuple[str, dict[str, None]]] = {}
    for token in found.view.entities(kind):
        _, nodes = topics.setdefault(token.name, (ros1_type(token.name, token.type_name), {}))
        nodes[token.node_name] = None
    return [[name, type_name, list(nodes)] for name, (type_name, nodes) in topics.items()]


def get_info_text(topic: str) -> str:
    """Return the text of ``rostopic info``.

    Raises:
        ROSTopicException: The topic has no publishers and no subscribers.
    """
    try:
        return format_topic(survey(), topic)
    except RoszError as error:
        raise ROSTopicException(f"Unknown topic {topic}") from error
