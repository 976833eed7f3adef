"""Breaks long lines of generated code where Python lets them be broken."""

from __future__ import annotations

import re

__all__ = ("wrap",)

_WIDTH = 100
_TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|[\[\](){}]|, |[^"\[\](){},]+|,')
_TARGETS = re.compile(r"( *)(\w+(?:, \w+)+) = (.+)")
_CONDITION = re.compile(r"( *)if (.+ or .+):")


def wrap(line: str) -> list[str]:
    """Break a line, if it is too long: at ``or``, or at commas inside of brackets."""
    if len(line) <= _WIDTH or line.lstrip().startswith(('"', "#")):
        return [line]
    condition = _CONDITION.fullmatch(line)
    if condition:
        first, *rest = condition[2].split(" or ")
        indent = condition[1]
        parts = [f"{indent}    {first}", *(f"{indent}    or {part}" for part in rest)]
        return [f"{indent}if (", *parts, f"{indent}):"]
    targets = _TARGETS.fullmatch(line)
    if targets:  # a tuple without brackets gets some
        line = f"{targets[1]}({targets[2]}) = {targets[3]}"
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    lines: list[str] = []
    current: list[tuple[str, int]] = []
    for chunk in _chunks(line):
        current.append(chunk)
        while len(current) > 1 and sum(len(text) for text, _ in current) > _WIDTH:
            cut = _best_cut(current)
            lines.append("".join(text for text, _ in current[:cut]).rstrip())
            current = [(indent, 99), *current[cut:]]
            if len(current) == 2:  # noqa: PLR2004  # the indentation and one piece: as it is
                break
    return [*lines, "".join(text for text, _ in current)]


def _chunks(line: str) -> list[tuple[str, int]]:
    """Cut a line behind each comma; return the pieces with the depth of brackets at their ends."""
    chunks: list[tuple[str, int]] = []
    current = ""
    depth = 0
    for part in _TOKEN.findall(line):
        current += part
        if len(part) == 1:
            depth += (part in "([{") - (part in ")]}")
        elif part == ", " and depth:
            chunks.append((current, depth))
            current = ""
    return [*chunks, (current, 99)]


def _best_cut(chunks: list[tuple[str, int]]) -> int:
    """Return behind which piece to break: outside as far as possible, then late."""
    cuts = range(1, len(chunks))
    return min(cuts, key=lambda cut: (chunks[cut - 1][1], -cut))
