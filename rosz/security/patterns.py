"""Patterns of names, and how they are read from YAML files that users write.

``*`` stands for any part of one chunk of a name, ``**`` for any number of chunks.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final

import yaml

from rosz.errors import YamlError

_PATTERN: Final = re.compile(r"(/(\*\*|\*|\*?[A-Za-z0-9_]+(\*[A-Za-z0-9_]+)*\*?))+")


def is_pattern(text: str) -> bool:
    """Tell whether a text is a pattern of global names, such as ``/arm/*`` or ``/**``."""
    return _PATTERN.fullmatch(text) is not None


def matches(pattern: str, name: str) -> bool:
    """Tell whether a pattern matches a global name."""
    return _compiled(pattern).fullmatch(name) is not None


@lru_cache(maxsize=1000)
def _compiled(pattern: str) -> re.Pattern[str]:
    parts = [
        r"(/[^/]+)*" if part == "**" else "/" + re.escape(part).replace(r"\*", "[^/]*")
        for part in pattern.split("/")[1:]
    ]
    return re.compile("".join(parts))


def compose(text: str, file: str) -> yaml.Node | None:
    """Parse a file of patterns; ``None`` if it is empty.

    Args:
        text: The text of the file.
        file: The name of the file, for errors.

    Raises:
        YamlError: The text is not YAML, or nested too deep.
    """
    try:
        return yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise YamlError(error.problem or "no YAML", file, line, column) from error
    except yaml.YAMLError as error:
        raise YamlError(str(error), file, 1, 1) from error
    except RecursionError as error:
        raise YamlError("nested too deep; rules are names, verbs and patterns", file) from error


class PatternReader:
    """Converts the nodes of a YAML document.

    Args:
        file: The name of the file, for errors.
    """

    def __init__(self, file: str) -> None:
        self._file = file

    def items(self, node: yaml.Node, of: str) -> Iterator[tuple[yaml.Node, yaml.Node]]:
        """Yield the keys and values of a mapping.

        Args:
            node: The mapping.
            of: Content of the mapping, for errors.

        Raises:
            YamlError: It is no mapping, or a key is no name or stands there twice.
        """
        if not isinstance(node, yaml.MappingNode):
            raise self.error(node, f"expected a mapping of {of}")
        seen: set[str] = set()
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode) or not key.value:
                raise self.error(key, "expected a name")
            if key.value in seen:
                raise self.error(key, f"'{key.value}' stands here twice")
            seen.add(key.value)
            yield key, value

    def listed(self, node: yaml.Node) -> Iterator[tuple[yaml.Node, str]]:
        """Yield the texts of a list, or the only one, with their places.

        Raises:
            YamlError: There is something else than texts.
        """
        parts: Sequence[yaml.Node] = node.value if isinstance(node, yaml.SequenceNode) else [node]
        for part in parts:
            if not isinstance(part, yaml.ScalarNode):
                raise self.error(part, "expected a name or a list of names")
            yield part, str(part.value)

    def pattern(self, node: yaml.Node, text: str) -> str:
        """Return a text that has to be a pattern.

        Raises:
            YamlError: It is none.
        """
        if not is_pattern(text):
            raise self.error(
                node, f"'{text}' is not a pattern of global names; expected one like /arm/**"
            )
        return text

    def flag(self, node: yaml.Node) -> bool:
        """Return true or false.

        Raises:
            YamlError: It is neither.
        """
        if isinstance(node, yaml.ScalarNode) and node.tag == "tag:yaml.org,2002:bool":
            return bool(node.value.lower() in {"true", "yes", "on"})
        raise self.error(node, "expected true or false")

    def error(self, node: yaml.Node, what: str) -> YamlError:
        """Return an error at the place of a node."""
        mark = node.start_mark
        return YamlError(what, self._file, mark.line + 1, mark.column + 1)
