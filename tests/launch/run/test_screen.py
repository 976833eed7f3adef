"""What a launch says reaches its screen in order, and nobody waits for a screen that hangs."""

from __future__ import annotations

import io
import os
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from typing import TextIO

import pytest

from rosz.launch.run.screen import Screen

from .scene import PATIENCE

LONG = "x" * 100_000 + "\n"
"""More than a pipe takes."""


class Pipe:
    """A pipe that nobody reads until told to."""

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


def test_a_text_is_there_when_write_returns() -> None:
    screen, stream = Screen(), io.StringIO()
    for number in range(100):
        screen.write(stream, f"{number}\n")
        assert stream.getvalue().endswith(f"{number}\n")
    screen.close(PATIENCE)
    screen.write(stream, "late")
    screen.close(PATIENCE)
    assert stream.getvalue() == "".join(f"{number}\n" for number in range(100))


def test_nobody_waits_and_nothing_is_lost(pipe: Pipe) -> None:
    screen, freed = Screen(), threading.Event()
    began = time.monotonic()
    texts = [LONG, *(f"{number} ä\n" for number in range(1000)), *[LONG] * 20]
    for text in texts:
        screen.write(pipe.stream, text)
    assert time.monotonic() - began < 5.0
    assert screen.full
    screen.when_free(freed.set)
    assert not freed.is_set()
    whole = "".join(texts)
    assert pipe.read(len(whole.encode())) == whole
    assert freed.wait(PATIENCE)
    screen.close(PATIENCE)
    assert not screen.full
    again = threading.Event()
    screen.when_free(again.set)
    assert again.is_set()


def test_the_end_waits_no_longer_than_it_may(pipe: Pipe) -> None:
    screen = Screen()
    screen.write(pipe.stream, LONG)
    began = time.monotonic()
    screen.close(0.1)
    assert time.monotonic() - began < 5.0
    pipe.hang_up()
    screen.close(PATIENCE)  # or it would write to whoever gets the descriptor next


def test_a_screen_that_is_gone_is_no_error(pipe: Pipe) -> None:
    screen, other = Screen(), io.StringIO()
    pipe.hang_up()
    screen.write(pipe.stream, "nobody reads this\n")
    screen.write(other, "but this\n")
    screen.close(PATIENCE)
    assert other.getvalue() == "but this\n"


def test_letters_that_a_stream_has_not(pipe: Pipe) -> None:
    screen = Screen()
    with os.fdopen(os.dup(pipe.stream.fileno()), "w", encoding="ascii") as stream:
        screen.write(stream, "ä\n")
        assert pipe.read(5) == "\\xe4\n"
    screen.close(PATIENCE)
