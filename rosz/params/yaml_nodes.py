"""YAML text as nodes that know their position, composed safely whatever the text holds.

PyYAML's own composer recurses in C over nested text, so a few thousand brackets crash the process.
This composer reads the parser's events, which are flat. It limits the depth, and the number of
values that aliases repeat.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import yaml

from rosz.errors import YamlError
from rosz.params.values import MAX_DEPTH, unsound_text

__all__ = ("SCALAR_FAULTS", "fault", "read_nodes", "read_plain", "shown_tag")

SCALAR_FAULTS: Final = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""Exceptions that PyYAML raises when a scalar does not fit its tag."""

_MOST_REPEATED: Final = 100_000
"""Values that aliases may add to a document; a document that adds more is refused as an attack."""

_SafeLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _PlainLoader(_SafeLoader):  # type: ignore[misc]  # either of two base classes
    """PyYAML's safe loader that names the position of a scalar that does not fit its tag."""

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except SCALAR_FAULTS as error:
            if not isinstance(node, yaml.ScalarNode):
                raise
            reason = f"'{node.value}' is not a {shown_tag(node)}: {error}"
            raise yaml.constructor.ConstructorError(
                problem=reason, problem_mark=node.start_mark
            ) from error


def fault(node: Any, reason: str, path: str) -> YamlError:
    """Return the error that names the position of a node, event or mark of PyYAML."""
    mark = getattr(node, "start_mark", node)
    return YamlError(reason, path, mark.line + 1, mark.column + 1)


def shown_tag(node: Any) -> str:
    """Return the tag of a node in YAML's short form."""
    return str(node.tag.replace("tag:yaml.org,2002:", "!!"))


def read_plain(text: str, path: str) -> Iterator[Any]:
    """Yield the content of each document of a text, by PyYAML's safe rules.

    Args:
        text: YAML text.
        path: File that the text is from, for error messages.

    Raises:
        YamlError: The text is not YAML or is nested too deep, or a value does not fit its tag.
    """
    for loader, node in read_nodes(_PlainLoader, text, path):
        try:
            value = loader.construct_document(node)
        except yaml.MarkedYAMLError as error:
            raise fault(error.problem_mark or node, str(error.problem), path) from error
        yield value


def read_nodes(loader_class: Any, text: str, path: str) -> Iterator[tuple[Any, Any]]:
    """Yield for each document its loader, which constructs the scalars, and its top node.

    Args:
        loader_class: PyYAML loader with constructors and resolvers.
        text: YAML text.
        path: File that the text is from, for error messages.

    Raises:
        YamlError: The text is not YAML, is nested too deep, or repeats too much by aliases.
    """
    reason = unsound_text(text)
    if reason:
        raise YamlError(reason, path)
    loader = loader_class(text)
    try:
        while not loader.check_event(yaml.StreamEndEvent):
            if isinstance(loader.get_event(), yaml.DocumentStartEvent):
                yield loader, _Composer(loader, path).compose(0)
    except yaml.reader.ReaderError as error:
        line, column = _place(text, int(error.position))
        reason = f"the character {_shown(error.character)} is not allowed in YAML; write it escaped"
        raise YamlError(reason, path, line, column) from error
    except yaml.MarkedYAMLError as error:
        parts = [part for part in (error.context, error.problem) if part]
        reason = ", ".join(parts) or "it is not YAML"
        mark = error.problem_mark or error.context_mark
        raise (YamlError(reason, path) if mark is None else fault(mark, reason, path)) from error
    finally:
        loader.dispose()


class _Anchored:
    """A node that aliases may repeat, with the number of values that each of them adds."""

    def __init__(self, node: Any) -> None:
        self.node = node
        self.size = self.height = 0  # until it is complete


class _Composer:
    """Composer of the nodes of one document."""

    def __init__(self, loader: Any, path: str) -> None:
        self._loader = loader
        self._path = path
        self._anchors: dict[str, _Anchored] = {}
        self._size = 0
        self._deepest = 0
        self._repeated = 0

    def compose(self, depth: int) -> Any:
        event = self._loader.get_event()
        if isinstance(event, yaml.AliasEvent):
            return self._repeat(event, depth)
        self._count(event, depth, 1)
        node = self._empty(event)
        if not event.anchor:
            self._fill(node, event, depth)
            return node
        if event.anchor in self._anchors:
            raise fault(event, f"the anchor '&{event.anchor}' is taken", self._path)
        anchored = self._anchors[event.anchor] = _Anchored(node)
        size, deepest, self._deepest = self._size, self._deepest, depth
        self._fill(node, event, depth)
        anchored.size, anchored.height = self._size - size + 1, self._deepest - depth
        self._deepest = max(deepest, self._deepest)
        return node

    def _fill(self, node: Any, event: Any, depth: int) -> None:
        if isinstance(event, yaml.SequenceStartEvent):
            while not self._loader.check_event(yaml.SequenceEndEvent):
                node.value.append(self.compose(depth + 1))
            self._loader.get_event()
        elif isinstance(event, yaml.MappingStartEvent):
            while not self._loader.check_event(yaml.MappingEndEvent):
                node.value.append((self.compose(depth + 1), self.compose(depth + 1)))
            self._loader.get_event()

    def _repeat(self, alias: Any, depth: int) -> Any:
        anchored = self._anchors.get(alias.anchor)
        if anchored is None:
            raise fault(alias, f"the alias '*{alias.anchor}' names no anchor", self._path)
        self._count(alias, depth + anchored.height, anchored.size)
        self._repeated += anchored.size
        if self._repeated > _MOST_REPEATED:
            raise fault(
                alias,
                f"aliases repeat more than {_MOST_REPEATED} values: this looks like a YAML bomb; "
                "write them out if it is not",
                self._path,
            )
        return anchored.node

    def _count(self, event: Any, depth: int, size: int) -> None:
        self._size += size
        self._deepest = max(self._deepest, depth)
        if depth > MAX_DEPTH:
            raise fault(event, f"it is nested more than {MAX_DEPTH} deep", self._path)

    def _empty(self, event: Any) -> Any:
        kind, content = _NODES[type(event)]
        text = event.value if kind is yaml.ScalarNode else None
        tag = event.tag
        if tag is None or tag == "!":
            tag = self._loader.resolve(kind, text, event.implicit)
        return kind(tag, text if content is None else content(), event.start_mark, event.end_mark)


_NODES: Final[dict[type, tuple[Any, Any]]] = {
    yaml.ScalarEvent: (yaml.ScalarNode, None),
    yaml.SequenceStartEvent: (yaml.SequenceNode, list),
    yaml.MappingStartEvent: (yaml.MappingNode, list),
}


def _place(text: str, position: int) -> tuple[int, int]:
    before = text[:position]
    return before.count("\n") + 1, position - (before.rfind("\n") + 1) + 1


def _shown(character: object) -> str:
    return f"U+{character:04X}" if isinstance(character, int) else ascii(character)
