"""The house as its source shows it: modules, what they import, and on which floor they stand."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

__all__ = (
    "FLOORS",
    "HAND_WRITTEN",
    "MODULES",
    "SOURCE",
    "Import",
    "assigned_names",
    "exports",
    "floor",
    "imports",
    "is_package",
    "package_of",
    "path_of",
)

SOURCE = Path(__file__).parents[2] / "rosz"
_SKIPPED = {"share"}

# The longest prefix counts.
FLOORS = {
    "rosz": 9,
    "rosz.__main__": 9,
    "rosz.script": 9,
    "rosz.errors": 0,
    "rosz.lazy": 0,
    "rosz.names": 0,
    "rosz.remap": 0,
    "rosz.time": 0,
    "rosz.qos": 0,
    "rosz.packages": 0,
    "rosz.queue": 0,
    "rosz.message": 0,
    "rosz.replacements": 0,
    "rosz.idl": 1,
    "rosz.params": 1,
    "rosz.launch": 1,
    "rosz.launch.plan": 1,
    "rosz.wire": 1,
    "rosz.msgs": 2,
    "rosz.typestore": 2,
    "rosz.program": 3,
    "rosz.worker": 3,
    "rosz.environment": 3,
    "rosz.interrupts": 3,
    "rosz.lifecycle": 3,
    "rosz.security": 3,
    "rosz.session": 3,
    "rosz.graph": 4,
    "rosz.params.replica": 4,
    "rosz.node": 5,
    "rosz.access": 6,
    "rosz.actions": 6,
    "rosz.bags": 7,
    "rosz.diagram": 6,
    "rosz.images": 6,
    "rosz.introspect": 6,
    "rosz.launch.run": 6,
    "rosz.reconfigure": 6,
    "rosz.transforms": 6,
    "rosz.bridges": 7,
    "rosz.bridges.foxglove.protocol": 1,
    "rosz.bridges.rosbridge.operations": 1,
    "rosz.doctor": 7,
    "rosz.programs": 7,
    "rosz.ros1": 7,
    "rosz.ros2": 7,
    "rosz.turtlebot3_sim": 7,
    "rosz.turtlesim": 7,
    "rosz.workspace": 7,
    "rosz.cli": 8,
    "rosz.web": 8,
}


class Import(NamedTuple):
    """One name that a module imports.

    Attributes:
        module: The module that it comes from.
        name: The name; empty for ``import module``.
        line: Where.
    """

    module: str
    name: str
    line: int


def _module_name(path: Path) -> str:
    parts = path.relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


_PATHS = {
    _module_name(path): path
    for path in sorted(SOURCE.rglob("*.py"))
    if not _SKIPPED & set(path.relative_to(SOURCE).parts)
}
MODULES = {name: ast.parse(path.read_text(), str(path)) for name, path in _PATHS.items()}
HAND_WRITTEN = tuple(name for name in MODULES if not name.startswith("rosz.msgs."))


def path_of(module: str) -> Path:
    """Return the file of a module."""
    return _PATHS[module]


def is_package(module: str) -> bool:
    """Tell whether a module is the ``__init__`` of a package."""
    return _PATHS[module].name == "__init__.py"


# Parts of packages that stand on floors of their own: they count as packages.
_HALVES = ("rosz.launch.plan", "rosz.launch.run", "rosz.params.replica")


def package_of(module: str) -> str:
    """Return the package of a module: a name below ``rosz``, or a half of one of them."""
    for half in _HALVES:
        if module == half or module.startswith(half + "."):
            return half
    return ".".join(module.split(".")[:2])


def floor(module: str) -> int:
    """Return the floor of a module.

    Raises:
        AssertionError: It stands on none.
    """
    parts = module.split(".")
    for end in range(len(parts), 0, -1):
        known = FLOORS.get(".".join(parts[:end]))
        if known is not None:
            return known
    raise AssertionError(f"{module} has no floor: add it to the table")


def imports(module: str) -> Iterator[Import]:
    """Yield everything that a module imports: at load time, in functions, and for typing."""
    for node in ast.walk(MODULES[module]):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(alias.name, "", node.lineno)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module} line {node.lineno}: relative import"
            assert node.module is not None
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                exported = node.module in MODULES and exports(node.module)
                # A package may export a function that has the name of its module.
                if whole in MODULES and not (exported and alias.name in exported):
                    yield Import(whole, "", node.lineno)
                else:
                    yield Import(node.module, alias.name, node.lineno)


def assigned_names(module: str, variable: str) -> tuple[str, ...] | None:
    """Return the strings of a tuple or list that a module assigns at its top level."""
    for node in MODULES[module].body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if any(isinstance(target, ast.Name) and target.id == variable for target in targets):
            found: tuple[str, ...] = tuple(ast.literal_eval(node.value))
            return found
    return None


def exports(module: str) -> tuple[str, ...] | None:
    """Return what a package exports: its ``__all__``, or without one what it imports of rosz."""
    listed = assigned_names(module, "__all__")
    if listed is not None or not is_package(module):
        return listed
    imported = (
        alias.asname or alias.name
        for node in ast.walk(MODULES[module])
        if isinstance(node, ast.ImportFrom)
        and (node.module or "").startswith("rosz.")
        and node.module != "rosz.lazy"
        for alias in node.names
    )
    return tuple(imported) or None
