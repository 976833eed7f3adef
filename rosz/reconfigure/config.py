"""The values of all settings of a node, by name."""

from __future__ import annotations

import copy
from typing import Any, Self

__all__ = ("Config",)


class Config(dict[str, Any]):
    """A dictionary whose items are attributes as well: ``config["gain"]`` is ``config.gain``.

    Under ``groups`` is the root of the tree of groups: a `Config` with ``id``, ``parent``,
    ``name``, ``type``, ``state`` (whether it is shown), ``groups`` by name, and ``parameters``.
    """

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"this configuration has no '{name}'") from None

    def __setattr__(self, name: str, value: object) -> None:
        self[name] = value

    def __delattr__(self, name: str) -> None:
        try:
            del self[name]
        except KeyError:
            raise AttributeError(f"this configuration has no '{name}'") from None

    def copy(self) -> Self:
        """Return one with the same items."""
        return type(self)(self)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return type(self)({key: copy.deepcopy(value, memo) for key, value in self.items()})
