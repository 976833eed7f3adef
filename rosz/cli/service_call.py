"""``rosz service call``."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.cli.group import Call, print_json, print_lines, until_stopped, warn
from rosz.errors import EncodeError, NotFoundError, UsageError
from rosz.introspect.documents import read_arguments, read_stream
from rosz.introspect.echo import plain
from rosz.introspect.fill import fill, list_arguments, with_arguments
from rosz.introspect.services import server
from rosz.node import Client, Node

if TYPE_CHECKING:
    from rosz.node import Context
    from rosz.wire import Token

__all__ = ("CallOptions", "call_service")

_TOOL = "rosservice"


class CallOptions(msgspec.Struct, frozen=True, kw_only=True):
    """How a service is called.

    Attributes:
        verbose: Print the request too.
        wait: Wait until the service is there.
        timeout: Seconds to wait for an answer.
        as_json: Print answers as JSON.
    """

    verbose: bool = False
    wait: bool = False
    timeout: float
    as_json: bool = False


def call_service(call: Call, name: str, words: Sequence[str], options: CallOptions) -> None:
    """Call a service and print what it answers.

    Args:
        call: The call of the command.
        name: Of the service.
        words: Values of the request as YAML; none to read requests from standard input.
        options: How.
    """
    arguments = read_arguments(words)
    # Waiting is to be outlived by nothing, so it is done as a peer.
    with until_stopped() as ready, call.context(lasting=options.wait) as context:
        ready()
        token = _find(context, call.resolve(name, _TOOL), wait=options.wait)
        stopped = context.session.why_silent(token.zid)
        if stopped:
            warn(f"service [{token.name}] does not answer as long as {stopped}")
        service_type = context.types.service(token.type_name)
        request_type = service_type.Request
        calls: Iterable[list[Any]] = [arguments]
        if not arguments and request_type.__slots__:
            if sys.stdin.isatty():
                raise UsageError(f"no values are given; they are: {list_arguments(request_type)}")
            calls = (
                one if isinstance(one, list) else [one]
                for one in read_stream(sys.stdin.buffer, warn)
            )
        with (
            Node(_TOOL, anonymous=True, context=context) as node,
            node.client(token.name, service_type, timeout=options.timeout) as client,
        ):
            for values in calls:
                _call(client, values, options)


def _find(context: Context, name: str, *, wait: bool) -> Token:
    """Return who serves a service.

    Raises:
        NotFoundError: Nobody does.
    """
    view = context.graph.refresh()
    try:
        return server(view, name)
    except NotFoundError as error:
        if not wait:
            raise
        warn(f"service [{name}] is not there yet ({error})")
    view = context.graph.wait_for(
        lambda view: bool(view.servers(name)), threading.TIMEOUT_MAX / 2, f"service '{name}'"
    )
    return server(view, name)


def _call(client: Client, values: Sequence[Any], options: CallOptions) -> None:
    request_type = client.service_type.Request
    try:
        request = fill(request_type, values, time.time_ns())
    except EncodeError as error:
        raise with_arguments(error, request_type) from error
    response = client.call(request)
    if options.as_json:
        print_json(
            {"request": plain(request), "response": plain(response)}
            if options.verbose
            else plain(response)
        )
        return
    if options.verbose:
        print_lines([str(request), "---"])
    print_lines([str(response)])
