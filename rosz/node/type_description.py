"""ROS 2's service ``get_type_description``, server and client (REP 2016)."""

from __future__ import annotations

import time
from typing import Any

import msgspec

from rosz.errors import RoszError, TypeNotFound
from rosz.idl import (
    Catalog,
    MessageSpec,
    describe,
    is_service,
    message_hash,
    service_hash,
    service_parts,
)
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

__all__ = ("TypeDefinition", "describe_type", "request_definition", "request_type")

_SERVICE = "get_type_description"
_TEXTS = frozenset({"msg", "srv"})


class TypeDefinition(msgspec.Struct, frozen=True):
    """The definition of a message or service type, as another node has it.

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

    Nodes of rosz and of ROS 2 Jazzy or later have it; those of ROS 2 Humble do not.

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
    deadline = time.monotonic() + clamp_timeout(timeout)
    version = "" if entity.type_hash == NO_HASH else entity.type_hash
    service = f"{entity.node_name}/{_SERVICE}"
    with node.keep(Client(node, service, GetTypeDescription, SERVICES, timeout)) as client:
        client.wait_for_service(timeout)
        left = deadline - time.monotonic()
        response = client.call(GetTypeDescriptionRequest(name, version, True), left)
    if not response.successful:
        raise TypeNotFound(name, f"node '{entity.node_name}': {response.failure_reason}")
    texts = {
        source.type_name: source.raw_file_contents
        for source in response.type_sources
        if source.encoding in _TEXTS
    }
    if name not in texts:
        raise TypeNotFound(name, f"node '{entity.node_name}' sent no text of its definition")
    return TypeDefinition(name, texts.pop(name), texts)


def request_type(node: NodeCore, entity: Token, timeout: float = 10.0) -> type[Any]:
    """Return the class of an entity's type, compiled from the other node's definition if need be.

    The class that is known here is returned if its type hash is that of the entity.

    Args:
        node: The node that needs the class.
        entity: Token of a publisher, subscription, service or client.
        timeout: Time limit in seconds.

    Raises:
        WaitTimeout: The other node did not serve or did not respond in time.
        ServiceError: The other node ended before it responded.
        TypeNotFound: The other node has no such type, or no text of its definition.
        DefinitionError: The definition is not well-formed.
        ClosedError: The node is closed.
        UsageError: The timeout is not a number.
    """
    types, name = node.context.types, entity.type_name
    serves = is_service(name)
    found: type[Any] | None
    try:
        found = types.service(name) if serves else types.message(name)
    except RoszError:
        found = None
    if found is not None and entity.type_hash in {NO_HASH, found._type_hash}:
        return found
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


def describe_type(
    types: TypeStore, request: GetTypeDescriptionRequest
) -> GetTypeDescriptionResponse:
    """Return the response to a request for the definition of a message or service type.

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
            found = service_hash(service, catalog)
            whole, below = service_parts(service, catalog)
        else:
            whole = catalog.message(name)
            found = message_hash(whole, catalog)
            below = catalog.below(whole)
    except RoszError as error:
        return _failure(str(error))
    if request.type_hash and request.type_hash != found:
        return _failure(f"the version of '{name}' here has the hash '{found}'")
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
