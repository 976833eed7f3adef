"""rclpy.context: the connection that nodes of a program share from ``init`` to ``shutdown``."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from types import FrameType
from typing import Any, Self

import msgspec

from rosz.environment import Environment
from rosz.errors import UsageError
from rosz.node import Context as RoszContext
from rosz.program import own
from rosz.ros2.rclpy import arguments
from rosz.ros2.rclpy.exceptions import NotInitializedException


class Context:
    """The connection of a program to the network.

    Attributes:
        ended_by_signal: Whether SIGTERM shut the context down.
    """

    def __init__(self) -> None:
        self._open: RoszContext | None = None
        self._given: arguments.RosArguments | None = None
        self._hooks: list[Callable[[], object]] = []
        self.ended_by_signal: bool = False

    def init(self, args: Sequence[str] | None = None, *, domain_id: int | None = None) -> None:
        """Connect to the network; see `rclpy.init`.

        Raises:
            UsageError: The context is open already, or the command line is not valid.
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
        self._open.on_shutdown(lambda _: self._run_hooks())
        self._handle_sigterm()

    @property
    def given(self) -> arguments.RosArguments:
        """The arguments of the command line; a NotInitializedException before `init`."""
        if self._given is None:
            raise NotInitializedException
        return self._given

    @property
    def opened(self) -> RoszContext:
        """The context of rosz's own nodes; a NotInitializedException unless `ok`."""
        if self._open is None or self._open.is_shutdown:
            raise NotInitializedException
        return self._open

    def ok(self) -> bool:
        """Return whether the context is open."""
        return self._open is not None and not self._open.is_shutdown

    def on_shutdown(self, callback: Callable[[], object]) -> None:
        """Call a function at each shutdown."""
        self._hooks.append(callback)

    def shutdown(self) -> None:
        """Close everything; a second call has no effect."""
        if self._open is not None:
            self._open.shutdown("rclpy.shutdown() was called")

    try_shutdown = shutdown

    def get_domain_id(self) -> int:
        """Return the ROS domain."""
        return self.opened.domain

    def _run_hooks(self) -> None:
        for hook in self._hooks:
            hook()

    def _handle_sigterm(self) -> None:
        """Shut down on SIGTERM, unless the program has a handler of its own."""
        if threading.current_thread() is not threading.main_thread():
            return

        def end(number: int, frame: FrameType | None) -> Any:  # noqa: ARG001  # a handler's
            self.ended_by_signal = True
            # On a thread: closing waits for threads, which may wait for the interrupted one.
            threading.Thread(target=self.shutdown, name="rosz-rclpy-end").start()

        with suppress(ValueError):  # not the main interpreter
            if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
                signal.signal(signal.SIGTERM, end)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()


_default = Context()


def get_default_context() -> Context:
    """Return the context that is used when none is given."""
    return own(Context, _default)
