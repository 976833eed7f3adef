"""Calling services for a page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rosz.introspect.services import find_server
from rosz.message.text import strify_message
from rosz.node.type_description import request_type
from rosz.web.model.forms import read_form
from rosz.web.model.permission import Permission

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.node import Node

__all__ = ("call_service", "service_type")

_TIMEOUT = 30.0


def service_type(node: Node, view: View, name: str) -> type[Any]:
    """Return the class of a service; its server describes one that is unknown here.

    Args:
        node: The node that requests the description.
        view: The running nodes.
        name: Full name of the service.

    Raises:
        NotFoundError: No node serves it, or the server cannot describe it.
        ServiceError: The server ended before it described it.
        WaitTimeout: It did not describe it in time.
    """
    return request_type(node, find_server(view, name))


def call_service(node: Node, permission: Permission, view: View, name: str, text: str) -> str:
    """Call a service, and return its response as text.

    Args:
        node: The node that calls it.
        permission: What the page may do.
        view: The running nodes.
        name: Full name of the service.
        text: The request in YAML.

    Raises:
        NotFoundError: No node serves it.
        UsageError: The text is not YAML, or the page may not call it.
        EncodeError: A value does not fit the request.
        ServiceError: The server raised an error.
        WaitTimeout: It did not reply in time.
    """
    permission.check("call", name)
    cls = service_type(node, view, name)
    request = read_form(cls.Request, text, node.now())
    with node.client(name, cls, timeout=_TIMEOUT) as client:
        response = client.call(request)
    return strify_message(response) if response.__slots__ else ""
