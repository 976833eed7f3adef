"""Parameters as YAML, read and written as ROS 1's rosparam does.

The text is YAML 1.1 by PyYAML's safe rules, with angles, ``!!binary``, timestamps, several
documents, and ``_ns`` as the namespace of a document. Values that rosparam leaves to the parameter
server to refuse (null, keys that are not text, numbers that do not fit) are an error here that
names their position, and so is a document whose aliases repeat too much.

Angles are written ``deg(90)``, ``rad(pi/2)``, ``!degrees 90`` or ``!radians 2*pi``. rosparam
evaluates the text of a radian as Python. Here it may hold only numbers, ``pi``, the operators
``+ - * / // % **``, parentheses, and functions and constants of ``math``.

PyYAML's composer in C recurses over nested text, so a few thousand brackets crash the process. The
loaders here compose with the one in Python, from the events of the parser in C, and limit the depth
and the number of values that aliases repeat.
"""

from __future__ import annotations

import binascii
import itertools
import math
import operator
import re
from collections.abc import Callable, Iterator
from typing import Any, Final

import yaml

from rosz.errors import ParamError, YamlError
from rosz.params.ros2_file import assign
from rosz.params.values import MAX_DEPTH, Value, copy, normalise, type_name, unsound_text

_NAMESPACE_KEY: Final = "_ns"
_MAP: Final = "tag:yaml.org,2002:map"
_SEQ: Final = "tag:yaml.org,2002:seq"
_BINARY: Final = "tag:yaml.org,2002:binary"
_STR: Final = "tag:yaml.org,2002:str"
_NULL: Final = "tag:yaml.org,2002:null"
_Composer: Any = yaml.composer.Composer
_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_BASES: Any = (_Base,) if issubclass(_Base, _Composer) else (_Composer, _Base)

_MAX_ANGLE: Final = 200
"""Characters of the text of an angle; a longer one could overflow Python's parser."""

_TOO_DEEP: Final = f"it is nested more than {MAX_DEPTH} deep"

_SCALAR_FAULTS: Final = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""Exceptions that PyYAML raises when a scalar does not fit its tag."""

_MOST_REPEATED: Final = 100_000
"""Values that aliases may add to a document; a document that adds more is refused as an attack."""

_OPERATORS: Final[dict[str, Callable[..., Any]]] = {
    "Add": operator.add,
    "Sub": operator.sub,
    "Mult": operator.mul,
    "Div": operator.truediv,
    "FloorDiv": operator.floordiv,
    "Mod": operator.mod,
    "Pow": operator.pow,
    "UAdd": operator.pos,
    "USub": operator.neg,
}


class _Loader(*_BASES):  # type: ignore[misc]  # PyYAML has no types
    """PyYAML's safe loader with limits, which names the place of what it refuses."""

    def __init__(self, text: str) -> None:
        _Base.__init__(self, text)
        self.anchors: dict[str, Any] = {}
        self._depth = -1  # of the outermost values it is 0
        self._repeated = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.peek_event()
        if parent is None:  # a document begins
            self._repeated = 0
        if isinstance(event, yaml.AliasEvent):
            return self._repeat(self.get_event())
        if event.anchor in self.anchors:
            raise _fault(event, f"the anchor '&{event.anchor}' is taken")
        if self._depth == MAX_DEPTH:
            raise _fault(event, _TOO_DEEP)
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def _repeat(self, alias: Any) -> Any:
        node = self.anchors.get(alias.anchor)
        if node is None:
            raise _fault(alias, f"the alias '*{alias.anchor}' names no anchor")
        if node.end_mark is None:  # the alias stands inside
            raise _fault(node, "it contains itself")
        size, height = _measure(node)
        if self._depth + 1 + height > MAX_DEPTH:
            raise _fault(alias, _TOO_DEEP)
        self._repeated += size
        if self._repeated > _MOST_REPEATED:
            raise _fault(
                alias,
                f"aliases repeat more than {_MOST_REPEATED} values: this looks like a YAML bomb; "
                "write them out if it is not",
            )
        return node

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except _SCALAR_FAULTS as error:
            if not isinstance(node, yaml.ScalarNode):
                raise
            raise _fault(node, f"'{node.value}' is not a {_shown_tag(node)}: {error}") from error


