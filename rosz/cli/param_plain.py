"""Values that are written alike in YAML and in Python: most of them, and none needs a YAML parser.

Loading one takes longer than to ask for a value, or to set it.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rosz.params import Value

__all__ = ("plain", "read_plain")

_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_INTEGER = re.compile(r"0|-?[1-9][0-9]{0,17}", re.ASCII)
_FRACTION = re.compile(r"-?[0-9]{1,18}\.[0-9]{1,18}", re.ASCII)
_YAML_WORDS = frozenset({"yes", "no", "on", "off", "true", "false", "null", "y", "n"})


def plain(value: Value) -> str:
    """Return the line of a value that needs no YAML; empty for any other."""
    if isinstance(value, bool):
        return f"{value}\n".lower()
    if isinstance(value, int) or (isinstance(value, str) and _WORD.fullmatch(value)):
        return f"{value}\n" if str(value).lower() not in _YAML_WORDS else ""
    return ""


def read_plain(word: str) -> Value | None:
    """Return what a word means that needs no YAML; ``None`` for any other."""
    if _INTEGER.fullmatch(word):
        return int(word)
    if _FRACTION.fullmatch(word):
        return float(word)
    if word in {"true", "false"}:
        return word == "true"
    return word if _WORD.fullmatch(word) and word.lower() not in _YAML_WORDS else None
