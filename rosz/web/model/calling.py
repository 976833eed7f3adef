"""Calling services for a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosz.introspect.services import find_server
from rosz.message.text import strify_message
from rosz.web.model.permission import Permission
from rosz.web.model.sending import read_form

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.node import Node

__all__ = ("call_service",)

_TIMEOUT = 30.0


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
    cls = node.context.types.service(find_server(view, name).type_name)
    request = read_form(cls.Request, text, node.now())
    with node.client(name, cls, timeout=_TIMEOUT) as client:
        response = client.call(request)
    return strify_message(response) if response.__slots__ else ""
