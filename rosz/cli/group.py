"""What the command groups share: how they take arguments, resolve names, print, and are stopped.

A group takes remappings anywhere (``from:=to``, ``__name:=``, ``__ns:=``), as ROS 1's tools do, so
that it can be a node of a launch file.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

from rosz import names, remap
from rosz.cli.declare import App, Context
from rosz.environment import Environment
from rosz.introspect.connect import open_context, open_session

if TYPE_CHECKING:
    from types import FrameType

    from rosz.introspect.survey import Survey
    from rosz.node import Context as NodeContext
    from rosz.session import Session
    from rosz.typestore import TypeStore

__all__ = (
    "Call",
    "call_of",
    "new_group",
    "print_json",
    "print_lines",
    "takes_escapes",
    "until_stopped",
    "warn",
    "write_file",
)

_LOOK_UP_SECONDS = 0.2
_SAME_WISH_SECONDS = 1.0


class Call:
    """One call of a command: settings, remappings, and the way into the network.

    Args:
        argv: The remappings among its arguments.
    """

    def __init__(self, argv: Sequence[str]) -> None:
        self.argv = tuple(argv)
        self.environment = Environment.read()
        self._arguments = remap.parse(argv)

    @property
    def domain(self) -> int:
        """The ROS domain."""
        return self.environment.domain

    def resolve(self, name: str, tool: str = "rosz") -> str:
        """Return the global name that a name means to a tool.

        Args:
            name: As it was written.
            tool: Base name of the tool's node, which private names belong to.

        Raises:
            InvalidName: It is not legal.
        """
        node = self._arguments.node_name(tool, self.environment.namespace)
        return names.resolve(name, node, self._arguments.resolved_remaps(node))

    @property
    def types(self) -> TypeStore:
        """Types by name."""
        from rosz.environment import package_index
        from rosz.typestore import TypeStore

        return TypeStore(package_index(self.environment), self.environment.home / "rosz")

    def session(self) -> Session:
        """Open a session to ask and end.

        Raises:
            TransportError: Nobody answers.
        """
        return open_session(self.environment)

    def context(self, *, lasting: bool = False) -> NodeContext:
        """Open the context of a node that publishes, subscribes or calls.

        Raises:
            TransportError: Nobody answers.
        """
        return open_context(self.environment, self.argv, lasting=lasting)

    def survey(self, *, processes: bool = False) -> Survey:
        """Ask who is there.

        Raises:
            TransportError: Nobody answers.
        """
        from rosz.introspect.survey import take_survey

        with self.session() as session:
            survey = take_survey(session, self.domain, processes=processes)
        for damage in survey.damaged:
            warn(f"ignoring what is no name of a node or topic: {damage}")
        return survey


def call_of(context: Context) -> Call:
    """Return the call that a command is part of."""
    return Call(context.argv)


def _is_remapping(word: str) -> bool:
    left, separator, _ = word.partition(":=")
    return bool(separator and left) and names.is_valid(left.lstrip("_") or "x")


def new_group(text: str) -> App:
    """Return a group of commands.

    Args:
        text: What it is for.
    """
    return App(text, remapped=_is_remapping)


def print_lines(lines: Iterable[str]) -> None:
    """Print lines to stdout at once."""
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()


def print_json(value: Any) -> None:
    """Print a value as JSON for people and programs alike."""
    import msgspec

    sys.stdout.write(msgspec.json.format(msgspec.json.encode(value, enc_hook=str)).decode() + "\n")


def write_file(file: str, content: bytes) -> None:
    """Write a file that was named on the command line.

    Raises:
        OSError: It cannot be written; it always names the file.
    """
    from pathlib import Path

    try:
        Path(file).write_bytes(content)
    except OSError as error:
        error.filename = error.filename or file
        raise


def takes_escapes(stream: TextIO) -> bool:
    """Tell whether what reads a stream is a terminal with colours and a cursor to move."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def warn(text: str) -> None:
    """Tell something that is no data."""
    sys.stderr.write(f"WARNING: {text}\n")
    sys.stderr.flush()


@contextmanager
def until_stopped() -> Iterator[Callable[[], None]]:
    """Let Ctrl-C, or a request to terminate, be the regular end of what goes on for ever.

    It gives a function to call when all is ready to go on: from then on they raise an exception
    here, once: another would leave locks that are just being given back in neither state. Before,
    they end the process at once, for while modules load an exception may get lost; and so does one
    that comes when the end has been taking long.
    """
    taken: list[signal.Signals] = []
    first: list[float] = []

    def stop(number: int, _frame: FrameType | None) -> None:
        if not first:
            first.append(time.monotonic())
            raise KeyboardInterrupt
        # timeout(1) sends its signal twice, and a terminal Ctrl-C to all, who may pass it on.
        if time.monotonic() - first[0] > _SAME_WISH_SECONDS:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)

    def take() -> None:
        # A signal that comes right before Python begins to wait is not seen until the wait ends,
        # unless another one interrupts that.
        signal.signal(signal.SIGALRM, _look_up)
        signal.setitimer(signal.ITIMER_REAL, _LOOK_UP_SECONDS, _LOOK_UP_SECONDS)
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is signal.SIG_DFL:
                taken.append(number)
                signal.signal(number, stop)

    try:
        yield take
    except KeyboardInterrupt:
        return
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        for number in taken:
            signal.signal(number, signal.SIG_DFL)


def _look_up(_number: int, _frame: FrameType | None) -> None: ...
