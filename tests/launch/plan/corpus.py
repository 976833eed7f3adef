"""The launch files to compare with roslaunch, and the settings to read them with.

Comments in a file say how: ``argv`` has the command line, ``environ`` a variable beyond the usual
ones, ``skip`` a report that is not compared. ``expected.txt`` has the message for each file that is
refused; ``...`` stands for what depends on versions.
"""

from __future__ import annotations

import re
from pathlib import Path

import msgspec

FILES = Path(__file__).with_name("files")
_HEADER = re.compile(r"<!-- (argv|environ|skip): (.*?) -->")


class Case(msgspec.Struct, frozen=True):
    """One launch file.

    Attributes:
        path: The file.
        argv: Command line.
        environ: Variables.
        skip: Reports that are not compared.
    """

    path: Path
    argv: tuple[str, ...] = ()
    environ: dict[str, str] = {}
    skip: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the file without its suffix."""
        return self.path.stem


def read(path: Path) -> Case:
    """Return the case that the comments of a file describe."""
    found = dict(_HEADER.findall(path.read_text("latin-1")))
    return Case(
        path,
        tuple(found.get("argv", "").split()),
        dict(pair.split("=", 1) for pair in [found["environ"]]) if "environ" in found else {},
        tuple(found.get("skip", "").split()),
    )


VALID = [read(path) for path in sorted((FILES / "valid").glob("*.launch"))]
INVALID = [read(path) for path in sorted((FILES / "invalid").glob("*.launch"))]


def expected() -> dict[str, str]:
    """Return the message expected for each file that is refused."""
    text = (FILES / "expected.txt").read_text("utf-8")
    blocks = (block.partition("\n") for block in text.split("\n== ")[1:])
    return {name.strip(): message.strip() for name, _, message in blocks}


def plain(message: str) -> str:
    """Return a message without the path of this checkout."""
    for folder, name in ((FILES / "invalid" / "..", ""), (FILES, ""), (FILES.parent, "")):
        message = message.replace(f"{folder}/", name)
    return message
