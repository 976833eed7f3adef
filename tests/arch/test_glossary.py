"""Names use the words of the glossary."""

from __future__ import annotations

import ast
import re

from arch.glossary import AVOIDED, WORDS
from arch.house import HAND_WRITTEN, MODULES

# Their names are those of ROS.
FOREIGN = ("rosz.ros1.", "rosz.ros2.")
_PART = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")


def test_the_glossary_is_sorted_and_has_one_word_per_idea() -> None:
    assert list(WORDS) == sorted(WORDS, key=str.lower)
    assert list(AVOIDED) == sorted(AVOIDED)
    assert not set(WORDS) & set(AVOIDED)


def test_no_name_has_an_avoided_word() -> None:
    found = [
        f"{module}: {name} (use: {AVOIDED[part.lower()]})"
        for module in HAND_WRITTEN
        if not module.startswith(FOREIGN)
        for name in (
            module.rpartition(".")[2],
            *(
                node.name
                for node in ast.walk(MODULES[module])
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
            ),
        )
        for part in _PART.findall(name)
        if part.lower() in AVOIDED
    ]
    assert not found, "\n".join(found)
