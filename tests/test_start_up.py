"""What a node imports at its start, and what it leaves to who needs it."""

from __future__ import annotations

import subprocess
import sys

SLOW = ("json", "statistics", "typer", "yaml")


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
"""
    assert run(code) == ["[] True"]


def test_garbage_is_collected_as_the_program_wants() -> None:
    assert run("import gc; gc.disable(); import rosz; rosz.Node; print(gc.isenabled())") == [
        "False"
    ]
