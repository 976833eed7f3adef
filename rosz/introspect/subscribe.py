"""Subscribing to a topic of any type: find it, wait for it, load its class, receive its samples."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from rosz import names
from rosz.errors import (
    DefinitionError,
    InvalidName,
    NotFoundError,
    ServiceError,
    TypeNotFound,
    WaitTimeout,
)
from rosz.graph import View
from rosz.introspect.fields import Target, find_target
from rosz.message import Message
from rosz.node import Entity, Node
from rosz.qos import DEFAULT
from rosz.session import Sample
from rosz.wire import NO_HASH, Kind, Token, entity_key

_DEFINITION_TIMEOUT = 3.0


def resolve_field(name: str, resolve: Callable[[str], str]) -> str:
    """Return the global name of a topic, or of a field of one with its indices.

    Args:
        name: Name as a person wrote it.
        resolve: Function that resolves a name.

    Raises:
        InvalidName: The name is not legal.
    """
    head, bracket, tail = name.partition("[")
    if not head:
        raise InvalidName(name, "it is empty; expected the name of a topic")
    return resolve(names.check(head)) + bracket + tail


def topic_types(view: View) -> Mapping[str, Sequence[str]]:
    """Return the types of all topics, those of publishers before those of subscriptions."""
    all_types: dict[str, Sequence[str]] = {}
    for name, types in view.topics().items():
        published = sorted({token.type_name for token in view.publishers(name)})
        all_types[name] = [*published, *(each for each in types if each not in published)]
    return all_types


def wait_for_target(node: Node, name: str, warn: Callable[[str], object]) -> tuple[Target, Token]:
    """Return the topic or the field of a name, and a token of the topic; wait while there is none.

    Args:
        node: The node that needs it.
        name: Global name, fields and indices included.
        warn: Function called with a sentence if it has to wait.

    Raises:
        ClosedError: The context is shut down meanwhile.
    """
    graph = node.context.graph

    def find(view: View) -> tuple[Target, Token]:
        types = topic_types(view)

        def load(type_name: str) -> type[Message]:
            token = next(token for token in view.tokens if token.type_name == type_name)
            return find_class(node, token)

        target = find_target(name, types, load)
        return target, find_token(view, target.topic, target.type_name)

    try:
        return graph.find(find)
    except NotFoundError as error:
        warn(f"topic [{name}] does not appear to be published yet ({error})")
    tried: Mapping[str, Sequence[str]] = {}
    while True:
        # No type is loaded while the graph checks the condition: that may take a call of a service.
        view = graph.wait_for(
            lambda view: _beginnings(view, name) not in ({}, tried),  # noqa: B023  # called at once
            threading.TIMEOUT_MAX / 2,
            f"topic '{name}'",
        )
        tried = _beginnings(view, name)
        with suppress(NotFoundError):
            return find(view)


def _beginnings(view: View, name: str) -> Mapping[str, Sequence[str]]:
    """Return the types of the topics that a name may begin with."""
    types = topic_types(view)
    return {topic: types[topic] for topic in types if f"{name}/".startswith(f"{topic}/")}


def find_token(view: View, topic: str, type_name: str) -> Token:
    """Return the token of a publisher of a topic, or else of a subscription.

    Raises:
        NotFoundError: The topic has neither.
    """
    for token in (*view.publishers(topic), *view.subscriptions(topic)):
        if token.type_name == type_name:
            return token
    raise NotFoundError(f"topic '{topic}' is gone")


def find_class(node: Node, token: Token) -> type[Message]:
    """Return the class of the messages that a publisher sends or a subscription expects.

    Where its definition is missing here, or is another one, its node is asked for it.

    Raises:
        TypeNotFound: The type is not known here, and the node did not send its definition.
        DefinitionError: Its definition here is another one, and the node did not send its own.
    """
    cls: type[Message] | None = None
    try:
        cls = node.context.types.message(token.type_name)
    except TypeNotFound as error:
        reason = error.reason
    except DefinitionError as error:
        reason = str(error)
    else:
        if token.type_hash in {cls._type_hash, NO_HASH}:
            return cls
        reason = f"its hash there is {token.type_hash}, here it is {cls._type_hash}"
    from rosz.node.ros2 import request_type  # few commands need it

    try:
        return request_type(node, token, _DEFINITION_TIMEOUT)
    except (NotFoundError, DefinitionError, ServiceError, WaitTimeout) as error:
        advice = (
            f"{token.node_name} did not send its definition ({error}): put it on ROSZ_PACKAGE_PATH"
            " here, or look with --raw"
        )
        if cls is None:
            raise TypeNotFound(token.type_name, f"{reason}; {advice}") from error
        raise DefinitionError(
            f"'{cls._type}' has another definition at node {token.node_name}: {reason}; {advice}",
            token.name,
        ) from error


def subscribe_samples(
    node: Node, topic: str, type_name: str, type_hash: str, callback: Callable[[Sample], None]
) -> Entity:
    """Subscribe to the encoded samples of a topic, of all its types, without a queue.

    To other nodes it is a subscription like any other.

    Args:
        node: The node that the subscription belongs to and is closed with.
        topic: Full name of the topic.
        type_name: The type that others see, ``pkg/msg/Name``.
        type_hash: Hash of that type.
        callback: Function called with each sample on a Zenoh thread; must be short.

    Raises:
        ClosedError: The node is closed.
    """
    entity = Entity(node, Kind.SUBSCRIPTION, topic, type_name, type_hash, DEFAULT)
    context = node.context
    every_type = entity_key(context.domain, topic, "*", "*")
    entity.keep(context.session.subscriber(every_type, callback))
    entity.announce(watch=False)
    return node.keep(entity)
