"""The form of names and code: one name for each class, variables that name things, small units.

The counts are bounds for the whole house: a new exception makes another one needless.
"""

from __future__ import annotations

import ast
from functools import cache

from arch.house import HAND_WRITTEN, MODULES

# Names there are those of ROS.
FOREIGN = ("rosz.ros1.", "rosz.ros2.")
PRONOUNS = {"one", "found", "known", "mine", "said", "held"}
BRANCHES = (
    ast.Assert,
    ast.BoolOp,
    ast.ExceptHandler,
    ast.For,
    ast.If,
    ast.IfExp,
    ast.While,
    ast.With,
    ast.comprehension,
    ast.match_case,
)
Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def functions() -> list[tuple[str, Function]]:
    """Return all functions, with where they are."""
    return [
        (f"{module}:{node.lineno} {node.name}", node)
        for module in HAND_WRITTEN
        for node in ast.walk(MODULES[module])
        if isinstance(node, Function)
    ]


def bound_names(function: Function) -> set[str]:
    """Return the variables and parameters of a function and of those inside it."""
    names = set()
    for node in ast.walk(function):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
    return names


def members(node: ast.ClassDef) -> int:
    """Return the number of methods and attributes of a class."""
    methods = sum(isinstance(part, Function) for part in node.body)
    attributes = {
        part.attr
        for part in ast.walk(node)
        if isinstance(part, ast.Attribute)
        and isinstance(part.ctx, ast.Store)
        and isinstance(part.value, ast.Name)
        and part.value.id == "self"
    }
    return methods + len(attributes)


def test_a_class_has_a_name_of_its_own() -> None:
    homes: dict[str, list[str]] = {}
    for module in HAND_WRITTEN:
        if not module.startswith(FOREIGN):
            for node in MODULES[module].body:
                if isinstance(node, ast.ClassDef):
                    homes.setdefault(node.name, []).append(module)
    shared = [f"{name}: {', '.join(places)}" for name, places in homes.items() if len(places) > 1]
    assert len(shared) <= 10, "\n".join(shared)


def test_variables_are_named_for_things() -> None:
    pronouns = [place for place, function in functions() if bound_names(function) & PRONOUNS]
    assert len(pronouns) <= 10, "\n".join(pronouns)


def test_functions_branch_seldom() -> None:
    branching = [
        place
        for place, function in functions()
        if sum(isinstance(node, BRANCHES) for node in ast.walk(function)) + 1 > 15
    ]
    assert len(branching) <= 5, "\n".join(branching)


def test_functions_have_few_parameters() -> None:
    long = [
        place
        for place, function in functions()
        if len(function.args.args) + len(function.args.kwonlyargs) > 9
    ]
    assert len(long) <= 12, "\n".join(long)


def test_classes_have_few_members() -> None:
    wide = [
        f"{module}:{node.lineno} {node.name}: {members(node)}"
        for module in HAND_WRITTEN
        for node in ast.walk(MODULES[module])
        if isinstance(node, ast.ClassDef) and members(node) > 40
    ]
    assert len(wide) <= 6, "\n".join(wide)
