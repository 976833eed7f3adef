"""ROS 2's service ``get_type_description``, server and client (REP 2016)."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec

from rosz.errors import RoszError, TypeNotFound
from rosz.idl import (
    Catalog,
    MessageSpec,
    describe,
    describe_field,
    is_service,
    message_hash,
    service_hash,
    service_parts,
)
from rosz.message import Action, Message
from rosz.msgs.type_description_interfaces.msg import (
    Field,
    FieldType,
    IndividualTypeDescription,
    TypeDescription,
    TypeSource,
)
from rosz.msgs.type_description_interfaces.srv import (
    GetTypeDescription,
    GetTypeDescriptionRequest,
    GetTypeDescriptionResponse,
)
from rosz.node.client import Client
from rosz.node.core import NodeCore
from rosz.qos import SERVICES
from rosz.session import clamp_timeout
from rosz.typestore import TypeStore
from rosz.wire import NO_HASH, Token

_SERVICE = "get_type_description"
_TEXTS = frozenset({"msg", "srv"})
_PARTS = re.compile(r"^---[ \t]*$", re.MULTILINE)


class TypeDefinition(msgspec.Struct, frozen=True):
    """The definition of a type, as another node has it.

    Attributes:
        name: ``pkg/msg/Name`` or ``pkg/srv/Name``.
        text: Text of the definition.
        others: Texts of the types in it, by name.
    """

    name: str
    text: str
    others: dict[str, str]


def request_definition(node: NodeCore, entity: Token, timeout: float = 10.0) -> TypeDefinition:
    """Request the definition of an entity's type from the node that the entity belongs to.

    Nodes of rosz and of ROS 2 Jazzy or later have it; those of ROS 2 Humble do not. Of a message
    type without a text, such as one that ROS 2 derives from a service, they describe the fields.

    Args:
        node: The node that requests it.
        entity: Token of a publisher, subscription, service or client.
        timeout: Time limit in seconds.

    Raises:
        WaitTimeout: The other node did not serve or did not respond in time.
        ServiceError: The other node ended before it responded.
        TypeNotFound: The other node has no such type, or no text of its definition.
        ClosedError: The node is closed.
        UsageError: The timeout is not a number.
    """
    name = entity.type_name
    response = _request(node, entity, timeout, sources=True)
    texts = {
        source.type_name: source.raw_file_contents
        for source in response.type_sources
        if source.encoding in _TEXTS
    }
    if name not in texts and not is_service(name):
        texts = _lines_of(response.type_description)
    if name not in texts:
        raise TypeNotFound(name, f"node '{entity.node_name}' sent no text of its definition")
    return TypeDefinition(name, texts.pop(name), texts)


def _request(
    node: NodeCore, entity: Token, timeout: float, *, sources: bool
) -> GetTypeDescriptionResponse:
    """Request the description of an entity's type; errors as of `request_definition`."""
    name = entity.type_name
    deadline = time.monotonic() + clamp_timeout(timeout)
    version = "" if entity.type_hash == NO_HASH else entity.type_hash
    service = f"{entity.node_name}/{_SERVICE}"
    with node.keep(Client(node, service, GetTypeDescription, SERVICES, timeout)) as client:
        client.wait_for_service(timeout)
        left = deadline - time.monotonic()
        request = GetTypeDescriptionRequest(name, version, sources)
        response: GetTypeDescriptionResponse = client.call(request, left)
    if not response.successful:
        raise TypeNotFound(name, f"node '{entity.node_name}': {response.failure_reason}")
    return response


def request_type(node: NodeCore, entity: Token, timeout: float = 10.0) -> type[Any]:
    """Return the class of an entity's type, compiled from the other node's definition if need be.

    The class that is known here is returned if its type hash is that of the entity. Arguments and
    further errors are those of `request_definition`.

    Raises:
        DefinitionError: The definition is not well-formed.
    """
    types, name = node.context.types, entity.type_name
    serves = is_service(name)
    known_class: type[Any] | None
    try:
        known_class = types.service(name) if serves else types.message(name)
    except RoszError:
        known_class = None
    if known_class is not None and entity.type_hash in {NO_HASH, known_class._type_hash}:
        return known_class
    definition = request_definition(node, entity, timeout)
    compile_type = types.service_from_text if serves else types.message_from_text
    made: type[Any] = compile_type(name, definition.text, definition.others)
    if entity.type_hash not in {NO_HASH, made._type_hash}:
        raise TypeNotFound(
            name,
            f"the definition that node '{entity.node_name}' sent has the hash"
            f" '{made._type_hash}', expected '{entity.type_hash}'",
        )
    return made


