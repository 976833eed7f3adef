"""``rosz topic pub``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec

from rosz.cli.group import Call, print_lines, until_stopped, warn
from rosz.errors import EncodeError, UsageError
from rosz.introspect.arguments import (
    list_arguments,
    read_arguments,
    read_file,
    read_stream,
    with_arguments,
)
from rosz.introspect.publish import DEFAULT_RATE, Sender, SendOptions
from rosz.node import Node

__all__ = ("pub",)

_TOOL = "rostopic"


def pub(
    call: Call,
    topic: str,
    type_name: str,
    words: Sequence[str],
    options: SendOptions,
    *,
    latch: bool,
    file: str,
) -> None:
    """Publish messages.

    Args:
        call: The call.
        topic: Name of the topic.
        type_name: Its type.
        words: Values of the message as YAML; none to read messages from elsewhere.
        options: How to send.
        latch: Latch also when there is a rate or a file.
        file: Where to read messages; empty for standard input.
    """
    arguments = read_arguments(words)
    documents = read_file(Path(file)) if file else None
    latched = options.rate is None or latch
    with until_stopped() as ready, call.context(lasting=not options.once) as context:
        cls = context.types.message(type_name)
        ready()
        from_elsewhere = bool(file) or (not arguments and bool(cls.__slots__))
        if from_elsewhere and not file and sys.stdin.isatty():
            raise UsageError(f"no values are given; they are: {list_arguments(cls)}")
        if from_elsewhere and options.rate is None and not latch and not options.once:
            options = msgspec.structs.replace(options, rate=DEFAULT_RATE)
        with Node(_TOOL, anonymous=True, context=context) as node:
            publisher = node.publisher(topic, cls, latch=latched, queue_size=100)
            sender = Sender(node, publisher, options, lambda line: print_lines([line]))
            try:
                if not from_elsewhere:
                    sender.send(arguments)
                elif documents is not None:
                    sender.send_documents(documents, only_one=len(documents) == 1)
                else:
                    sender.send_documents(read_stream(sys.stdin.buffer, warn))
            except EncodeError as error:
                raise with_arguments(error, cls) from error
