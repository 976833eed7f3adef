"""Packages whose exports are imported on first use, since commands have to start fast."""

from __future__ import annotations

import re
import sys

TYPE_CHECKING = False  # typing takes longer to import than everything else here
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

_IMPORT = re.compile(r"^    from (rosz\.\S+) import ([^(\n]+|\([^)]+\))", re.MULTILINE)
_COMMENT = re.compile(r"#.*")


def exports_of(package: str) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package, whose exports are what it imports for type checkers.

    The names and modules are read from the ``TYPE_CHECKING`` block of its source, so that they are
    listed once.
    """
    homes: dict[str, str] = {}

    def find(name: str) -> Any:
        if not homes:
            homes.update(_homes_in(package))
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        from importlib import import_module

        return getattr(import_module(homes[name]), name)

    return find


def _homes_in(package: str) -> dict[str, str]:
    """Return the modules of the names that a package imports for type checkers."""
    # The loader would import tokenize to read the source, and importing pathlib takes long.
    with open(str(sys.modules[package].__file__), encoding="utf-8") as file:  # noqa: PTH123
        imports = _IMPORT.findall(_COMMENT.sub("", file.read()))
    return {name: module for module, names in imports for name in re.findall(r"\w+", names)}
