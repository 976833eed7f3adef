"""What the manual tells people with several machines to type."""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import dedent

__all__ = ("block", "line", "word")

_MANUAL = Path(__file__).parents[2] / "rosz" / "share" / "manual"
_PAGES = "several_machines.md", "security.md"
_BLOCK = re.compile(r"(?:^    .*\n|^\n(?=    ))+", re.MULTILINE)
_REMARK = re.compile(r"   +\S.*")


def block(beginning: str) -> str:
    """Return the example that begins with some text."""
    blocks = [dedent(found.group()).strip("\n") for found in _BLOCK.finditer(_text())]
    (one,) = [text for text in blocks if text.startswith(beginning)]
    return one + "\n"


def line(beginning: str) -> str:
    """Return the line of the examples that begins with some text, without what is said of it."""
    examples = "".join(found.group() for found in _BLOCK.finditer(_text()))
    lines = [_REMARK.sub("", text.strip()) for text in examples.splitlines()]
    (one,) = [text for text in lines if text.startswith(beginning)]
    return one


def word(pattern: str) -> str:
    """Return the group of a pattern that is found somewhere in the pages."""
    found = re.search(pattern, _text())
    assert found is not None, f"the manual does not say {pattern}"
    return found[1].rstrip("`.,")


def _text() -> str:
    return "\n".join((_MANUAL / page).read_text() for page in _PAGES)
