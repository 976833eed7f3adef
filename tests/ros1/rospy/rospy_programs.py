"""Runs rospy programs with ``python -m rosz.ros1`` on the network of a test."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from textwrap import dedent

from network import Network, Program

__all__ = ("Printed", "run", "start")

Printed = Callable[[str], list[str]]
"""Runs a program, and returns its lines."""

_NUMBERS = count()
_SHOW = '''
def show(label, function):
    """Print what a call returns, or how it fails."""
    try:
        print(label, "->", repr(function()), flush=True)
    except BaseException as error:
        print(label, "->", type(error).__name__, "|", error, flush=True)
'''


def start(network: Network, script: str, *argv: str, **variables: str) -> Program:
    """Start a program that has the function `show`."""
    path = network.folder / f"program{next(_NUMBERS)}.py"
    path.write_text(_SHOW + dedent(script))
    return network.run("-m", "rosz.ros1", str(path), *argv, **variables)


def run(network: Network, script: str, *argv: str, code: int = 0, **variables: str) -> list[str]:
    """Run a program, and return its lines."""
    program = start(network, script, *argv, **variables)
    ended = program.exit_code()
    assert ended == code, program.output
    return program.lines
