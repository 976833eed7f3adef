"""Parameters as YAML, read and written as ROS 1's rosparam does.

YAML 1.1 by PyYAML's safe rules, with angles (`rosz.params.angles`), ``!!binary``, timestamps,
several documents, and ``_ns`` naming the namespace of a document. What rosparam only notices when
the parameter server refuses it (null, keys that are no text, numbers that do not fit) is an error
here, with its place, and so is a document whose aliases unfold to a size out of all proportion.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator
from typing import Any, Final

import yaml

from rosz.errors import ParamError, YamlError
from rosz.params import angles
from rosz.params.nodes import SCALAR_FAULTS, fault, read_nodes, shown_tag
from rosz.params.values import Value, normalise, type_name

__all__ = ("dump", "format_get", "inline", "load", "load_all", "load_documents", "pretty")

_NAMESPACE_KEY: Final = "_ns"
_MAP: Final = "tag:yaml.org,2002:map"
_SEQ: Final = "tag:yaml.org,2002:seq"
_BINARY: Final = "tag:yaml.org,2002:binary"
_STR: Final = "tag:yaml.org,2002:str"
_MERGE: Final = "tag:yaml.org,2002:merge"
_VALUE: Final = "tag:yaml.org,2002:value"
_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_Base):  # type: ignore[misc]  # either of two base classes
    """PyYAML's safe loader with rosparam's tags."""


class _Dumper(yaml.SafeDumper):
    """PyYAML's safe dumper, which never refers to a value by an anchor."""

    def ignore_aliases(self, _data: Any) -> bool:
        return True


class _LineDumper(_Dumper):
    """Keeps what has several lines on one."""

    def represent_text(self, data: str) -> Any:
        return self.represent_scalar(_STR, data, style='"' if "\n" in data else None)

    def represent_bytes(self, data: bytes) -> Any:
        return self.represent_scalar(_BINARY, base64.b64encode(data).decode(), style='"')


_LineDumper.add_representer(str, _LineDumper.represent_text)
_LineDumper.add_representer(bytes, _LineDumper.represent_bytes)


def load_all(text: str, path: str = "<string>") -> list[Value]:
    """Read all documents of a text.

    Args:
        text: YAML.
        path: Where it is from, for messages.

    Raises:
        YamlError: It is no YAML, or holds what no parameter can.
    """
    return [value for value, _ in _read(text, path)]


def load(text: str, path: str = "<string>") -> Value:
    """Read a text of one document; the empty text is the empty string, as for rosparam.

    Raises:
        YamlError: It is no YAML, holds what no parameter can, or has not one document.
    """
    if not text:
        return ""
    found = list(_read(text, path))
    if len(found) > 1:
        raise YamlError(f"{len(found)} documents, expected one", path, found[1][1] + 1, 1)
    if not found:
        raise YamlError("nothing but comments and space; expected a value", path)
    return found[0][0]


def load_documents(
    text: str, namespace: str = "/", path: str = "<string>"
) -> list[tuple[str, Value]]:
    """Read the documents of a parameter file, each with the namespace it belongs to.

    Args:
        text: YAML.
        namespace: Global namespace; a document's ``_ns`` goes below it, or replaces it if global.
        path: Where it is from, for messages.

    Returns:
        Namespace and value of each document, ``_ns`` taken out; a value need not be a dict.

    Raises:
        YamlError: It is no YAML, or holds what no parameter can.
    """
    found: list[tuple[str, Value]] = []
    for value, line in _read(text, path):
        space = namespace
        if type(value) is dict and _NAMESPACE_KEY in value:
            inner = value.pop(_NAMESPACE_KEY)
            if type(inner) is not str or inner.startswith("~"):
                raise YamlError(
                    f"_ns is {inner!r}, expected the name of a namespace", path, line + 1, 1
                )
            space = inner if inner.startswith("/") else f"{namespace.rstrip('/')}/{inner}"
        found.append((space, value))
    return found


def dump(value: Value) -> str:
    """Write a value as a YAML document, keys sorted, as rosparam does."""
    return str(yaml.dump(value, Dumper=_Dumper, default_flow_style=False))


def format_get(value: Value) -> str:
    """Write a value as ``rosparam get`` prints it: without the mark that ends a lone scalar."""
    return dump(value).removesuffix("\n...\n") + "\n"


