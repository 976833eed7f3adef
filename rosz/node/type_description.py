"""How a type is defined, as ROS 2 describes it (REP 2016)."""

from __future__ import annotations

from rosz.errors import RoszError
from rosz.idl import (
    Catalog,
    MessageSpec,
    describe,
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
    GetTypeDescriptionRequest,
    GetTypeDescriptionResponse,
)
from rosz.typestore import TypeStore

__all__ = ("describe_type",)


def describe_type(
    types: TypeStore, request: GetTypeDescriptionRequest
) -> GetTypeDescriptionResponse:
    """Answer how a message or service type is defined.

    Args:
        types: All that are known.
        request: The type's name, and the hash of the version that is asked for.

    Returns:
        The response; a type that is not known, or not in that version, is a failure.
    """
    name = request.type_name
    _, _, kind = name.rpartition("/")[0].partition("/")
    if kind not in {"msg", "srv"}:
        return _failure(f"'{name}' is no type; expected the form 'pkg/msg/Name' or 'pkg/srv/Name'")
    catalog = Catalog(types.definition)
    try:
        if kind == "srv":
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
    return TypeSource(spec.name, spec.name.split("/")[1], text)
