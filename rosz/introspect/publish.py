"""Publishing messages that are written as YAML, as ``rostopic pub`` does."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.introspect.arguments import make_message

if TYPE_CHECKING:
    from rosz.node import Node, Publisher

ONCE_SECONDS = 3.0
"""Seconds that a message that is sent once stays latched for late joiners."""
DEFAULT_RATE = 10.0
"""Messages per second from a file or a stream."""


class SendOptions(msgspec.Struct, frozen=True, kw_only=True):
    """The options of a `Sender`.

    Attributes:
        rate: Messages per second; None to latch one message.
        once: Whether to end after one message.
        verbose: Whether to report each message.
        substitute: Whether to replace ``now`` and ``auto`` again for each message.
        ros_time: Whether they are ROS time, which may be simulated.
    """

    rate: float | None = None
    once: bool = False
    verbose: bool = False
    substitute: bool = False
    ros_time: bool = False


class Sender(msgspec.Struct, eq=False):
    """Publishes messages on one topic until it has sent them, or the context is shut down.

    Args:
        node: The node that publishes.
        publisher: The publisher.
        options: How messages are sent.
        report: Function called with each line of progress.
    """

    _node: Node
    _publisher: Publisher[Any]
    _options: SendOptions
    _report: Callable[[str], object]

    def send(self, arguments: Sequence[Any]) -> None:
        """Send the message of command-line arguments.

        Raises:
            EncodeError: The arguments do not fit the type.
        """
        if self._options.rate is None:
            self._latch(arguments, once=self._options.once)
            self._node.context.wait_for_shutdown(ONCE_SECONDS if self._options.once else None)
        else:
            self._repeat(arguments, self._options.rate)

    def send_documents(self, documents: Iterable[Any], *, only_one: bool = False) -> None:
        """Send the messages of a file or a stream, one after the other.

        Args:
            documents: Dictionaries of fields, or lists of their values.
            only_one: Whether there is known to be just one, which is then repeated.

        Raises:
            EncodeError: A document does not fit the type.
            YamlError: A document is not YAML.
        """
        rate = self._options.rate
        if only_one and rate is not None:
            self._report("Got one message and a rate, publishing repeatedly")
            for document in documents:
                self._repeat(_arguments(document), rate)
            return
        pace = None if rate is None else self._node.rate(rate)
        sent = False
        for document in documents:
            if self._node.is_shutdown:
                return
            sent = True
            self._latch(_arguments(document), once=pace is not None or self._options.once)
            if pace is None or self._options.once:
                break
            pace.sleep()
        if sent:
            self._node.context.wait_for_shutdown(
                ONCE_SECONDS if pace is not None or self._options.once else None
            )

    def _make(self, arguments: Sequence[Any]) -> Any:
        now = self._node.now() if self._options.ros_time else time.time_ns()
        return make_message(self._publisher.message_type, arguments, now)

    def _latch(self, arguments: Sequence[Any], *, once: bool) -> None:
        message = self._make(arguments)
        shown = f"[{message}]" if self._options.verbose else "message"
        end = f" for {ONCE_SECONDS} seconds" if once else ". Press ctrl-C to terminate"
        self._report(f"publishing and latching {shown}{end}")
        self._publisher.publish(message)

    def _repeat(self, arguments: Sequence[Any], rate: float) -> None:
        message = self._make(arguments)
        pace = self._node.rate(rate)
        while not self._node.is_shutdown:
            if self._options.verbose:
                self._report(f"publishing {message}")
            self._publisher.publish(message)
            pace.sleep()
            if self._options.substitute:
                message = self._make(arguments)


def _arguments(document: Any) -> list[Any]:
    return document if isinstance(document, list) else [document]
