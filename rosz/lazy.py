"""Packages whose exports are imported on first use, since commands have to start fast."""

from __future__ import annotations

TYPE_CHECKING = False  # typing takes longer to import than everything else here
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any


def exports_of(package: str, modules: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package.

    Args:
        package: Name of the package.
        modules: The exported names by the module below the package, or below ``rosz.`` with that in
            front, that defines them; separated by spaces.
    """
    homes = {name: module for module, names in modules.items() for name in names.split()}

    def find(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        from importlib import import_module

        home = homes[name]
        module = home if home.startswith("rosz.") else f"{package}.{home}"
        return getattr(import_module(module), name)

    return find
