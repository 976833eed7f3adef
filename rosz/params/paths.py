"""Names of parameters: as people write them, as paths in the tree, as Zenoh keys.

A path is the tuple of a global name's parts; the root is the empty one. Parts may hold whatever
YAML keys may (spaces, ``*``, ``?``, ``#``, unicode), for ROS 1's parameter names are looser than
its graph names. Zenoh's keys are not, so there a part's forbidden characters are written as the
``%XX`` of their UTF-8 bytes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Final

from rosz import names
from rosz.errors import DecodeError, InvalidName, ParamError
from rosz.params.values import unsound_text

__all__ = (
    "ROOT",
    "Path",
    "climb",
    "common",
    "from_key",
    "joined",
    "parent",
    "resolve",
    "split",
    "to_key",
)

Path = tuple[str, ...]
ROOT: Final[Path] = ()

_FORBIDDEN: Final = re.compile(r"[%*$?#/@\x00-\x1f\x7f]")
_ESCAPED: Final = re.compile(rb"%([0-9A-F]{2})")


def split(name: str) -> Path:
    """Return the path of a global name; empty parts count for nothing.

    Raises:
        InvalidName: The name holds a character that no text can, or is not global.
    """
    if not name.startswith("/"):
        raise InvalidName(name, "it is not global; expected it to start with '/'")
    reason = unsound_text(name)
    if reason:
        raise InvalidName(ascii(name)[1:-1], reason)
    return tuple(part for part in name.split("/") if part)


def joined(path: Path) -> str:
    """Return the global name of a path; the root's is ``/``."""
    return "/" + "/".join(path)


def parent(path: Path) -> Path:
    """Return the path one level up; the root's is the root."""
    return path[:-1]


def common(paths: Iterable[Path]) -> Path:
    """Return the longest path that all of some lie at or below; the root's, if there are none."""
    found = list(paths)
    if not found:
        return ROOT
    first, last = min(found), max(found)
    length = 0
    while length < min(len(first), len(last)) and first[length] == last[length]:
        length += 1
    return first[:length]


def resolve(name: str, node: str, remaps: Mapping[str, str] | None = None) -> str:
    """Resolve a parameter name as a node sees it, then apply the node's remappings.

    The rules are those of graph names, but any character may occur.

    Args:
        name: Global, relative or private; the empty one means the node's namespace.
        node: Full name of the node.
        remaps: Resolved name to resolved name.

    Raises:
        InvalidName: The name holds a character that no text can.
    """
    reason = unsound_text(name)
    if reason:
        raise InvalidName(ascii(name)[1:-1], reason)
    if not name:
        return names.namespace(node)
    if name.startswith("~"):
        resolved = names.canonical(f"{node}/{name[1:]}")
    elif name.startswith("/"):
        resolved = names.canonical(name) or "/"
    else:
        resolved = names.canonical(names.namespace(node) + name)
    return remaps.get(resolved, resolved) if remaps else resolved


def climb(name: str, node: str, exists: Callable[[str], bool]) -> str | None:
    """Search for a parameter from a node's own name upwards, as ROS 1's ``searchParam`` does.

    Only the first part of the name has to exist: what follows it is taken to belong there.

    Args:
        name: Relative name, or a global one, which is only looked up.
        node: Full name of the node to start at.
        exists: Tells whether a global name is set.

    Returns:
        The global name found, or ``None``.

    Raises:
        ParamError: The name is empty or private.
    """
    parts = [part for part in name.split("/") if part]
    if not parts or name.startswith("~"):
        raise ParamError(f"cannot search for '{name}'; expected a relative or global name")
    if name.startswith("/"):
        found = names.canonical(name)
        return found if exists(found) else None
    spaces = [part for part in node.split("/") if part]
    for depth in range(len(spaces), -1, -1):
        above = spaces[:depth]
        if exists(joined((*above, parts[0]))):
            return joined((*above, *parts))
    return None


def to_key(path: Path) -> str:
    """Return a path as chunks of a Zenoh key; the root's is empty."""
    return "/".join(_FORBIDDEN.sub(_escape, part) for part in path)


def from_key(key: str) -> Path:
    """Return the path that `to_key` wrote.

    Raises:
        DecodeError: The key is not of that form; two keys must never mean one parameter.
    """
    if not key:
        return ROOT
    try:
        path = tuple(_unescape(chunk) for chunk in key.split("/"))
    except UnicodeDecodeError as error:
        raise DecodeError("parameter key", error.start, f"'{key}' is not UTF-8") from error
    if "" in path or to_key(path) != key:
        raise DecodeError("parameter key", -1, f"'{key}', expected '{to_key(path)}'")
    return path


def _escape(found: re.Match[str]) -> str:
    return "".join(f"%{byte:02X}" for byte in found[0].encode())


def _unescape(chunk: str) -> str:
    if "%" not in chunk:
        return chunk
    raw = chunk.encode()
    return _ESCAPED.sub(lambda found: bytes.fromhex(found[1].decode()), raw).decode()