def inline(value: Value) -> str:
    """Write a value as YAML on one line."""
    text = yaml.dump(value, Dumper=_LineDumper, default_flow_style=True, width=math.inf)
    return str(text).removesuffix("\n").removesuffix("\n...")


def pretty(value: Value) -> str:
    """Write a value as ``rosparam get -p`` prints it: for reading, not for loading."""
    if type(value) is str:
        return value + "\n"
    if type(value) is dict:
        return "".join(_pretty_lines(value, ""))
    return format_get(value)


def _pretty_lines(tree: dict[str, Value], indent: str) -> Iterator[str]:
    for key, value in sorted(tree.items()):
        if type(value) is dict:
            yield f"{indent}{key}:\n"
            yield from _pretty_lines(value, indent + "  ")
        elif type(value) is str and "\n" in value:
            yield f"{indent}{key}: |\n"
            yield from (f"{indent}  {line}\n" for line in value.split("\n"))
        elif type(value) is str:
            yield f"{indent}{key}: {value}\n"
        else:
            text = dump(value).removesuffix("...\n")
            yield f"{indent}{key}: {text}"


def _read(text: str, path: str) -> Iterator[tuple[Value, int]]:
    """Yield the value of each document and the line, from 0, that it starts on."""
    for loader, node in read_nodes(_Loader, text, path):
        yield _Builder(loader, path).build(node), node.start_mark.line


class _Builder:
    """Makes the value of one document from its nodes, which know their places."""

    def __init__(self, loader: Any, path: str) -> None:
        self._loader = loader
        self._path = path
        self._open: set[int] = set()

    def build(self, node: Any) -> Value:
        """Return the value of a node."""
        if node.tag == _STR and isinstance(node, yaml.ScalarNode) and node.value.isascii():
            return node.value
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node)
        if id(node) in self._open:
            raise self._error(node, "it contains itself")
        self._open.add(id(node))
        if node.tag == _SEQ and isinstance(node, yaml.SequenceNode):
            value: Value = [self.build(item) for item in node.value]
        elif node.tag == _MAP and isinstance(node, yaml.MappingNode):
            value = self._mapping(node)
        else:
            raise self._error(node, f"the tag '{shown_tag(node)}' means nothing for a parameter")
        self._open.discard(id(node))
        return value

    def _scalar(self, node: Any) -> Value:
        try:
            value = self._loader.construct_object(node, deep=True)
            return normalise(value)
        except yaml.MarkedYAMLError as error:
            raise self._error(node, str(error.problem)) from error
        except ParamError as error:
            raise self._error(node, str(error)) from error
        except SCALAR_FAULTS as error:
            reason = f"'{node.value}' is no {shown_tag(node)}: {error}"
            raise self._error(node, reason) from error

    def _mapping(self, node: Any) -> dict[str, Value]:
        merged: dict[str, Value] = {}
        own: dict[str, Value] = {}
        for key_node, value_node in node.value:
            if key_node.tag == _MERGE:
                self._merge(merged, value_node)
            else:
                own[self._key(key_node)] = self.build(value_node)
        return {**merged, **own} if merged else own

    def _merge(self, into: dict[str, Value], node: Any) -> None:
        parts = node.value[::-1] if isinstance(node, yaml.SequenceNode) else [node]
        for part in parts:
            if not isinstance(part, yaml.MappingNode):
                raise self._error(part, "'<<' takes a mapping, or a list of mappings")
            into.update(self.build(part))

    def _key(self, node: Any) -> str:
        if node.tag == _VALUE:
            return str(node.value)
        key = self.build(node)
        if type(key) is not str:
            raise self._error(
                node,
                f"the key {key!r} is {type_name(key)}: dictionaries must have string keys; "
                "put it in quotes if it is a name",
            )
        return key

    def _error(self, node: Any, reason: str) -> YamlError:
        return fault(node, reason, self._path)


def _degrees(loader: Any, node: Any) -> float:
    return angles.degrees(loader.construct_scalar(node))


def _radians(loader: Any, node: Any) -> float:
    return angles.radians(loader.construct_scalar(node))


def _register() -> None:
    import re

    _Loader.add_constructor("!degrees", _degrees)
    _Loader.add_constructor("!radians", _radians)
    _Loader.add_implicit_resolver("!degrees", re.compile(r"^deg\([^\)]*\)$"), ["d"])
    _Loader.add_implicit_resolver("!radians", re.compile(r"^rad\([^\)]*\)$"), ["r"])


_register()
