"""Messages of a launch are printed in order, and a blocked terminal does not block the launch."""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Iterator
from contextlib import closing
from typing import TextIO

import pytest

from rosz.launch.run.console import ConsoleWriter

from .in_thread import TIMEOUT

LONG = "x" * 100_000 + "\n"
"""More than a pipe holds."""


class Pipe:
    """A pipe that is only read on request."""

    def __init__(self) -> None:
        self._reading, writing = os.pipe()
        self.stream: TextIO = os.fdopen(writing, "w", encoding="utf-8")

    def read(self, size: int) -> str:
        data = b""
        while len(data) < size:
            data += os.read(self._reading, size - len(data))
        return data.decode()

    def hang_up(self) -> None:
        os.close(self._reading)
        self._reading = os.open(os.devnull, os.O_RDONLY)

    def close(self) -> None:
        os.close(self._reading)
        self.stream.close()


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    with closing(Pipe()) as made:
        yield made


def test_a_text_is_written_when_write_returns() -> None:
    writer, stream = ConsoleWriter(), io.StringIO()
    for number in range(100):
        writer.write(stream, f"{number}\n")
        assert stream.getvalue().endswith(f"{number}\n")
    writer.close(TIMEOUT)
    writer.write(stream, "late")
    writer.close(TIMEOUT)
    assert stream.getvalue() == "".join(f"{number}\n" for number in range(100))


def test_a_blocked_stream_blocks_nobody_and_loses_nothing(pipe: Pipe) -> None:
    writer, freed = ConsoleWriter(), threading.Event()
    texts = [LONG, *(f"{number} ä\n" for number in range(1000)), *[LONG] * 20]
    for text in texts:
        writer.write(pipe.stream, text)
    assert writer.full
    writer.when_free(freed.set)
    assert not freed.is_set()
    whole = "".join(texts)
    assert pipe.read(len(whole.encode())) == whole
    assert freed.wait(TIMEOUT)
    writer.close(TIMEOUT)
    assert not writer.full
    again = threading.Event()
    writer.when_free(again.set)
    assert again.is_set()


def test_close_waits_no_longer_than_its_timeout(pipe: Pipe) -> None:
    writer = ConsoleWriter()
    writer.write(pipe.stream, LONG)
    writer.close(0.1)
    pipe.hang_up()
    writer.close(TIMEOUT)  # or it would write to whoever gets the descriptor next


def test_a_closed_stream_is_ignored(pipe: Pipe) -> None:
    writer, other = ConsoleWriter(), io.StringIO()
    pipe.hang_up()
    writer.write(pipe.stream, "nobody reads this\n")
    writer.write(other, "but this\n")
    writer.close(TIMEOUT)
    assert other.getvalue() == "but this\n"


def test_characters_outside_the_encoding_are_escaped(pipe: Pipe) -> None:
    writer = ConsoleWriter()
    with os.fdopen(os.dup(pipe.stream.fileno()), "w", encoding="ascii") as stream:
        writer.write(stream, "ä\n")
        assert pipe.read(5) == "\\xe4\n"
    writer.close(TIMEOUT)
