"""What the launch itself says, in roslaunch's words: to the screen, and to its log."""

from __future__ import annotations

from collections.abc import Callable
from typing import TextIO

from rosz.launch.run.folder import LaunchLog
from rosz.launch.run.screen import Screen

__all__ = ("Console",)

_BOLD, _RED, _PLAIN = "\033[1m", "\033[31m", "\033[0m"
_END_SECONDS = 1.0
"""How long the end waits for a screen that takes nothing."""


class Console:
    """Two streams; colours where they are terminals.

    Args:
        out: For what goes well.
        err: For what does not.
        verbose: Whether notes are printed too.
        color: Whether terminals get colours.
    """

    def __init__(
        self, out: TextIO, err: TextIO, *, verbose: bool = False, color: bool = True
    ) -> None:
        self._verbose = verbose
        self._color = color
        self._out = out
        self._err = err
        self._screen = Screen()
        self.log: LaunchLog | None = None

    @property
    def is_terminal(self) -> bool:
        """Whether somebody looks on."""
        return self._out.isatty()

    def say(self, text: str = "") -> None:
        """Print a line."""
        self._print(self._out, text, "", "INFO")

    def show(self, sink: int, text: str) -> None:
        """Print what nodes of another machine wrote, to standard output (1) or error (2)."""
        self._put(self._out if sink == 1 else self._err, text)

    @property
    def full(self) -> bool:
        """Whether more is to be shown than the screen takes, so that nodes should wait."""
        return self._screen.full

    def when_free(self, told: Callable[[], None]) -> None:
        """Have something called once, on another thread, when it is not full any more."""
        self._screen.when_free(told)

    def strong(self, text: str) -> None:
        """Print a line that matters."""
        self._print(self._out, text, _BOLD, "INFO")

    def error(self, text: str) -> None:
        """Print a line about something that went wrong."""
        self._print(self._err, text, _RED, "ERROR")

    def title(self, text: str) -> None:
        """Name the terminal's window."""
        if self.is_terminal:
            self._put(self._out, f"\033]2;{text}\007")

    def note(self, text: str) -> None:
        """Print a line that only those want to see who asked for it."""
        if self._verbose:
            self.say(text)
        elif self.log is not None:
            self.log.write("INFO", text)

    def close(self) -> None:
        """Have everything shown, and close the log; again is no error."""
        self._screen.close(_END_SECONDS)
        if self.log is not None:
            self.log.close()

    def _print(self, stream: TextIO, text: str, colour: str, level: str) -> None:
        if text and self.log is not None:
            self.log.write(level, text)
        if colour and self._color and stream.isatty():
            text = f"{colour}{text}{_PLAIN}"
        self._put(stream, f"{text}\n")

    def _put(self, stream: TextIO, text: str) -> None:
        # One write per message, so that lines of nodes never come to lie within it.
        self._screen.write(stream, text)
