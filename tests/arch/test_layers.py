"""The floors of the house: imports go down, through doors, and never in a ring."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter

import pytest

from arch.house import (
    HAND_WRITTEN,
    MODULES,
    assigned_names,
    floor,
    imports,
    is_package,
)

MAY_IMPORT_ZENOH = "rosz.session"
MAY_PRINT = "rosz.cli"
PURE = 2
IMPURE = {"threading", "socket", "subprocess", "asyncio", "multiprocessing", "select", "signal"}
READS_SURROUNDINGS = {"os.environ", "os.getenv", "time.time", "time.time_ns"}
# The outside of a launch: SystemContext there is the real one, handed in from above.
RUNS_COMMANDS = {"rosz.launch.plan.context"}
# Generated modules import each other, and `rosz.message`, as their definitions ask for.
GENERATED = "rosz.msgs"


def within(module: str, package: str) -> bool:
    return module == package or module.startswith(package + ".")


def test_imports_go_down() -> None:
    upward = [
        f"{module}:{found.line} (floor {floor(module)}) imports"
        f" {found.module} (floor {floor(found.module)})"
        for module in MODULES
        for found in imports(module)
        if within(found.module, "rosz") and floor(found.module) > floor(module)
    ]
    assert not upward, "\n".join(upward)


def test_imports_form_no_ring() -> None:
    needs = {
        module: {
            found.module
            for found in imports(module)
            # A package's door imports its rooms; the rooms never import the door.
            if found.module in MODULES and not within(module, found.module)
        }
        for module in MODULES
    }
    try:
        TopologicalSorter(needs).prepare()
    except CycleError as error:
        pytest.fail(f"imports form a ring: {' -> '.join(error.args[1])}")


def test_packages_are_entered_by_their_doors() -> None:
    """Modules outside a package import what its ``__init__`` exports, or a public module of it."""
    public = {
        f"{package}.{name}"
        for package in MODULES
        if is_package(package)
        for name in assigned_names(package, "PUBLIC_MODULES") or ()
    }
    assert public <= set(MODULES), f"no such modules: {sorted(public - set(MODULES))}"
    passed = []
    for module in HAND_WRITTEN:
        for found in imports(module):
            if found.module not in MODULES or within(found.module, GENERATED):
                continue
            parts = found.module.split(".")
            for end in range(2, len(parts)):
                package, room = ".".join(parts[:end]), ".".join(parts[: end + 1])
                if within(module, package) or is_package(room) or room in public:
                    continue
                passed.append(f"{module}:{found.line} imports {found.module}")
    assert not passed, "not exported by the package, nor named in PUBLIC_MODULES:\n" + "\n".join(
        passed
    )


def test_only_the_session_imports_zenoh() -> None:
    guilty = [
        f"{module}:{found.line}"
        for module in MODULES
        if not within(module, MAY_IMPORT_ZENOH)
        for found in imports(module)
        if within(found.module, "zenoh")
    ]
    assert not guilty


def test_low_floors_are_pure() -> None:
    impure = []
    for module in MODULES:
        if floor(module) > PURE or module in RUNS_COMMANDS:
            continue
        impure += [
            f"{module}:{found.line} imports {found.module}"
            for found in imports(module)
            if found.module.split(".")[0] in IMPURE
        ]
        impure += [
            f"{module}:{node.lineno} uses {node.value.id}.{node.attr}: pass it in"
            for node in ast.walk(MODULES[module])
            if isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name)
            and f"{node.value.id}.{node.attr}" in READS_SURROUNDINGS
        ]
    assert not impure, "\n".join(impure)


def test_only_commands_print() -> None:
    printing = [
        f"{module}:{node.lineno}"
        for module in MODULES
        if not within(module, MAY_PRINT)
        for node in ast.walk(MODULES[module])
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "print"
    ]
    assert not printing
