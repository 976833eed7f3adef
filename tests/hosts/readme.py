"""What README's section on several machines tells people to type."""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import dedent

__all__ = ("block", "line", "word")

_README = Path(__file__).parents[2] / "README.md"
_SECTION = re.compile(r"^## Several machines\n(.*?)^## ", re.MULTILINE | re.DOTALL)
_BLOCK = re.compile(r"(?:^    .*\n|^\n(?=    ))+", re.MULTILINE)
_REMARK = re.compile(r"   +\S.*")


def block(beginning: str) -> str:
    """Return the example that begins with some text."""
    blocks = [dedent(found.group()).strip("\n") for found in _BLOCK.finditer(_section())]
    (one,) = [text for text in blocks if text.startswith(beginning)]
    return one + "\n"


def line(beginning: str) -> str:
    """Return the line of the examples that begins with some text, without what is said of it."""
    examples = "".join(found.group() for found in _BLOCK.finditer(_section()))
    lines = [_REMARK.sub("", text.strip()) for text in examples.splitlines()]
    (one,) = [text for text in lines if text.startswith(beginning)]
    return one


def word(pattern: str) -> str:
    """Return the group of a pattern that is found somewhere in the section."""
    found = re.search(pattern, _section())
    assert found is not None, f"README does not say {pattern}"
    return found[1].rstrip("`.,")


def _section() -> str:
    found = _SECTION.search(_README.read_text())
    assert found is not None, "README has no section 'Several machines'"
    return found[1]
