"""rosservice: services, their nodes and types, and calls (ROS wiki, rosservice)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rosz.errors import EncodeError, NotFoundError, RoszError
from rosz.introspect import call_service as send_call
from rosz.introspect import find_server, in_namespace, service_key, services_of_type
from rosz.names import short_type
from rosz.ros1.client.genpy import get_printable_message_args, get_service_class
from rosz.ros1.state import find, survey, unnamed_node
from rosz.ros1.tool import Tool
from rosz.ros1.tools.rosgraph.masterapi import Master
from rosz.ros1.tools.rosgraph.names import make_global_ns, script_resolve_name

NAME = "rosservice"


class ROSServiceException(Exception):
    """A service, its type or a call is wrong."""


class ROSServiceIOException(ROSServiceException):
    """The network did not answer."""


def get_service_list(
    node: str | None = None, namespace: str | None = None, include_nodes: bool = False
) -> list[Any]:
    """Return the names of services.

    Args:
        node: Full name of a node, to list only its services.
        namespace: Namespace of the services to list.
        include_nodes: Whether to return pairs of a name and a list of nodes.
    """
    services = Master(NAME).getSystemState()[2]
    if namespace:
        space = make_global_ns(namespace).rstrip("/")
        services = [service for service in services if in_namespace(service[0], space)]
    if node is not None:
        services = [service for service in services if node in service[1]]
    return services if include_nodes else [name for name, _ in services]


def _server(service_name: str) -> Any:
    """Return the server of a service, or None if there is none."""
    try:
        return find(lambda view: find_server(view, service_name))
    except NotFoundError:
        return None


def get_service_type(service_name: str) -> str | None:
    """Return the type of a service, or None if no node serves it."""
    token = _server(service_name)
    return None if token is None else short_type(token.type_name)


def get_service_node(service_name: str) -> str | None:
    """Return the name of the node that serves a service, or None if none does."""
    token = _server(service_name)
    return None if token is None else str(token.node_name)


def get_service_uri(service_name: str) -> str | None:
    """Return the key expression of a service on Zenoh, or None if no node serves it."""
    token = _server(service_name)
    return None if token is None else service_key(token)


def rosservice_find(service_type: str) -> list[str]:
    """Return the names of the services of a type."""
    return services_of_type(survey().view, service_type)


def get_service_class_by_name(service_name: str) -> type[Any]:
    """Return the class of a service.

    Raises:
        ROSServiceException: No node serves it, or the definition of its type is not found.
    """
    type_name = get_service_type(service_name)
    if type_name is None:
        raise ROSServiceException(f"Service [{service_name}] is not available.")
    service_class = get_service_class(type_name)
    if service_class is None:
        raise ROSServiceException(
            f"Unable to load type [{type_name}]. Is its package on ROSZ_PACKAGE_PATH?"
        )
    return service_class


def get_service_args(service_name: str) -> str:
    """Return the names of the fields in a request of a service, separated by spaces.

    The errors are those of `get_service_class_by_name`.
    """
    service_class = get_service_class_by_name(script_resolve_name(NAME, service_name))
    return get_printable_message_args(service_class.Request)


def has_service_args(service_name: str, service_class: type[Any] | None = None) -> bool:
    """Return whether the request of a service has fields.

    Args:
        service_name: Name of the service.
        service_class: Class of the service; that of `get_service_class_by_name` when not given.
    """
    name = script_resolve_name(NAME, service_name)
    cls = service_class or get_service_class_by_name(name)
    return bool(cls.Request.__slots__)


def call_service(
    service_name: str, service_args: Sequence[Any], service_class: type[Any] | None = None
) -> tuple[Any, Any]:
    """Call a service.

    Args:
        service_name: Name of the service.
        service_args: List of one dict of fields, or of a value for each field.
        service_class: Class of the service; found by name when not given.

    Returns:
        Request and response.

    Raises:
        ROSServiceException: No node serves it, the values do not fit, or the call failed.
    """
    name = script_resolve_name(NAME, service_name)
    cls = service_class or get_service_class_by_name(name)
    node = unnamed_node()
    client = node.client(name, cls)
    try:
        return send_call(client, list(service_args), node.now())
    except EncodeError as error:
        given = "\n".join(f" * {value} (type {type(value).__name__})" for value in service_args)
        raise ROSServiceException(
            f"Incompatible arguments to call service:\n{error}\nProvided arguments are:\n{given}"
            f"\n\nService arguments are: [{get_printable_message_args(cls.Request())}]"
        ) from error
    except RoszError as error:
        raise ROSServiceException(str(error)) from error
    finally:
        client.close()


_tool = Tool(NAME)
rosservicemain = _tool.main
_fullusage = _tool.print_usage
globals().update(_tool.parts("args call find info list node type uri"))
