"""``rosz service call``."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec

from rosz.cli.group import Call, print_json, print_lines, until_stopped, warn
from rosz.errors import EncodeError, UsageError
from rosz.introspect.arguments import list_arguments, read_arguments, read_stream, with_arguments
from rosz.introspect.services import call_service as send_call
from rosz.introspect.services import find_server, wait_for_server
from rosz.message.convert import to_jsonable
from rosz.node import Client, Node

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
        full = call.resolve(name, _TOOL)
        if options.wait:
            token = wait_for_server(context, full, warn)
        else:
            token = find_server(context.graph.refresh(), full)
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


def _call(client: Client, values: Sequence[Any], options: CallOptions) -> None:
    try:
        request, response = send_call(client, values, time.time_ns())
    except EncodeError as error:
        raise with_arguments(error, client.service_type.Request) from error
    if options.as_json:
        print_json(
            {"request": to_jsonable(request), "response": to_jsonable(response)}
            if options.verbose
            else to_jsonable(response)
        )
        return
    if options.verbose:
        print_lines([str(request), "---"])
    print_lines([str(response)])
