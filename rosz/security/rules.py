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

``*`` stands for any part of one chunk of a name, ``**`` for any number of chunks. All else is
refused.
"""

from __future__ import annotations

from typing import Final

import msgspec
import yaml

from rosz.errors import near_miss
from rosz.security.patterns import PatternReader, compose, matches

ANYBODY: Final = "*"
EVERYTHING: Final = "/**"
NAME_VERBS: Final = ("publish", "subscribe", "call", "serve", "set")
_FLAGS: Final = ("get", "control")


class Permit(msgspec.Struct, frozen=True, kw_only=True):
    """The permissions of the holder of a key.

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
        return any(matches(pattern, name) for pattern in getattr(self, verb))

    @property
    def is_all(self) -> bool:
        """Whether it permits everything."""
        return self == Permit.all()


class Rules(msgspec.Struct, frozen=True):
    """The access rules: the permissions of all holders of keys.

    Attributes:
        permits: Permissions of each holder, by the name in its certificate; those of all are under
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

    def permit_at_bridge(self, name: str) -> Permit:
        """Return the permissions of clients of a bridge, who have no keys.

        Args:
            name: Name of the bridge in the rules; without it there, the permissions of all count.
        """
        return self.permit_of(name) or self.permits.get(ANYBODY) or Permit()


def read_rules(text: str, file: str) -> Rules:
    """Parse the rules of a file.

    Args:
        text: The text of the file.
        file: The name of the file, for errors.

    Raises:
        YamlError: The text is not YAML, or does not consist of rules.
    """
    top = compose(text, file)
    if top is None:
        return Rules({})
    reader = _RulesReader(file)
    holders = reader.items(top, "key holders")
    return Rules({str(name.value): reader.permit(value) for name, value in holders})


class _RulesReader(PatternReader):
    """Converts the nodes of a YAML document; its errors say where the mistake is."""

    def permit(self, node: yaml.Node) -> Permit:
        if isinstance(node, yaml.ScalarNode):
            if node.value == "all":
                return Permit.all()
            raise self.error(node, f"'{node.value}'; expected 'all', or a mapping of permissions")
        given: dict[str, tuple[str, ...] | bool] = {}
        for key, value in self.items(node, "permissions"):
            verb = str(key.value)
            if verb in NAME_VERBS:
                given[verb] = tuple(self.pattern(*part) for part in self.listed(value))
            elif verb in _FLAGS:
                given[verb] = self.flag(value)
            else:
                verbs = (*NAME_VERBS, *_FLAGS)
                hint = f"{near_miss(verb, verbs)}; expected one of {', '.join(verbs)}"
                raise self.error(key, f"'{verb}' is not a permission{hint}")
        return msgspec.convert(given, Permit)
