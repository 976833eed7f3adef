"""Parameter names: as people write them, as paths in the tree, and as Zenoh keys.

A path is the tuple of the parts of a global name; the root is the empty tuple. Parts may hold
whatever YAML keys may hold (spaces, ``*``, ``?``, ``#``, unicode), because ROS 1's parameter names
are looser than its graph names. Zenoh's keys are not: there, each forbidden character of a part is
written as ``%XX`` for each of its UTF-8 bytes.

Inside the store names are paths. Text becomes a path where it comes in (`split`), and a path
becomes text where people or the network see it (`joined`, `rosz.params.wire.join_path`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from itertools import takewhile
from typing import Final

from rosz import names
from rosz.errors import DecodeError, InvalidName, ParamError
from rosz.params.values import unsound_text

Path = tuple[str, ...]
ROOT: Final[Path] = ()

_FORBIDDEN: Final = re.compile(r"[%*$?#/@\x00-\x1f\x7f]")
_ESCAPED: Final = re.compile(rb"%([0-9A-F]{2})")


def split(name: str) -> Path:
    """Return the path of a global name; empty parts are ignored.

    Raises:
        InvalidName: The name is not global, too long, or holds half of a surrogate pair.
    """
    if not name.startswith("/"):
        raise InvalidName(name, "it is not global; expected it to start with '/'")
    names.check_length(name, names.LONGEST_PATH)
    reason = unsound_text(name)
    if reason:
        raise InvalidName(ascii(name)[1:-1], reason)
    return tuple(part for part in name.split("/") if part)


def to_path(name: str | Path) -> Path:
    """Return the path of a name that is given as global name or as path.

    Raises:
        InvalidName: The name is not global, too long, or holds half of a surrogate pair.
    """
    return split(name) if isinstance(name, str) else name


def joined(path: Path) -> str:
    """Return the global name of a path; the name of the root is ``/``."""
    return "/" + "/".join(path)


def common_path(paths: Iterable[Path]) -> Path:
    """Return the longest path that all paths lie at or below; the root if there are no paths."""
    every = list(paths) or [ROOT]
    both = zip(min(every), max(every), strict=False)
    return tuple(part for part, _ in takewhile(lambda parts: parts[0] == parts[1], both))


def resolve(name: str, node: str, remaps: Mapping[str, str] | None = None) -> str:
    """Resolve a parameter name as a node sees it, then apply the node's remappings.

    The rules are those of graph names, except that any character is allowed.

    Args:
        name: Global, relative or private name; the empty name means the node's namespace.
        node: Full name of the node.
        remaps: New name of each remapped name, both resolved.

    Raises:
        InvalidName: The name holds half of a surrogate pair.
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

    Only the first part of the name has to exist; the other parts are taken to belong there.

    Args:
        name: Relative name, or a global name, which is only looked up.
        node: Full name of the node to start at.
        exists: Function that tells whether a global name is set.

    Returns:
        The global name found, or ``None``.

    Raises:
        ParamError: The name is empty or private.
        InvalidName: The name holds half of a surrogate pair.
    """
    parts = () if name.startswith("~") else split(f"/{name}")
    if not parts:
        raise ParamError(f"cannot search for '{name}'; expected a relative or global name")
    if name.startswith("/"):
        resolved = joined(parts)
        return resolved if exists(resolved) else None
    spaces = [part for part in node.split("/") if part]
    for depth in range(len(spaces), -1, -1):
        above = spaces[:depth]
        if exists(joined((*above, parts[0]))):
            return joined((*above, *parts))
    return None


def to_key(path: Path) -> str:
    """Return a path as chunks of a Zenoh key; the root is the empty text."""
    return "/".join(_FORBIDDEN.sub(_escape, part) for part in path)


def from_key(key: str) -> Path:
    """Return the path that `to_key` wrote.

    Raises:
        DecodeError: `to_key` does not write this key; two keys must never mean one parameter.
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


def _escape(match: re.Match[str]) -> str:
    return "".join(f"%{byte:02X}" for byte in match[0].encode())


def _unescape(chunk: str) -> str:
    if "%" not in chunk:
        return chunk
    raw = chunk.encode()
    return _ESCAPED.sub(lambda match: bytes.fromhex(match[1].decode()), raw).decode()
