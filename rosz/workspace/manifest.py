"""Check a package.xml (REP 127, REP 140, REP 149)."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from xml.parsers import expat

import msgspec

from rosz.packages import MANIFEST
from rosz.workspace.problem import Problem, error, warning

__all__ = ("check_manifest",)

_NAME = re.compile(r"[a-z][a-z0-9_-]*", re.ASCII)
_VERSION = re.compile(r"\d+\.\d+\.\d+", re.ASCII)
_REQUIRED = ("name", "version", "description", "maintainer", "license")
_ONCE = ("name", "version", "description")
_FORMATS = ("1", "2", "3")
_SINCE_2 = frozenset({"depend", "build_export_depend", "exec_depend", "doc_depend"})
_ONLY_1 = frozenset({"run_depend"})


class _Tag(msgspec.Struct):
    name: str
    attributes: dict[str, str]
    line: int
    column: int
    text: str = ""


def check_manifest(folder: Path) -> Iterator[Problem]:
    """Yield the problems of the package.xml of a package."""
    path = folder / MANIFEST
    try:
        tags = _read(path.read_bytes())
    except expat.ExpatError as fault:
        reason = f"not well-formed XML: {expat.ErrorString(fault.code)}"
        yield error(path, reason, fault.lineno, fault.offset + 1)
        return
    except OSError as fault:
        yield error(path, f"cannot be read: {fault.strerror}")
        return
    root, *rest = tags
    if root.name != "package":
        yield error(path, f"expected <package>, got <{root.name}>", root.line, root.column)
        return
    yield from _check_tags(path, root, rest)
    for tag in rest:
        yield from _check_value(path, folder, tag)


def _check_tags(path: Path, root: _Tag, tags: list[_Tag]) -> Iterator[Problem]:
    """Yield the tags that are missing, or present too often."""
    counts = Counter(tag.name for tag in tags)
    for name in _REQUIRED:
        if not counts[name]:
            # rospack and rosz need only the name of a package; catkin requires all of them.
            make = error if name == "name" else warning
            yield make(path, f"<{name}> is missing", root.line, root.column)
    for name in _ONCE:
        if counts[name] > 1:
            again = [tag for tag in tags if tag.name == name][1]
            yield error(path, f"<{name}> is there {counts[name]} times", again.line, again.column)
    form = root.attributes.get("format", "1")
    if form not in _FORMATS:
        text = f"format is '{form}'; expected one of {', '.join(_FORMATS)}"
        yield error(path, text, root.line, root.column)
    for tag in tags:
        if tag.name in (_SINCE_2 if form == "1" else _ONLY_1):
            hint = (
                'write <package format="2">' if form == "1" else "write <exec_depend>, or <depend>"
            )
            text = f"<{tag.name}> does not exist in format {form}: {hint}"
            yield warning(path, text, tag.line, tag.column)


def _check_value(path: Path, folder: Path, tag: _Tag) -> Iterator[Problem]:
    text = tag.text.strip()
    if tag.name in {*_REQUIRED, *_SINCE_2, *_ONLY_1} and not text:
        yield error(path, f"<{tag.name}> is empty", tag.line, tag.column)
    elif tag.name == "name":
        if not _NAME.fullmatch(text):
            reason = f"'{text}' is not a good name: use lower-case letters, digits and '_'"
            yield warning(path, reason, tag.line, tag.column)
        if text != folder.name:
            reason = f"the package is called '{text}', its folder '{folder.name}'"
            yield warning(path, reason, tag.line, tag.column)
    elif tag.name == "version" and not _VERSION.fullmatch(text):
        reason = f"version is '{text}'; expected three numbers such as 0.1.0"
        yield warning(path, reason, tag.line, tag.column)
    elif tag.name == "maintainer" and "@" not in tag.attributes.get("email", ""):
        yield warning(path, "<maintainer> has no email address", tag.line, tag.column)


def _read(data: bytes) -> list[_Tag]:
    """Return the root and its children, with their text and position."""
    parser = expat.ParserCreate()
    tags: list[_Tag] = []
    open_tags: list[_Tag] = []

    def start(name: str, attributes: dict[str, str]) -> None:
        place = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        tag = _Tag(name, attributes, *place)
        if len(open_tags) <= 1:
            tags.append(tag)
        open_tags.append(tag)

    def characters(text: str) -> None:
        for tag in open_tags[1:]:
            tag.text += text

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: open_tags.pop()
    parser.CharacterDataHandler = characters
    parser.Parse(data, True)
    return tags
