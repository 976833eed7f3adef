"""rclpy.context: what the nodes of a program share, from ``init`` to ``shutdown``."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Self

import msgspec

from rosz.environment import Environment
from rosz.errors import UsageError
from rosz.node import Context as RoszContext
from rosz.ros2.rclpy import arguments
from rosz.ros2.rclpy.exceptions import NotInitializedException

if TYPE_CHECKING:
    from types import FrameType, TracebackType

__all__ = ("Context",)


class Context:
    """The part of a program in the network.

    Attributes:
        ended_by_signal: Whether SIGTERM ended it.
    """

    def __init__(self) -> None:
        self._open: RoszContext | None = None
        self._given: arguments.RosArguments | None = None
        self._hooks: list[Callable[[], object]] = []
        self.ended_by_signal = False

    def init(self, args: Sequence[str] | None = None, *, domain_id: int | None = None) -> None:
        """Join the network.

        Args:
            args: Command line with the program's name; that of the process when not given.
            domain_id: The ROS domain; by the environment when not given.

        Raises:
            UsageError: It is open already, or the command line has something that means nothing.
            TransportError: The session cannot be opened.
        """
        if self.ok():
            raise UsageError("Context.init() must only be called once")
        words = sys.argv if args is None else args
        self._given = arguments.parse(words[1:] if args is None else words)
        environment = Environment.read()
        if domain_id is not None:
            environment = msgspec.structs.replace(environment, domain=domain_id)
        self.ended_by_signal = False
        self._open = RoszContext(environment)
        self._open.arguments = self._given.arguments
        self._open.on_shutdown(lambda _: self._ended())
        self._take_signal()

    @property
    def given(self) -> arguments.RosArguments:
        """What the command line says.

        Raises:
            NotInitializedException: There was no `init`.
        """
        if self._given is None:
            raise NotInitializedException
        return self._given

    @property
    def opened(self) -> RoszContext:
        """What it is in rosz.

        Raises:
            NotInitializedException: There was no `init`, or it is shut down.
        """
        if self._open is None or self._open.is_shutdown:
            raise NotInitializedException
        return self._open

    def ok(self) -> bool:
        """Tell whether it is open."""
        return self._open is not None and not self._open.is_shutdown

    def on_shutdown(self, callback: Callable[[], object]) -> None:
        """Have a function called when it ends."""
        self._hooks.append(callback)

    def shutdown(self) -> None:
        """End everything; again is no error."""
        if self._open is not None:
            self._open.shutdown("rclpy.shutdown() was called")

    try_shutdown = shutdown

    def get_domain_id(self) -> int:
        """Return the ROS domain."""
        return self.opened.domain

    def _ended(self) -> None:
        for hook in self._hooks:
            hook()

    def _take_signal(self) -> None:
        """Have SIGTERM end it, where the program has no handler of its own."""
        if threading.current_thread() is not threading.main_thread():
            return

        def end(number: int, frame: FrameType | None) -> Any:  # noqa: ARG001  # a handler's
            self.ended_by_signal = True
            # Not here: closing waits for threads, which may wait for the one that is interrupted.
            threading.Thread(target=self.shutdown, name="rosz-rclpy-end").start()

        with suppress(ValueError):  # not the main interpreter
            if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
                signal.signal(signal.SIGTERM, end)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.shutdown()
