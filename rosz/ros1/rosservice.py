"""rosservice as a module: who serves what, and calling it (ROS wiki, rosservice)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rosz.errors import EncodeError, NotFoundError, RoszError
from rosz.introspect.services import call, find, server, uri
from rosz.names import short_type
from rosz.ros1.genpy.message import get_printable_message_args, get_service_class
from rosz.ros1.rosgraph import Master, live
from rosz.ros1.rosgraph.names import make_global_ns, script_resolve_name

__all__ = (
    "NAME",
    "ROSServiceException",
    "ROSServiceIOException",
    "call_service",
    "get_service_args",
    "get_service_class_by_name",
    "get_service_list",
    "get_service_node",
    "get_service_type",
    "get_service_uri",
    "has_service_args",
    "rosservice_find",
)

NAME = "rosservice"


class ROSServiceException(Exception):
    """Something wrong with a service or a call of it."""


class ROSServiceIOException(ROSServiceException):
    """The network did not answer."""


def get_service_list(
    node: str | None = None, namespace: str | None = None, include_nodes: bool = False
) -> list[Any]:
    """Return the names of services.

    Args:
        node: Only those that this node serves.
        namespace: Only those in it.
        include_nodes: Whether to return pairs of a name and the names of the nodes that serve it.
    """
    found = Master(NAME).getSystemState()[2]
    if namespace:
        space = make_global_ns(namespace)
        found = [one for one in found if one[0] == namespace or one[0].startswith(space)]
    if node is not None:
        found = [one for one in found if node in one[1]]
    return found if include_nodes else [name for name, _ in found]


def _server(service_name: str) -> Any:
    """Return who serves a service; None if nobody does."""
    try:
        return server(live.survey().view, service_name)
    except NotFoundError:
        return None


def get_service_type(service_name: str) -> str | None:
    """Return the type of a service; None if nobody serves it."""
    token = _server(service_name)
    return None if token is None else short_type(token.type_name)


def get_service_node(service_name: str) -> str | None:
    """Return the name of the node that serves a service; None if none does."""
    token = _server(service_name)
    return None if token is None else str(token.node_name)


def get_service_uri(service_name: str) -> str | None:
    """Return where a service is called, its key expression on Zenoh; None if nobody serves it."""
    token = _server(service_name)
    return None if token is None else uri(token)


def rosservice_find(service_type: str) -> list[str]:
    """Return the names of the services of a type."""
    return find(live.survey().view, service_type)


def get_service_class_by_name(service_name: str) -> type[Any]:
    """Return the class of a service.

    Raises:
        ROSServiceException: Nobody serves it, or its type is not known here.
    """
    type_name = get_service_type(service_name)
    if type_name is None:
        raise ROSServiceException(f"Service [{service_name}] is not available.")
    found = get_service_class(type_name)
    if found is None:
        raise ROSServiceException(
            f"Unable to load type [{type_name}]. Is its package on ROSZ_PACKAGE_PATH?"
        )
    return found


def get_service_args(service_name: str) -> str:
    """Return the names of the values that a call of a service takes, separated by spaces.

    Raises:
        ROSServiceException: Nobody serves it, or its type is not known here.
    """
    found = get_service_class_by_name(script_resolve_name(NAME, service_name))
    return get_printable_message_args(found.Request())


def has_service_args(service_name: str, service_class: type[Any] | None = None) -> bool:
    """Tell whether a call of a service takes values.

    Args:
        service_name: Name of the service.
        service_class: Its class, where it is known.

    Raises:
        ROSServiceException: Nobody serves it, or its type is not known here.
    """
    name = script_resolve_name(NAME, service_name)
    found = service_class or get_service_class_by_name(name)
    return bool(found.Request.__slots__)


def call_service(
    service_name: str, service_args: Sequence[Any], service_class: type[Any] | None = None
) -> tuple[Any, Any]:
    """Call a service.

    Args:
        service_name: Its name.
        service_args: A dict of fields in a list, or a value for each field.
        service_class: Its class, where it is known.

    Returns:
        Request and response.

    Raises:
        ROSServiceException: Nobody serves it, the values do not fit, or it failed.
    """
    name = script_resolve_name(NAME, service_name)
    found = service_class or get_service_class_by_name(name)
    with live.nameless_node(NAME) as node:
        client = node.client(name, found)
        try:
            return call(client, list(service_args), node.now())
        except EncodeError as error:
            given = "\n".join(f" * {one} (type {type(one).__name__})" for one in service_args)
            raise ROSServiceException(
                f"Incompatible arguments to call service:\n{error}\nProvided arguments are:\n"
                f"{given}\n\nService arguments are: [{get_printable_message_args(found.Request())}]"
            ) from error
        except RoszError as error:
            raise ROSServiceException(str(error)) from error
        finally:
            client.close()
