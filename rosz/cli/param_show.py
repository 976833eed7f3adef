"""What ``rosz param`` prints: values and changes to stdout, talk to stderr."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rosz.cli.group import print_json, print_lines, warn

if TYPE_CHECKING:
    from rosz.errors import ParamNotFound
    from rosz.params import Value
    from rosz.params.remote import ParamClient
    from rosz.params.replica import Changed, Outcome
    from rosz.params.tree import Difference

__all__ = (
    "as_yaml",
    "complain",
    "not_set",
    "print_change",
    "show_preview",
    "tell",
    "tell_slow",
)

_FAILED = 1


def as_yaml(value: Value, *, readable: bool) -> str:
    """Return any value as YAML, or rather for reading."""
    from rosz.params.yaml import format_get, pretty

    return pretty(value) if readable else format_get(value)


def show_preview(differences: list[Difference], *, as_json: bool) -> None:
    """Print what a load would do."""
    if as_json:
        print_json(differences)
        return
    print_lines(_line(found.name, found.old, found.new) for found in differences)
    complain(f"{len(differences)} parameters would change; nothing is written")


def print_change(change: Changed, *, as_json: bool) -> None:
    """Print what has changed."""
    if as_json:
        import msgspec

        print_lines([msgspec.json.encode(change).decode()])
    else:
        print_lines([_line(change.name, change.old, change.new)])


def _line(name: str, old: Value | None, new: Value | None) -> str:
    from rosz.params.yaml import inline

    if old is None:
        return f"+ {name}: {inline(new)}"
    if new is None:
        return f"- {name}: {inline(old)}"
    return f"~ {name}: {inline(old)} -> {inline(new)}"


def not_set(word: str, error: ParamNotFound) -> int:
    """Say in ROS 1's words that something is not set."""
    hint = str(error).partition(" is not set")[2]
    complain(f"ERROR: {word} [{error.name}] is not set{hint}")
    return _FAILED


def tell_slow(client: ParamClient, outcome: Outcome) -> None:
    """Name the processes that have not heard of a write, or do not answer at all."""
    if outcome.slow:
        warn(f"written, but not yet known to {', '.join(outcome.slow)}, which did not answer")
    for label in client.silent:
        warn(f"{label} does not answer")


def tell(verbose: bool, text: str) -> None:
    """Say something to those who want to hear more."""
    if verbose:
        complain(text)


def complain(text: str) -> None:
    """Print a line to stderr."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()
