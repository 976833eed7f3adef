"""Finding the topic that a command is to follow, and waiting for it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from rosz import names
from rosz.errors import DefinitionError, InvalidName, NotFoundError
from rosz.introspect.fields import Target, find_target
from rosz.introspect.survey import ros1_type
from rosz.message import Message
from rosz.wire import NO_HASH, Token

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.node import Context

__all__ = ("find_class", "find_token", "resolve_field", "topic_types", "wait_for_target")


def resolve_field(name: str, resolve: Callable[[str], str]) -> str:
    """Resolve the name of a topic, or of a field of one with its indices.

    Args:
        name: As a person wrote it.
        resolve: Resolves a name.

    Raises:
        InvalidName: It is not legal.
    """
    head, bracket, tail = name.partition("[")
    if not head:
        raise InvalidName(name, "it is empty; expected the name of a topic")
    return resolve(names.check(head)) + bracket + tail


def topic_types(view: View) -> Mapping[str, Sequence[str]]:
    """Return the types of all topics, what is published before what is only subscribed to."""
    found: dict[str, Sequence[str]] = {}
    for name, types in view.topics().items():
        published = sorted({token.type_name for token in view.publishers(name)})
        found[name] = [*published, *(each for each in types if each not in published)]
    return found


def wait_for_target(context: Context, name: str, warn: Callable[[str], object]) -> Target:
    """Find the topic that a name means, or the topic and the field; wait while there is none.

    Args:
        context: Where to look.
        name: Global name, fields and indices included.
        warn: Told, in a sentence, if it has to wait.

    Raises:
        ClosedError: The context was shut down meanwhile.
    """
    load = context.types.message
    try:
        return find_target(name, topic_types(context.graph.refresh()), load)
    except NotFoundError as error:
        warn(f"topic [{name}] does not appear to be published yet ({error})")
    found: list[Target] = []

    def look(view: View) -> bool:
        try:
            found.append(find_target(name, topic_types(view), load))
        except NotFoundError:
            return False
        return True

    context.graph.wait_for(look, threading.TIMEOUT_MAX / 2, f"topic '{name}'")
    return found[-1]


def find_token(view: View, topic: str, type_name: str) -> Token:
    """Return a publisher of a topic, or, where there is none, a subscription.

    Raises:
        NotFoundError: It has neither.
    """
    for token in (*view.publishers(topic), *view.subscriptions(topic)):
        if token.type_name == type_name:
            return token
    raise NotFoundError(f"topic '{topic}' is gone")


def find_class(context: Context, token: Token) -> type[Message]:
    """Return the class of the messages that an endpoint sends or expects.

    Raises:
        TypeNotFound: There is no such type here.
        DefinitionError: Its definition here is another one than there, or not well-formed.
    """
    cls = context.types.message(token.type_name)
    if token.type_hash not in {cls._type_hash, NO_HASH}:
        raise DefinitionError(
            f"'{ros1_type(token.type_name)}' is defined otherwise at node {token.node_name}: its"
            f" hash there is {token.type_hash}, here it is {cls._type_hash}; put the same"
            " definition on ROSZ_PACKAGE_PATH here, or look with --raw",
            token.name,
        )
    return cls
