"""Golden files: what users see, frozen, so that moved code cannot change it unnoticed.

``api/`` holds names and signatures, ``docs/`` the first lines of docstrings, ``help/`` what
``--help`` prints, ``output/`` what commands print. This writes them all anew; review the diff::

    ROSZ_TEST_RECORD=1 pytest -q tests/golden
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable
from pathlib import Path

import pytest

__all__ = ("check", "check_files")

_FOLDER = Path(__file__).parent
_RECORD = bool(os.environ.get("ROSZ_TEST_RECORD"))


def check(name: str, text: str) -> None:
    """Fail unless a golden file holds a text; write the text when recording.

    Args:
        name: Path of the file in this folder.
        text: What it should hold.
    """
    file = _FOLDER / name
    if _RECORD:
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
        return
    golden = file.read_text() if file.exists() else ""
    if golden != text:
        lines = difflib.unified_diff(
            golden.splitlines(), text.splitlines(), f"golden/{name}", "now", lineterm="", n=1
        )
        pytest.fail("\n".join(["'ROSZ_TEST_RECORD=1 pytest tests/golden' accepts this:", *lines]))


def check_files(folder: str, names: Iterable[str]) -> None:
    """Fail if a folder holds a golden file that no test compares; remove it when recording.

    Args:
        folder: Name of the folder.
        names: Names of the files that tests compare.
    """
    stale = {file.name for file in (_FOLDER / folder).iterdir()} - set(names)
    if _RECORD:
        for name in stale:
            (_FOLDER / folder / name).unlink()
        return
    assert not stale, f"golden/{folder} holds files of no test"
