"""The command line of a launch: files, and values for args."""

from __future__ import annotations

import re
from collections.abc import Sequence

import msgspec

__all__ = ("LaunchArguments", "parse_arguments")

_ASSIGNMENT = re.compile(r"(?:[~/A-Za-z]|_|__)[\w/]*:=.*")
_NAMESPACE = "__ns:="


class LaunchArguments(msgspec.Struct, frozen=True):
    """A command line, sorted by meaning.

    Attributes:
        args: Values for ``<arg>`` by name.
        ns: ``__ns``; empty where it is not given.
        rest: What is no assignment: a package and files, or files.
        warnings: What was given and has no effect, as in roslaunch, which is silent about it.
    """

    args: dict[str, str] = {}
    ns: str = ""
    rest: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def parse_arguments(argv: Sequence[str]) -> LaunchArguments:
    """Sort a command line, options taken out, by roslaunch's rules.

    ``name:=value`` sets an arg. An empty value sets nothing, nor does ``_name:=value``.
    """
    args: dict[str, str] = {}
    rest: list[str] = []
    warnings: list[str] = []
    ns = ""
    for argument in argv:
        name, assigns, value = (part.strip() for part in argument.partition(":="))
        if not assigns:
            rest.append(argument)
        elif argument.startswith(_NAMESPACE):
            ns = ns or value
        elif not _ASSIGNMENT.fullmatch(argument):
            warnings.append(f"'{argument}' is ignored: '{name}' is no name of an arg")
        elif name.startswith("_"):
            if not name.startswith("__"):
                warnings.append(f"'{argument}' is ignored: it is for a node, not for a launch")
        elif ":=" in value:
            warnings.append(f"'{argument}' is ignored: ':=' stands in it twice")
        elif not value:
            warnings.append(f"'{argument}' is ignored: it gives no value, so a default stays")
        else:
            args[name] = value
    return LaunchArguments(args, ns, tuple(rest), tuple(warnings))
