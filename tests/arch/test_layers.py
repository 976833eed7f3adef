"""The floors of the house: imports go down, through doors, and never in a ring."""

from __future__ import annotations

import ast
import re
from graphlib import CycleError, TopologicalSorter

import pytest

from arch.house import (
    FLOORS,
    HAND_WRITTEN,
    MODULES,
    SOURCE,
    assigned_names,
    exports,
    floor,
    imports,
    is_package,
    package_of,
)

MAY_IMPORT_ZENOH = "rosz.session"
MAY_PRINT = "rosz.cli"
PURE = 2
IMPURE = {"threading", "socket", "subprocess", "asyncio", "multiprocessing", "select", "signal"}
READS_ENVIRONMENT = {"os.environ", "os.getenv", "time.time", "time.time_ns"}
# The outside of a launch: SystemContext there is the real one, handed in from above.
RUNS_COMMANDS = {"rosz.launch.plan.context"}
# Generated modules import each other, and `rosz.message`, as their definitions ask for.
GENERATED = "rosz.msgs"
# The root, and the half of ``params`` that stands above its replica: everybody imports them.
ROOTS = {"rosz", "rosz.params", "rosz.launch"}
MOST_PUBLIC = 16


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


def test_the_manual_has_the_same_floors() -> None:
    text = (SOURCE / "share/manual/architecture.md").read_text()
    rows = re.findall(r"^\| (\d) \| ([^|]*)\|", text, re.MULTILINE)
    written = {
        f"rosz.{name.replace('/', '.')}": int(number)
        for number, names in rows
        for name in re.findall(r"`([\w/]+)`", names)
    }
    table = {name: number for name, number in FLOORS.items() if package_of(name) == name}
    # The root starts everything; a package whose halves have floors has none of its own.
    for name in ("rosz", "rosz.__main__", "rosz.script", "rosz.launch"):
        del table[name]
    assert written == table


def test_the_map_names_places_that_exist() -> None:
    """In a row, a name stands below ``rosz`` or a folder that the row has named before."""
    text = (SOURCE / "share/manual/architecture.md").read_text()
    rows = text.partition("## Where things are")[2].splitlines()
    missing = []
    for row in rows:
        folders = [SOURCE]
        for name in re.findall(r"`([\w/]+(?:/|\.py|\.txt))`", row):
            place = next((path for folder in folders if (path := folder / name).exists()), None)
            if place is None:
                missing.append(name)
            else:
                folders.append(place if place.is_dir() else place.parent)
    assert len(rows) > 20
    assert not missing


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


def test_packages_form_no_ring() -> None:
    """As for modules; imports inside functions and for typing count too."""
    needs: dict[str, set[str]] = {}
    for module in HAND_WRITTEN:
        targets = {package_of(found.module) for found in imports(module) if found.module in MODULES}
        own = package_of(module)
        needs.setdefault(own, set()).update(targets - {own} - ROOTS)
    for root in ROOTS:
        needs.pop(root, None)
    try:
        TopologicalSorter(needs).prepare()
    except CycleError as error:
        pytest.fail(f"packages form a ring: {' -> '.join(error.args[1])}")


def test_packages_are_entered_by_their_doors() -> None:
    """Modules outside a package import what an ``__init__`` exports, or a public module of it."""
    public = {
        f"{package}.{name}"
        for package in MODULES
        if is_package(package)
        for name in assigned_names(package, "PUBLIC_MODULES") or ()
    }
    assert public <= set(MODULES), f"no such modules: {sorted(public - set(MODULES))}"
    passed = []
    used = set()
    for module in HAND_WRITTEN:
        for found in imports(module):
            target = found.module
            if target not in MODULES or within(target, GENERATED) or is_package(target):
                continue
            if package_of(module) == package_of(target) or package_of(target) == target:
                continue
            if target in public:
                used.add(target)
            elif (package_of(module), package_of(target)) != ("rosz.params.replica", "rosz.params"):
                passed.append(f"{module}:{found.line} imports {target}")
    assert not passed, "not exported by the package, nor named in PUBLIC_MODULES:\n" + "\n".join(
        passed
    )
    assert public == used, f"imported by no other package: {sorted(public - used)}"
    assert len(public) <= MOST_PUBLIC, f"{len(public)} public modules: {sorted(public)}"


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
            and f"{node.value.id}.{node.attr}" in READS_ENVIRONMENT
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


def test_imported_names_are_exported() -> None:
    """Types cannot tell: a door that loads its exports on first use has any name for mypy."""
    missing = [
        f"{module}:{found.line} imports '{found.name}' from {found.module}"
        for module in HAND_WRITTEN
        for found in imports(module)
        if found.name
        and found.module in MODULES
        and is_package(found.module)
        and package_of(found.module) != package_of(module)
        and (exported := exports(found.module)) is not None
        and found.name not in exported
        and not within(found.module, GENERATED)
    ]
    assert not missing, "\n".join(missing)
