"""Parameters as YAML, read and written as ROS 1's rosparam does.

The text is YAML 1.1 by PyYAML's safe rules, with angles, ``!!binary``, timestamps, several
documents, and ``_ns`` as the namespace of a document. Values that rosparam leaves to the parameter
server to refuse (null, keys that are not text, numbers that do not fit) are an error here that
names their position, and so is a document whose aliases repeat too much.

Angles are written ``deg(90)``, ``rad(pi/2)``, ``!degrees 90`` or ``!radians 2*pi``. rosparam
evaluates the text of a radian as Python. Here it may hold only numbers, ``pi``, the operators
``+ - * / // % **``, parentheses, and functions and constants of ``math``.
"""

from __future__ import annotations

import base64
import math
import operator
import re
from collections.abc import Callable, Iterator
from typing import Any, Final

import yaml

from rosz.errors import ParamError, YamlError
from rosz.params.values import Value, normalise, type_name
from rosz.params.yaml_nodes import SCALAR_FAULTS, fault, read_nodes, shown_tag

__all__ = (
    "degrees",
    "dump",
    "format_get",
    "inline",
    "load",
    "load_all",
    "load_documents",
    "pretty",
    "radians",
)

_NAMESPACE_KEY: Final = "_ns"
_MAP: Final = "tag:yaml.org,2002:map"
_SEQ: Final = "tag:yaml.org,2002:seq"
_BINARY: Final = "tag:yaml.org,2002:binary"
_STR: Final = "tag:yaml.org,2002:str"
_MERGE: Final = "tag:yaml.org,2002:merge"
_VALUE: Final = "tag:yaml.org,2002:value"
_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

_MAX_ANGLE: Final = 200
"""Characters of the text of an angle; a longer one could overflow Python's parser."""

_BINARY_OPERATORS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "Add": operator.add,
    "Sub": operator.sub,
    "Mult": operator.mul,
    "Div": operator.truediv,
    "FloorDiv": operator.floordiv,
    "Mod": operator.mod,
    "Pow": operator.pow,
}
_UNARY_OPERATORS: Final[dict[str, Callable[[Any], Any]]] = {
    "UAdd": operator.pos,
    "USub": operator.neg,
}


class _Loader(_Base):  # type: ignore[misc]  # either of two base classes
    """PyYAML's safe loader with rosparam's tags."""


class _Dumper(yaml.SafeDumper):
    """PyYAML's safe dumper without anchors."""

    def ignore_aliases(self, _data: Any) -> bool:
        return True


class _LineDumper(_Dumper):
    """A dumper that writes texts of several lines on one line."""

    def represent_text(self, data: str) -> Any:
        return self.represent_scalar(_STR, data, style='"' if "\n" in data else None)

    def represent_bytes(self, data: bytes) -> Any:
        return self.represent_scalar(_BINARY, base64.b64encode(data).decode(), style='"')


_LineDumper.add_representer(str, _LineDumper.represent_text)
_LineDumper.add_representer(bytes, _LineDumper.represent_bytes)


def load_all(text: str, path: str = "<string>") -> list[Value]:
    """Return the values of all documents of a text.

    Args:
        text: YAML text.
        path: File that the text is from, for error messages.

    Raises:
        YamlError: The text is not YAML, or holds a value that a parameter cannot hold.
    """
    return [value for value, _ in _read(text, path)]


def load(text: str, path: str = "<string>") -> Value:
    """Return the value of a text of one document; empty text is the empty string, as in rosparam.

    Raises:
        YamlError: The text is not YAML, holds a value that a parameter cannot hold, or does not
            have exactly one document.
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
    """Return the documents of a parameter file, each with its namespace.

    Args:
        text: YAML text.
        namespace: Global namespace. The ``_ns`` of a document is appended, or replaces it if
            global.
        path: File that the text is from, for error messages.

    Returns:
        Namespace and value of each document, without ``_ns``; a value may be other than a dict.

    Raises:
        YamlError: The text is not YAML, or holds a value that a parameter cannot hold.
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
    """Return a value as a YAML document with sorted keys, as rosparam writes it."""
    return str(yaml.dump(value, Dumper=_Dumper, default_flow_style=False))


