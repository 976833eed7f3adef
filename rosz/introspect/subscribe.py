"""Subscribing to a topic of any type: find it, wait for it, load its class, receive its samples."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence

from rosz import names
from rosz.errors import DefinitionError, InvalidName, NotFoundError
from rosz.graph import View
from rosz.introspect.fields import Target, find_target
from rosz.message import Message
from rosz.node import Context, Entity, Node
from rosz.qos import DEFAULT
from rosz.session import Sample
from rosz.wire import NO_HASH, Kind, Token, entity_key


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


def wait_for_target(
    context: Context, name: str, warn: Callable[[str], object]
) -> tuple[Target, Token]:
    """Return the topic or the field of a name, and a token of the topic; wait while there is none.

    The arguments and errors are those of `rosz.introspect.services.wait_for_server`; the name is
    global, fields and indices included.
    """
    load = context.types.message

    def find(view: View) -> tuple[Target, Token]:
        target = find_target(name, topic_types(view), load)
        return target, find_token(view, target.topic, target.type_name)

    try:
        return context.graph.find(find)
    except NotFoundError as error:
        warn(f"topic [{name}] does not appear to be published yet ({error})")
    targets: list[tuple[Target, Token]] = []

    def look(view: View) -> bool:
        try:
            targets.append(find(view))
        except NotFoundError:
            return False
        return True

    context.graph.wait_for(look, threading.TIMEOUT_MAX / 2, f"topic '{name}'")
    return targets[-1]


def find_token(view: View, topic: str, type_name: str) -> Token:
    """Return the token of a publisher of a topic, or else of a subscription.

    Raises:
        NotFoundError: The topic has neither.
    """
    for token in (*view.publishers(topic), *view.subscriptions(topic)):
        if token.type_name == type_name:
            return token
    raise NotFoundError(f"topic '{topic}' is gone")


def find_class(context: Context, token: Token) -> type[Message]:
    """Return the class of the messages that a publisher sends or a subscription expects.

    Raises:
        TypeNotFound: The type is not known here.
        DefinitionError: Its definition here differs from the one there, or is not well-formed.
    """
    cls = context.types.message(token.type_name)
    if token.type_hash not in {cls._type_hash, NO_HASH}:
        raise DefinitionError(
            f"'{cls._type}' has another definition at node {token.node_name}: its hash there is"
            f" {token.type_hash}, here it is {cls._type_hash}; put the same definition on"
            " ROSZ_PACKAGE_PATH here, or look with --raw",
            token.name,
        )
    return cls


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