class _ValueLoader(_Loader):
    """A loader of values of parameters, with rosparam's tags."""

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        if isinstance(node, yaml.ScalarNode):
            if node.tag == _STR and node.value.isascii():
                return node.value
            value = super().construct_object(node, deep=True)
            try:
                return normalise(value)
            except ParamError as error:
                raise _fault(node, str(error)) from error
        if node.tag != (_SEQ if isinstance(node, yaml.SequenceNode) else _MAP):
            raise _fault(node, f"the tag '{_shown_tag(node)}' means nothing for a parameter")
        return super().construct_object(node, deep)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[str, Value]:
        if not isinstance(node, yaml.MappingNode):  # a scalar with the tag of a dict
            return dict(super().construct_mapping(node, deep))  # raises
        self.flatten_mapping(node)
        return {
            self._construct_key(key): self.construct_object(value, deep)
            for key, value in node.value
        }

    def _construct_key(self, node: Any) -> str:
        key = self.construct_object(node, deep=True)
        if type(key) is not str:
            raise _fault(
                node,
                f"the key {key!r} is {type_name(key)}: dictionaries must have string keys; "
                "put it in quotes if it is a name",
            )
        return key


class _Dumper(yaml.SafeDumper):
    """PyYAML's safe dumper without anchors."""

    def ignore_aliases(self, _data: Any) -> bool:
        return True


class _LineDumper(_Dumper):
    """A dumper that writes texts of several lines on one line."""

    def represent_text(self, data: str) -> Any:
        return self.represent_scalar(_STR, data, style='"' if "\n" in data else None)

    def represent_bytes(self, data: bytes) -> Any:
        return self.represent_scalar(
            _BINARY, binascii.b2a_base64(data, newline=False).decode(), style='"'
        )


_LineDumper.add_representer(str, _LineDumper.represent_text)
_LineDumper.add_representer(bytes, _LineDumper.represent_bytes)


def load_all(text: str, path: str = "<string>", *, null_as_empty: bool = False) -> list[Value]:
    """Return the values of all documents of a text.

    Args:
        text: YAML text.
        path: File that the text is from, for error messages.
        null_as_empty: Whether a document that is null is an empty dict, as for ``roslaunch``.

    Raises:
        YamlError: The text is not YAML, or holds a value that a parameter cannot hold.
    """
    return [value for value, _ in _read(text, path, null_as_empty=null_as_empty)]


def load(text: str, path: str = "<string>") -> Value:
    """Return the value of a text of one document; empty text is the empty string, as in rosparam.

    Raises:
        YamlError: The text is not YAML, holds a value that a parameter cannot hold, or does not
            have exactly one document.
    """
    if not text:
        return ""
    documents = list(_read(text, path))
    if len(documents) > 1:
        raise YamlError(f"{len(documents)} documents, expected one", path, documents[1][1] + 1, 1)
    if not documents:
        raise YamlError("nothing but comments and space; expected a value", path)
    return documents[0][0]


