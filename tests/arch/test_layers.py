"""The floors of the house: imports go down, never up, and never in a ring."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "rosz"
SKIPPED = {"share"}

# Longest prefix wins. Where two of one floor import each other's modules, the ring test decides.
FLOORS = {
    "rosz": 9,
    "rosz.__main__": 9,
    "rosz.script": 9,
    "rosz.errors": 0,
    "rosz.names": 0,
    "rosz.remap": 0,
    "rosz.time": 0,
    "rosz.qos": 0,
    "rosz.packages": 0,
    "rosz.message": 0,
    "rosz.idl": 1,
    "rosz.params": 1,
    "rosz.launch": 1,
    "rosz.launch.plan": 1,
    "rosz.wire": 1,
    "rosz.msgs": 2,
    "rosz.typestore": 2,
    "rosz.worker": 3,
    "rosz.environment": 3,
    "rosz.lifecycle": 3,
    "rosz.security": 3,
    "rosz.security.rules": 1,
    "rosz.security.access": 1,
    "rosz.session": 3,
    "rosz.graph": 4,
    "rosz.params.replica": 4,
    "rosz.params.remote": 4,
    "rosz.params.api": 5,
    "rosz.node": 5,
    "rosz.actions": 6,
    "rosz.doctor": 6,
    "rosz.introspect": 6,
    "rosz.launch.run": 6,
    "rosz.reconfigure": 6,
    "rosz.turtlebot3_sim": 7,
    "rosz.transforms": 6,
    "rosz.turtlesim": 7,
    "rosz.ros1": 7,
    "rosz.ros2": 7,
    "rosz.workspace": 7,
    "rosz.cli": 8,
}
MAY_IMPORT_ZENOH = "rosz.session"
COMMANDS = "rosz.cli"
PURE = 2
IMPURE = {"threading", "socket", "subprocess", "asyncio", "multiprocessing", "select", "signal"}
# The outside of a launch: SystemContext there is the real one, handed in from above.
RUNS_COMMANDS = {"rosz.launch.plan.context"}


def module_name(path: Path) -> str:
    parts = path.relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def modules() -> dict[str, ast.Module]:
    return {
        module_name(path): ast.parse(path.read_text(), str(path))
        for path in sorted(SOURCE.rglob("*.py"))
        if not SKIPPED & set(path.relative_to(SOURCE).parts)
    }


MODULES = modules()


def floor(module: str) -> int:
    parts = module.split(".")
    for end in range(len(parts), 0, -1):
        known = FLOORS.get(".".join(parts[:end]))
        if known is not None:
            return known
    raise AssertionError(f"{module} has no floor: add it to the table")


def imported(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Yield every imported module with its line: at load time, in functions, for typing."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in line {node.lineno}"
            assert node.module is not None
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                yield (whole if whole in MODULES else node.module), node.lineno


def load_time(tree: ast.Module) -> Iterator[str]:
    """Yield what is imported when the module loads, leaving out functions and TYPE_CHECKING."""
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield from (name for name, _ in imported(ast.Module([node], [])))


@pytest.mark.parametrize("name", MODULES)
def test_imports_go_down(name: str) -> None:
    upward = [
        f"line {line}: {target} (floor {floor(target)})"
        for target, line in imported(MODULES[name])
        if target.split(".")[0] == "rosz" and floor(target) > floor(name)
    ]
    assert not upward, f"{name} (floor {floor(name)}) imports upwards: {upward}"


def test_no_rings() -> None:
    needs = {
        name: {
            target
            for target in load_time(tree)
            # A package's door imports its rooms; the rooms never import the door.
            if target in MODULES and not name.startswith(target + ".")
        }
        for name, tree in MODULES.items()
    }
    try:
        TopologicalSorter(needs).prepare()
    except CycleError as error:
        pytest.fail(f"imports form a ring: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize("name", MODULES)
def test_only_the_session_knows_zenoh(name: str) -> None:
    if name.startswith(MAY_IMPORT_ZENOH):
        return
    assert not [line for target, line in imported(MODULES[name]) if target.split(".")[0] == "zenoh"]


@pytest.mark.parametrize("name", [name for name in MODULES if floor(name) <= PURE])
def test_low_floors_are_pure(name: str) -> None:
    if name in RUNS_COMMANDS:
        return
    used = {target.split(".")[0] for target, _ in imported(MODULES[name])}
    assert not used & IMPURE
    for node in ast.walk(MODULES[name]):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            reads = f"{node.value.id}.{node.attr}"
            assert reads not in {"os.environ", "os.getenv", "time.time", "time.time_ns"}, (
                f"{name} line {node.lineno} uses {reads}: pass it in"
            )


@pytest.mark.parametrize("name", MODULES)
def test_print_and_exit_belong_to_commands(name: str) -> None:
    if name.startswith(COMMANDS):
        return
    for node in ast.walk(MODULES[name]):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id != "print", f"{name} line {node.lineno}"
