"""The form of files: size, exports, documentation."""

from __future__ import annotations

import ast
import subprocess
from importlib import import_module

import pytest

from arch.house import (
    HAND_WRITTEN,
    MODULES,
    SOURCE,
    assigned_names,
    exports,
    is_package,
    path_of,
)

TOP = {".ci", ".gitignore", "README.md", "interfaces", "launch", "pyproject.toml", "rosz", "tests"}
LONGEST_FILE = 600
LONGEST_FUNCTION = 50
# Their exports are those of ROS.
FOREIGN = ("rosz.ros1.", "rosz.ros2.")
USED_BY_NAME = {
    "rosz.errors",
    "rosz.message.runtime",
    "rosz.names",
    "rosz.qos",
    "rosz.time",
    "rosz.typestore",
}


def functions(tree: ast.Module) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    return [
        node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]


def body_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return the lines of a function below its signature and docstring."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    if not body:
        return 0
    return (function.end_lineno or 0) - body[0].lineno + 1


def test_the_top_level_holds_nothing_else() -> None:
    if not (SOURCE.parent / ".git").exists():
        pytest.skip("needs the git repository")
    listing = subprocess.check_output(["git", "ls-files"], cwd=SOURCE.parent, text=True)
    assert {line.partition("/")[0] for line in listing.splitlines()} == TOP


def test_files_hold_one_idea() -> None:
    long = {
        module: lines
        for module in HAND_WRITTEN
        if (lines := path_of(module).read_text().count("\n")) > LONGEST_FILE
    }
    assert not long, f"longer than {LONGEST_FILE} lines: {long}"


def test_functions_fit_a_page() -> None:
    long = [
        f"{module}:{function.lineno} {function.name}: {body_lines(function)} lines"
        for module in HAND_WRITTEN
        for function in functions(MODULES[module])
        if body_lines(function) > LONGEST_FUNCTION
    ]
    assert not long, "\n".join(long)


def test_doors_list_their_exports() -> None:
    """Only packages, and modules that users import by name, have ``__all__``: exact, and sorted."""
    wrong = []
    for module in HAND_WRITTEN:
        exported = assigned_names(module, "__all__")
        if exported is None or module.startswith(FOREIGN):
            continue
        if not is_package(module) and module not in USED_BY_NAME:
            wrong.append(f"{module}: only a package's __init__ has __all__")
        if list(exported) != sorted(exported, key=_isort_key):
            wrong.append(f"{module}: __all__ is not sorted")
        defined = _bound_names(MODULES[module])
        wrong += [
            f"{module}: exports '{name}', which it lacks"
            for name in exported
            if name not in defined and "__getattr__" not in defined
        ]
    assert not wrong, "\n".join(wrong)


def test_exports_load_on_first_use() -> None:
    """The tables of modules name where the exports are; mypy does not read them."""
    for module in HAND_WRITTEN:
        if is_package(module) and "__getattr__" in _bound_names(MODULES[module]):
            for name in exports(module) or ():
                getattr(import_module(module), name)


def _isort_key(name: str) -> tuple[int, str]:
    kind = 0 if name.isupper() and len(name) > 1 else 1 if name[:1].isupper() else 2
    return kind, name


def _bound_names(tree: ast.Module) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names.update((alias.asname or alias.name).split(".")[0] for alias in node.names)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
    return names
