"""What a node imports at its start, and what it leaves to who needs it."""

from __future__ import annotations

import subprocess
import sys

SLOW = ("inspect", "json", "statistics", "typer", "typing_extensions", "yaml")


def run(code: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def test_a_node_imports_nothing_slow() -> None:
    code = f"""
import gc, sys
import rosz
from rosz.msgs.std_msgs.msg import String
rosz.Node
print([one for one in {SLOW!r} if one in sys.modules], gc.isenabled())
import typing_extensions
from typing_extensions import Required
print(typing_extensions.__name__)
"""
    assert run(code) == ["[] True", "typing_extensions"]


def test_garbage_is_collected_as_the_program_wants() -> None:
    assert run("import gc; gc.disable(); import rosz; rosz.Node; print(gc.isenabled())") == [
        "False"
    ]


def test_msgspec_finds_annotations_without_typing_extensions() -> None:
    code = """
import rosz, sys
from typing import Annotated, Generic, TypedDict, TypeVar, NotRequired
import msgspec
assert "typing_extensions" not in sys.modules
T = TypeVar("T")
class Part(TypedDict):
    a: int
    b: NotRequired[int]
class Whole(msgspec.Struct, Generic[T]):
    part: Part
    value: T
    size: Annotated[int, msgspec.Meta(ge=1)]
print(msgspec.json.decode(b'{"part": {"a": 1}, "value": 2, "size": 3}', type=Whole[int]))
try:
    msgspec.json.decode(b'{"part": {}, "value": 2, "size": 0}', type=Whole[int])
except msgspec.ValidationError as error:
    print(error)
"""
    assert run(code) == [
        "Whole(part={'a': 1}, value=2, size=3)",
        "Object missing required field `a` - at `$.part`",
    ]