def format_get(value: Value) -> str:
    """Return a value as ``rosparam get`` prints it: without the mark at the end of a scalar."""
    return dump(value).removesuffix("\n...\n") + "\n"


def inline(value: Value) -> str:
    """Return a value as YAML on one line."""
    text = yaml.dump(value, Dumper=_LineDumper, default_flow_style=True, width=math.inf)
    return str(text).removesuffix("\n").removesuffix("\n...")


def pretty(value: Value) -> str:
    """Return a value as ``rosparam get -p`` prints it: for people, not for loading."""
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
    """Yield the value of each document and the line that it starts on, counted from 0."""
    for loader, node in read_nodes(_Loader, text, path):
        yield _Builder(loader, path).build(node), node.start_mark.line


class _Builder:
    """Builder of the value of one document from its nodes."""

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
            reason = f"'{node.value}' is not a {shown_tag(node)}: {error}"
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


def degrees(text: str) -> float:
    """Return an angle in degrees, such as ``90`` or ``deg(90)``, in radians.

    Raises:
        ValueError: The text is not a number.
    """
    inner = text.strip()[4:-1] if text.startswith("deg(") else text
    try:
        return float(inner) * math.pi / 180.0
    except ValueError:
        raise ValueError(f"'{text}' is not an angle in degrees; expected a number") from None


def radians(text: str) -> float:
    """Return an angle in radians, such as ``pi/2`` or ``rad(pi/2)``.

    Raises:
        ValueError: The text is not arithmetic, or has no finite real value.
    """
    stripped = text.strip()
    inner = stripped[4:-1].strip() if stripped.startswith("rad(") else stripped
    try:
        return float(_evaluate(_parse(inner)))
    except (ArithmeticError, SyntaxError, TypeError, ValueError):
        raise ValueError(
            f"'{text}' is not an angle in radians; expected arithmetic with numbers and pi"
        ) from None


def _parse(text: str) -> Any:
    """Return the node of Python's syntax tree for an expression."""
    import ast

    if len(text) > _MAX_ANGLE:
        raise ValueError
    return ast.parse(text, mode="eval").body


def _evaluate(node: Any) -> float:
    """Return the value of a node of Python's syntax tree."""
    match type(node).__name__:
        case "Constant" if isinstance(node.value, (int, float)):
            return float(node.value)
        case "Name" if node.id == "pi":
            return math.pi
        case "UnaryOp" if unary := _UNARY_OPERATORS.get(type(node.op).__name__):
            return float(unary(_evaluate(node.operand)))
        case "BinOp" if binary := _BINARY_OPERATORS.get(type(node.op).__name__):
            return float(binary(_evaluate(node.left), _evaluate(node.right)))
        case "Call" if not node.keywords:
            return float(_of_math(node.func)(*map(_evaluate, node.args)))
    return float(_of_math(node))


def _of_math(node: Any) -> Any:
    """Return the function or constant that ``math.<name>`` means.

    Raises:
        ValueError: The node is something else.
    """
    attribute = getattr(node, "attr", "_")
    if getattr(getattr(node, "value", None), "id", "") != "math" or attribute.startswith("_"):
        raise ValueError
    found = getattr(math, attribute, None)
    if found is None:
        raise ValueError
    return found


_Loader.add_constructor("!degrees", lambda loader, node: degrees(loader.construct_scalar(node)))
_Loader.add_constructor("!radians", lambda loader, node: radians(loader.construct_scalar(node)))
_Loader.add_implicit_resolver("!degrees", re.compile(r"^deg\([^\)]*\)$"), ["d"])
_Loader.add_implicit_resolver("!radians", re.compile(r"^rad\([^\)]*\)$"), ["r"])
