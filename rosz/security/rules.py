"""Access rules as users write them: for each holder of a key, the names that it may use.

::

    laptop:
      publish: [/cmd_vel, "/joy/**"]
      subscribe: ["/**"]
      call: [/reset]
      set: ["/gains/**"]
      get: true
    operator: all
    "*":                      # everybody who has a key
      subscribe: [/map]

``*`` stands for any part of one chunk of a name, ``**`` for any number of chunks. What is not
allowed is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

import msgspec
import yaml

from rosz.errors import YamlError, near_miss

__all__ = ("ANYBODY", "EVERYTHING", "NAME_VERBS", "Permit", "Rules", "read_rules")

ANYBODY: Final = "*"
EVERYTHING: Final = "/**"
NAME_VERBS: Final = ("publish", "subscribe", "call", "serve", "set")
_FLAGS: Final = ("get", "control")
_PATTERN: Final = re.compile(r"(/(\*\*|\*|\*?[A-Za-z0-9_]+(\*[A-Za-z0-9_]+)*\*?))+")


class Permit(msgspec.Struct, frozen=True, kw_only=True):
    """What one holder of a key may do.

    Attributes:
        publish: The topics it may publish, as patterns of global names.
        subscribe: The topics it may subscribe to.
        call: The services it may call.
        serve: The services it may serve.
        set: The parameters it may set and delete, which is not permission to read them.
        get: Whether it may read parameters. They are one store, so that is all of them or none.
        control: Whether it may ping and end nodes, also by starting newer ones of their names, set
            log levels, and query launches.
    """

    publish: tuple[str, ...] = ()
    subscribe: tuple[str, ...] = ()
    call: tuple[str, ...] = ()
    serve: tuple[str, ...] = ()
    set: tuple[str, ...] = ()
    get: bool = False
    control: bool = False

    @classmethod
    def all(cls) -> Permit:
        """Return the permission to do everything."""
        names = dict.fromkeys(NAME_VERBS, (EVERYTHING,))
        return cls(**names, get=True, control=True)

    def allows(self, verb: str, name: str) -> bool:
        """Tell whether the patterns of a verb match a global name."""
        return any(_matches(pattern, name) for pattern in getattr(self, verb))

    @property
    def is_all(self) -> bool:
        """Whether it permits everything."""
        return self == Permit.all()


class Rules(msgspec.Struct, frozen=True):
    """The access rules: the permissions of all holders of keys.

    Attributes:
        permits: What each holder may do, by the name in its certificate; what all may do is under
            `ANYBODY`.
    """

    permits: dict[str, Permit]

    def permit_of(self, name: str) -> Permit | None:
        """Return all that a holder may do; ``None`` if the rules do not name the holder."""
        own = self.permits.get(name)
        if own is None:
            return None
        all_may = self.permits.get(ANYBODY, Permit())
        names = {verb: getattr(own, verb) + getattr(all_may, verb) for verb in NAME_VERBS}
        flags = {flag: getattr(own, flag) or getattr(all_may, flag) for flag in _FLAGS}
        return msgspec.convert({**names, **flags}, Permit)


def read_rules(text: str, file: str) -> Rules:
    """Parse the rules of a file.

    Args:
        text: The text of the file.
        file: The name of the file, for errors.

    Raises:
        YamlError: The text is not YAML, or does not consist of rules.
    """
    try:
        top = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise YamlError(error.problem or "no YAML", file, line, column) from error
    except yaml.YAMLError as error:
        raise YamlError(str(error), file, 1, 1) from error
    except RecursionError as error:
        raise YamlError("nested too deep; rules are names, verbs and patterns", file) from error
    if top is None:
        return Rules({})
    reader = _Reader(file)
    holders = reader.items(top, "key holders")
    return Rules({str(name.value): reader.permit(value) for name, value in holders})


def _matches(pattern: str, name: str) -> bool:
    parts = [
        r"(/[^/]+)*" if part == "**" else "/" + re.escape(part).replace(r"\*", "[^/]*")
        for part in pattern.split("/")[1:]
    ]
    return re.fullmatch("".join(parts), name) is not None


class _Reader:
    """Converts the nodes of a YAML document; its errors say where the mistake is."""

    def __init__(self, file: str) -> None:
        self._file = file

    def items(self, node: yaml.Node, of: str) -> Iterator[tuple[yaml.Node, yaml.Node]]:
        if not isinstance(node, yaml.MappingNode):
            raise self._error(node, f"expected a mapping of {of}")
        seen: set[str] = set()
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode) or not key.value:
                raise self._error(key, "expected a name")
            if key.value in seen:
                raise self._error(key, f"'{key.value}' stands here twice")
            seen.add(key.value)
            yield key, value

    def permit(self, node: yaml.Node) -> Permit:
        if isinstance(node, yaml.ScalarNode):
            if node.value == "all":
                return Permit.all()
            raise self._error(node, f"'{node.value}'; expected 'all', or a mapping of permissions")
        given: dict[str, tuple[str, ...] | bool] = {}
        for key, value in self.items(node, "permissions"):
            verb = str(key.value)
            if verb in NAME_VERBS:
                given[verb] = self._patterns(value)
            elif verb in _FLAGS:
                given[verb] = self._flag(value)
            else:
                known = (*NAME_VERBS, *_FLAGS)
                hint = f"{near_miss(verb, known)}; expected one of {', '.join(known)}"
                raise self._error(key, f"'{verb}' is not a permission{hint}")
        return msgspec.convert(given, Permit)

    def _patterns(self, node: yaml.Node) -> tuple[str, ...]:
        parts: Sequence[yaml.Node] = node.value if isinstance(node, yaml.SequenceNode) else [node]
        return tuple(self._pattern(part) for part in parts)

    def _pattern(self, node: yaml.Node) -> str:
        if not isinstance(node, yaml.ScalarNode):
            raise self._error(node, "expected a name or a list of names")
        text: str = node.value
        if not _PATTERN.fullmatch(text):
            raise self._error(
                node,
                f"'{text}' is not a pattern of global names; expected one like /arm/**",
            )
        return text

    def _flag(self, node: yaml.Node) -> bool:
        if isinstance(node, yaml.ScalarNode) and node.tag == "tag:yaml.org,2002:bool":
            return bool(node.value.lower() in {"true", "yes", "on"})
        raise self._error(node, "expected true or false")

    def _error(self, node: yaml.Node, what: str) -> YamlError:
        mark = node.start_mark
        return YamlError(what, self._file, mark.line + 1, mark.column + 1)