def request_action(
    node: NodeCore, name: str, entities: Sequence[Token], timeout: float = 10.0
) -> type[Action]:
    """Return the class of an action, made of the other node's descriptions if need be.

    The class that is known here is returned if its type hashes are those of the entities. Nodes
    have no text of the types that ROS 2 derives from an action, but describe the fields. Further
    errors are those of `request_definition`.

    Args:
        node: The node that needs the class.
        name: ``pkg/action/Name``.
        entities: Tokens of the two services of the action and of its publisher of feedback.
        timeout: Time limit in seconds for each of them.

    Raises:
        TypeNotFound: The other node has no such type, or none that definitions can have.
    """
    types = node.context.types
    try:
        known_class = types.action(name)
    except RoszError:
        known_class = None
    if known_class is not None and _has_types(known_class, entities):
        return known_class
    lines: dict[str, str] = {}
    for entity in entities:
        response = _request(node, entity, timeout, sources=False)
        lines |= _lines_of(response.type_description)
    text = "---\n".join(lines.get(f"{name}_{part}", "") for part in ("Goal", "Result", "Feedback"))
    others = {type_name: text for type_name, text in lines.items() if "/msg/" in type_name}
    made = types.action_from_text(name, text, others)
    if not _has_types(made, entities):
        raise TypeNotFound(name, "what its server describes has another hash than the server uses")
    return made


def event_class(types: TypeStore, service: str) -> type[Message]:
    """Return the class of the events of a service, ``pkg/srv/Name_Event``.

    Raises:
        TypeNotFound: The service type is not known here.
        DefinitionError: Its definition is not well-formed.
    """
    service = types.service(service)._type_name
    parts = _PARTS.split(types.definition(service).text, maxsplit=1)
    names = (f"{service}_Request", f"{service}_Response")
    text = "service_msgs/ServiceEventInfo info\n{}[<=1] request\n{}[<=1] response\n".format(*names)
    return types.message_from_text(f"{service}_Event", text, dict(zip(names, parts, strict=True)))


def _has_types(action: type[Action], entities: Iterable[Token]) -> bool:
    """Return whether the services and the feedback of an action have the hashes of entities."""
    kinds = (action.SendGoal, action.GetResult, action.FeedbackMessage)
    hashes = {kind._type_name: kind._type_hash for kind in kinds}
    return all(entity.type_hash in {NO_HASH, hashes.get(entity.type_name)} for entity in entities)


def _lines_of(whole: TypeDescription) -> dict[str, str]:
    """Return the definitions that a description amounts to, by the names of the types."""
    lines = {}
    for description in (whole.type_description, *whole.referenced_type_descriptions):
        fields = ((field.name, field.type) for field in description.fields)
        try:
            lines[description.type_name] = "".join(
                describe_field(
                    name, kind.type_id, kind.capacity, kind.string_capacity, kind.nested_type_name
                )
                for name, kind in fields
            )
        except ValueError as error:
            raise TypeNotFound(description.type_name, str(error)) from error
    return lines


def describe_type(
    types: TypeStore, request: GetTypeDescriptionRequest
) -> GetTypeDescriptionResponse:
    """Return the response to a request for the definition of a type.

    Args:
        types: The types that are known here.
        request: The name of the type, and the hash of the version that is wanted.

    Returns:
        The response; a failure if the type, or that version of it, is not known.
    """
    name = request.type_name
    _, _, kind = name.rpartition("/")[0].partition("/")
    if kind not in (*_TEXTS, "action"):
        return _failure(
            f"'{name}' is not a type; expected the form 'pkg/msg/Name' or 'pkg/srv/Name'"
        )
    catalog = Catalog(types.definition)
    try:
        if is_service(name):
            service = catalog.service(name)
            type_hash = service_hash(service, catalog)
            whole, below = service_parts(service, catalog)
        else:
            whole = catalog.message(name)
            type_hash = message_hash(whole, catalog)
            below = catalog.below(whole)
    except RoszError as error:
        return _failure(str(error))
    if request.type_hash and request.type_hash != type_hash:
        return _failure(f"the version of '{name}' here has the hash '{type_hash}'")
    others = sorted(below.values(), key=lambda spec: spec.name)
    return GetTypeDescriptionResponse(
        successful=True,
        type_description=TypeDescription(_individual(whole), [_individual(o) for o in others]),
        type_sources=[_source(types, spec) for spec in (whole, *others)]
        if request.include_type_sources
        else [],
    )


def _failure(reason: str) -> GetTypeDescriptionResponse:
    return GetTypeDescriptionResponse(successful=False, failure_reason=reason)


def _individual(spec: MessageSpec) -> IndividualTypeDescription:
    text = describe(spec)
    return IndividualTypeDescription(
        text["type_name"],
        [Field(field["name"], FieldType(**field["type"])) for field in text["fields"]],
    )


def _source(types: TypeStore, spec: MessageSpec) -> TypeSource:
    """Return the text of a type; a part of a service has none of its own."""
    try:
        text = types.definition(spec.name).text
    except RoszError:
        return TypeSource(spec.name, "implicit", "")
    return TypeSource(spec.name, "srv" if is_service(spec.name) else "msg", text)
