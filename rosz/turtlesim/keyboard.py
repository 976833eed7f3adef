"""Keys as they are pressed, without waiting for a line to end."""

from __future__ import annotations

import os
import select
import signal
import socket
import sys
import termios
from collections.abc import Iterator
from contextlib import suppress
from typing import Self

__all__ = ("KeyDecoder", "Keyboard")

_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
_ESCAPE = "\x1b"
_SOON = 0.2
"""Seconds until a program that goes on reads key by key again, at most."""


class KeyDecoder:
    """Turns what a terminal sends into keys: characters, and ``up``, ``down``, ``left``, ``right``.

    Arrows come as ``ESC [ A`` or ``ESC O A`` and so on, possibly in pieces (ECMA-48, 5.4).
    """

    def __init__(self) -> None:
        self._pending = ""

    def feed(self, data: bytes) -> Iterator[str]:
        """Yield the keys that are complete.

        Args:
            data: What came; ASCII counts, the rest does not.
        """
        for character in data.decode("latin-1"):
            if character == _ESCAPE:
                self._pending = character
            elif self._pending == _ESCAPE and character in "[O":
                self._pending += character
            elif len(self._pending) > 1:
                yield from self._sequence(character)
            else:
                self._pending = ""
                yield character

    def _sequence(self, character: str) -> Iterator[str]:
        if character.isdigit() or character == ";":
            return  # parameters of a sequence, such as Shift with an arrow
        self._pending = ""
        if character in _ARROWS:
            yield _ARROWS[character]


class Keyboard:
    """Standard input, key by key; a terminal gets its settings back at the end of the ``with``.

    A shell takes the settings back when it stops the program (Ctrl-Z), hence they are made anew
    when it goes on. That needs the main thread, as signals do.
    """

    def __init__(self) -> None:
        self._fd = sys.stdin.fileno()
        self._settings: list[int | list[bytes | int]] | None = None
        self._wake, self._waker = socket.socketpair()

    def __enter__(self) -> Self:
        if os.isatty(self._fd):
            self._settings = termios.tcgetattr(self._fd)
            self._by_key()
            self._continued = signal.signal(signal.SIGCONT, lambda *_: self._by_key())
        return self

    def _by_key(self) -> None:
        settings = termios.tcgetattr(self._fd)
        settings[3] &= ~(termios.ICANON | termios.ECHO)
        termios.tcsetattr(self._fd, termios.TCSANOW, settings)

    def __exit__(self, *_: object) -> None:
        if self._settings is not None:
            signal.signal(signal.SIGCONT, self._continued)
            termios.tcsetattr(self._fd, termios.TCSADRAIN, self._settings)
        self._wake.close()
        self._waker.close()

    def stop(self) -> None:
        """End the reading, from any thread."""
        with suppress(OSError):  # it has ended already
            self._waker.send(b"\0")

    def __iter__(self) -> Iterator[str]:
        """Yield keys until told to stop, or until there can be no more."""
        decoder = KeyDecoder()
        while True:
            # The system may hand the signal to another thread, which does not end the wait here.
            ready, _, _ = select.select([self._fd, self._wake], [], [], _SOON)
            if self._wake in ready:
                return
            if not ready:
                continue
            try:
                data = os.read(self._fd, 256)
            except OSError:  # a terminal whose other side is gone
                return
            if not data:
                return
            yield from decoder.feed(data)
