from __future__ import annotations

import os
import shutil
import signal
import struct
import subprocess
from array import array
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest
from network import Network, eventually

from rosz.msgs.std_srvs.srv import Empty
from rosz.turtlesim.world import BACKGROUND

pytestmark = [
    pytest.mark.skipif(not shutil.which("Xvfb"), reason="needs Xvfb (apt: xvfb)"),
    pytest.mark.skipif(not find_spec("_tkinter"), reason="this Python has no Tk"),
]
SCREEN = "640x600x24"


class Display:
    """An X display without a screen, with its pixels in a file (xwd(1), XWDFile.h)."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / "Xvfb_screen0"
        reading, writing = os.pipe()
        self._server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writing), "-screen", "0", SCREEN, "-fbdir", str(folder)],
            pass_fds=[writing],
            stderr=subprocess.DEVNULL,
        )
        os.close(writing)
        with os.fdopen(reading) as pipe:
            self.name = f":{pipe.readline().strip()}"

    def pixels(self) -> bytes:
        """Return the pixels of the display, four bytes each: blue, green, red and unused."""
        data = self._file.read_bytes()
        header, colors = struct.unpack_from(">I", data, 0)[0], struct.unpack_from(">I", data, 76)[0]
        return data[header + 12 * colors :]

    def count(self, color: tuple[int, int, int]) -> int:
        """Return the number of pixels of a color."""
        pixels = array("I", self.pixels())
        red, green, blue = color
        wanted = red << 16 | green << 8 | blue
        return pixels.count(wanted) + pixels.count(wanted | 0xFF000000)

    def close(self) -> None:
        """Close the display."""
        self._server.terminate()
        self._server.wait()


@pytest.fixture
def display(network: Network) -> Iterator[Display]:
    """A display for one test."""
    made = Display(network.folder)
    yield made
    made.close()


def test_the_window_shows_the_field(network: Network, display: Display) -> None:
    program = network.run("-m", "rosz", "run", "turtlesim", "turtlesim_node", DISPLAY=display.name)
    eventually(lambda: 245_000 < display.count(BACKGROUND) < 250_000, "the field")
    user = network.node("user")
    user.params["/turtlesim/background_r"] = 1
    user.client("clear", Empty)()
    eventually(lambda: display.count((1, 86, 255)) > 245_000, "the new background")
    assert "No window" not in program.output
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
    assert "Traceback" not in program.output


def test_closing_the_window_ends_the_node(network: Network, display: Display) -> None:
    program = network.program(
        """
        from rosz.turtlesim import program

        class Closed(program.Window):
            def run(self):
                self._root.after(100, self.close)
                super().run()

        program.Window = Closed
        program.main()
        print("ended")
        """,
        DISPLAY=display.name,
    )
    program.wait_for("ended")
    assert program.exit_code() == 0