def load_documents(
    text: str, namespace: str = "/", path: str = "<string>"
) -> list[tuple[str, Value]]:
    """Return the documents of a parameter file, each with its namespace.

    A document in the form of ROS 2 gives one entry for each node (`rosz.params.ros2_file`).

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
    documents: list[tuple[str, Value]] = []
    for value, line in _read(text, path):
        space = namespace
        if type(value) is dict and _NAMESPACE_KEY in value:
            inner = value.pop(_NAMESPACE_KEY)
            if type(inner) is not str or inner.startswith("~"):
                raise YamlError(
                    f"_ns is {inner!r}, expected the name of a namespace", path, line + 1, 1
                )
            space = inner if inner.startswith("/") else f"{namespace.rstrip('/')}/{inner}"
        try:
            documents += assign(value, space)
        except ParamError as error:
            raise YamlError(str(error), path, line + 1, 1) from error
    return documents


def read_plain(text: str, path: str) -> Iterator[Any]:
    """Yield the content of each document of a text, by PyYAML's safe rules.

    Args:
        text: YAML text.
        path: File that the text is from, for error messages.

    Raises:
        YamlError: The text is not YAML or is nested too deep, or a value does not fit its tag.
    """
    return (content for content, _ in _load(_Loader, text, path))


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


def _read(text: str, path: str, *, null_as_empty: bool = False) -> Iterator[tuple[Value, int]]:
    """Yield the value of each document and the line that it starts on, counted from 0."""
    for value, line in _load(_ValueLoader, text, path, null_as_empty=null_as_empty):
        yield copy(value), line  # aliases become copies


def _load(
    loader_class: Any, text: str, path: str, *, null_as_empty: bool = False
) -> Iterator[tuple[Any, int]]:
    """Yield the content of each document and the line that it starts on, counted from 0."""
    reason = unsound_text(text)
    if reason:
        raise YamlError(reason, path)
    loader = loader_class(text)
    try:
        while loader.check_node():
            node = loader.get_node()
            is_empty = null_as_empty and node.tag == _NULL
            yield {} if is_empty else loader.construct_document(node), node.start_mark.line
    except yaml.reader.ReaderError as error:
        line, column = _place(text, int(error.position))
        reason = f"the character {_shown(error.character)} is not allowed in YAML; write it escaped"
        raise YamlError(reason, path, line, column) from error
    except yaml.MarkedYAMLError as error:
        reason = ", ".join(filter(None, (error.context, error.problem))) or "it is not YAML"
        mark = error.problem_mark or error.context_mark
        if "nesting depth" in reason:
            reason, mark = _TOO_DEEP, _too_deep(text)
        place = () if mark is None else (mark.line + 1, mark.column + 1)
        raise YamlError(reason, path, *place) from error
    finally:
        loader.dispose()


def _too_deep(text: str) -> Any:
    """Return the mark at which a text that libyaml refuses for its depth is too deep.

    Its scanner, which reads ahead, refuses 1000 levels (in PyYAML 6.0.4) before the composer has
    seen the limit of rosz. PyYAML's own parser has no such limit, and reads as far as that.
    """
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH + 1:  # the outermost collection has the depth 0
            return event.start_mark
    return None


def _measure(node: Any) -> tuple[int, int]:
    """Return the number of values in a node, with those that aliases repeat, and its height."""
    if isinstance(node, yaml.ScalarNode):
        return 1, 0
    inner = node.value
    if isinstance(node, yaml.MappingNode):
        inner = itertools.chain.from_iterable(inner)
    sizes, heights = zip((0, -1), *map(_measure, inner), strict=True)
    return 1 + sum(sizes), 1 + max(heights)


def _place(text: str, position: int) -> tuple[int, int]:
    before = text[:position]
    return before.count("\n") + 1, position - (before.rfind("\n") + 1) + 1


def _shown(character: object) -> str:
    return f"U+{character:04X}" if isinstance(character, int) else ascii(character)


def _fault(place: Any, reason: str) -> yaml.MarkedYAMLError:
    """Return PyYAML's error for a reason at the start of a node or event."""
    return yaml.constructor.ConstructorError(problem=reason, problem_mark=place.start_mark)


def _shown_tag(node: Any) -> str:
    """Return the tag of a node in YAML's short form."""
    return str(node.tag.replace("tag:yaml.org,2002:", "!!"))


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
        case "UnaryOp" if unary := _OPERATORS.get(type(node.op).__name__):
            return float(unary(_evaluate(node.operand)))
        case "BinOp" if binary := _OPERATORS.get(type(node.op).__name__):
            return float(binary(_evaluate(node.left), _evaluate(node.right)))
        case "Call" if not node.keywords:
            return float(_of_math(node.func)(*map(_evaluate, node.args)))
    return float(_of_math(node))


def _of_math(node: Any) -> Any:
    """Return the function or constant that ``math.<name>`` means."""
    attribute = getattr(node, "attr", "_")
    if getattr(getattr(node, "value", None), "id", "") != "math" or attribute.startswith("_"):
        raise ValueError
    member = getattr(math, attribute, None)
    if member is None:
        raise ValueError
    return member


_ValueLoader.add_constructor(
    "!degrees", lambda loader, node: degrees(loader.construct_scalar(node))
)
_ValueLoader.add_constructor(
    "!radians", lambda loader, node: radians(loader.construct_scalar(node))
)
for _class in (_ValueLoader, _Dumper):  # a text that looks like an angle is written in quotes
    _class.add_implicit_resolver("!degrees", re.compile(r"^deg\([^\)]*\)$"), ["d"])
    _class.add_implicit_resolver("!radians", re.compile(r"^rad\([^\)]*\)$"), ["r"])
