"""YAML text as nodes that know their place, composed without trusting its depth.

PyYAML's own composer recurses in C over whatever is nested, so that a few thousand brackets end the
process. This one takes the parser's events, which are flat, and refuses to go deep.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import yaml

from rosz.errors import YamlError
from rosz.params.values import MAX_DEPTH, unsound_text

__all__ = ("fault", "read_nodes")


def fault(node: Any, reason: str, path: str) -> YamlError:
    """Return the error that names where a node, event or mark of PyYAML's stands."""
    mark = getattr(node, "start_mark", node)
    return YamlError(reason, path, mark.line + 1, mark.column + 1)


def read_nodes(loader_class: Any, text: str, path: str) -> Iterator[tuple[Any, Any]]:
    """Yield each document's loader, which constructs its scalars, and top node.

    Args:
        loader_class: A PyYAML loader with its constructors and resolvers.
        text: YAML.
        path: Where it is from, for messages.

    Raises:
        YamlError: It is no YAML, or is nested too deep.
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
        reason = ", ".join(parts) or "it is no YAML"
        mark = error.problem_mark or error.context_mark
        raise (YamlError(reason, path) if mark is None else fault(mark, reason, path)) from error
    finally:
        loader.dispose()


class _Composer:
    """Makes the nodes of one document."""

    def __init__(self, loader: Any, path: str) -> None:
        self._loader = loader
        self._path = path
        self._anchors: dict[str, Any] = {}

    def compose(self, depth: int) -> Any:
        event = self._loader.get_event()
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self._anchors:
                raise fault(event, f"the alias '*{event.anchor}' names no anchor", self._path)
            return self._anchors[event.anchor]
        if depth > MAX_DEPTH:
            raise fault(event, f"it is nested more than {MAX_DEPTH} deep", self._path)
        node = self._empty(event)
        if event.anchor:
            if event.anchor in self._anchors:
                raise fault(event, f"the anchor '&{event.anchor}' is taken", self._path)
            self._anchors[event.anchor] = node
        if isinstance(event, yaml.SequenceStartEvent):
            while not self._loader.check_event(yaml.SequenceEndEvent):
                node.value.append(self.compose(depth + 1))
            self._loader.get_event()
        elif isinstance(event, yaml.MappingStartEvent):
            while not self._loader.check_event(yaml.MappingEndEvent):
                node.value.append((self.compose(depth + 1), self.compose(depth + 1)))
            self._loader.get_event()
        return node

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
