"""Topics and the fields of what is sent on them."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import Any

from rosz.errors import NotFoundError, RoszError, TypeNotFound
from rosz.introspect.fields import FieldPath, find_target
from rosz.introspect.survey import Survey
from rosz.introspect.topics import describe, find, list_topics
from rosz.names import short_type
from rosz.ros1.genpy.message import get_message_class
from rosz.ros1.importer import type_store
from rosz.ros1.rosgraph import Master, live
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

Reader = Callable[[Any], Any]
Found = tuple[str, str, Reader | None] | tuple[None, None, None]
"""Type, topic, and what reads the field of a message that is meant; None for the message itself."""


class ROSTopicException(Exception):
    """Something wrong with a topic or what is sent on it."""


class ROSTopicIOException(ROSTopicException):
    """The network did not answer."""


def msgevalgen(pattern: str) -> Reader | None:
    """Return what reads a field of messages.

    Args:
        pattern: Such as ``/pose/position/x`` or ``/ranges[0]``.

    Returns:
        A function of a message, which gives None where there is no such field; None for no field.

    Raises:
        UsageError: It is no such pattern.
    """
    if not pattern or pattern == "/":
        return None
    path = FieldPath(pattern)

    def read(message: Any) -> Any:
        try:
            return path.read(message)
        except (AttributeError, LookupError, TypeError):
            return None

    return read


def get_topic_type(topic: str, blocking: bool = False) -> Found:
    """Return the type of a topic.

    Args:
        topic: Its name, perhaps with a field behind it.
        blocking: Whether to wait until somebody publishes or subscribes to it.

    Returns:
        Type, name of the topic, and what reads the field; or None three times.
    """
    found = _find(topic)
    if found[0] is None and blocking:
        sys.stderr.write(f"WARNING: topic [{topic}] does not appear to be published yet\n")
        pause = threading.Event()
        while found[0] is None and not live.context().is_shutdown:
            pause.wait(_LOOK_SECONDS)
            found = _find(topic)
    return found


def _find(topic: str) -> Found:
    try:
        target = find_target(topic, live.survey().view.topics(), type_store().message)
    except TypeNotFound:
        raise
    except NotFoundError:
        return None, None, None
    return short_type(target.type_name), target.topic, msgevalgen(target.path.text)


def get_topic_class(
    topic: str, blocking: bool = False
) -> tuple[type[Any] | None, str | None, Reader | None]:
    """Return the class of the messages of a topic; see `get_topic_type`.

    Raises:
        ROSTopicException: Its type is not known here.
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
    return find(list_topics(live.survey().view.tokens), topic_type)


def get_topic_list(master: Master | None = None) -> tuple[list[Any], list[Any]]:  # noqa: ARG001
    """Return what is published and what is subscribed to.

    Args:
        master: Not used.

    Returns:
        Twice a list of topic, type and names of nodes.
    """
    found = live.survey()
    return _ends(found, Kind.PUBLISHER), _ends(found, Kind.SUBSCRIPTION)


def _ends(found: Survey, kind: Kind) -> list[Any]:
    topics: dict[str, tuple[str, dict[str, None]]] = {}
    for token in found.view.entities(kind):
        _, nodes = topics.setdefault(token.name, (short_type(token.type_name), {}))
        nodes[token.node_name] = None
    return [[name, type_name, list(nodes)] for name, (type_name, nodes) in topics.items()]


def get_info_text(topic: str) -> str:
    """Return what ``rostopic info`` says about a topic.

    Raises:
        ROSTopicException: Nobody publishes it or subscribes to it.
    """
    try:
        return describe(live.survey(), topic)
    except RoszError as error:
        raise ROSTopicException(f"Unknown topic {topic}") from error
