"""Several programs in one process: each has its own command line and its own threads.

A container (`rosz.ros1.container`) runs each of its programs on a thread. Threads that a program
starts belong to it, so code on any thread can look up its program with `current`. There each
program has its own ``sys.argv``, its own node of rospy and so on, of which a process elsewhere has
one.
"""

from __future__ import annotations

import sys
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any, TypeVar

import msgspec

T = TypeVar("T")


class ProgramSpec(msgspec.Struct, frozen=True, kw_only=True):
    """A Python program to run in a container.

    Attributes:
        name: Name of its node, or of its package and file, for messages.
        script: Path of the script.
        arguments: Command line without the path.
        respawn: Whether to run it again whenever it ends.
        respawn_delay: Delay before that in seconds.
        respawn_max: Maximum number of further runs, or None for no limit.
        required: Whether the container ends when it ends.
    """

    name: str
    script: str
    arguments: tuple[str, ...] = ()
    respawn: bool = False
    respawn_delay: float = 0.0
    respawn_max: int | None = None
    required: bool = False


class Program:
    """One run of a program.

    Args:
        name: Name for messages.
        argv: Command line with the path of the script.
        context: The context whose session all programs of the process share; see
            `rosz.node.Context`.

    Attributes:
        folder: Folder from which its modules are imported first; empty for none.
        values: The values that `own` keeps for it.
        threads: The threads that it has started and that are alive.
    """

    def __init__(self, name: str, argv: list[str], context: Any = None) -> None:
        self.name = name
        self.argv = argv
        self.folder: str = ""
        self.context: Any = context
        self.values: dict[object, Any] = {}
        self.threads: weakref.WeakSet[threading.Thread] = weakref.WeakSet()
        self._ends: list[Callable[[str], object]] = []

    def on_end(self, act: Callable[[str], object]) -> Callable[[], None]:
        """Call a function with the reason when the program ends, newest first.

        Returns:
            A function that takes this back.
        """
        self._ends.append(act)

        def remove() -> None:
            self._ends = [other for other in self._ends if other is not act]

        return remove

    def end(self, reason: str = "") -> None:
        """Call the functions of `on_end`; a second call has no effect."""
        with within(self):
            while self._ends:
                self._ends.pop()(reason)

    def adopt(self, thread: threading.Thread) -> None:
        """Make a thread that has not been started yet one of this program."""
        run: Callable[[], None] = thread.run

        def run_within() -> None:
            _local.program = self  # to the end, so that `threading.excepthook` finds it
            run()

        thread.run = run_within  # type: ignore[method-assign]
        self.threads.add(thread)


class _Local(threading.local):
    program: Program | None = None


_local = _Local()


def current() -> Program | None:
    """Return the program that the calling thread belongs to, if there are several."""
    return _local.program


@contextmanager
def within(program: Program | None) -> Iterator[None]:
    """Let the calling thread belong to a program, or to none, for the time of the context."""
    before = _local.program
    _local.program = program
    try:
        yield
    finally:
        _local.program = before


def own(make: Callable[[], T], outside: T) -> T:
    """Return the value that the current program has instead of one of the whole process.

    Args:
        make: Function that makes the value of a program; the same function finds it again.
        outside: Value where the thread belongs to no program.
    """
    program = _local.program
    if program is None:
        return outside
    own_value = program.values.get(make)
    if own_value is None:
        # Of two threads that make one, both get the first.
        own_value = program.values.setdefault(make, make())
    value: T = own_value
    return value


class _Sys(ModuleType):
    """The module ``sys`` with a command line for each program."""

    @property
    def argv(self) -> list[str]:
        """The command line of the current program, or of the process."""
        program = _local.program
        whole: list[str] = self.__dict__["argv"]
        return whole if program is None else program.argv

    @argv.setter
    def argv(self, words: list[str]) -> None:
        program = _local.program
        if program is None:
            self.__dict__["argv"] = words
        else:
            program.argv = words


def separate_programs() -> None:
    """Prepare the process for several programs; a second call has no effect.

    From now on a thread belongs to the program of the thread that starts it, and ``sys.argv`` is
    that of the current program.
    """
    if isinstance(sys, _Sys):
        return
    sys.__class__ = _Sys
    start = threading.Thread.start

    def start_within(thread: threading.Thread) -> None:
        program = _local.program
        if program is not None:
            program.adopt(thread)
        start(thread)

    threading.Thread.start = start_within  # type: ignore[assignment,method-assign]
