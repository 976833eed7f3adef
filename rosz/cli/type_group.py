"""``rosz msg`` and ``rosz srv``, which differ in what they look at."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

from rosz.cli.declare import App, Argument, Option
from rosz.cli.group import Call, new_group, print_json, print_lines
from rosz.errors import UsageError

if TYPE_CHECKING:
    from rosz.introspect.definitions import Definitions
    from rosz.typestore import Kind

__all__ = ("new_type_group",)

_Json = Annotated[bool, Option("--json", help="As JSON.")]
_Single = Annotated[bool, Option("-s", help="On a single line.")]
_TypeName = Annotated[
    str, Argument(metavar="[TYPE]", help="package/Name, or Name alone; else asked for.")
]


def new_type_group(kind: Kind, word: str) -> App:
    """Return the commands that show definitions.

    Args:
        kind: What they look at.
        word: What a person calls that.
    """
    app = new_group(f"Show {word} types.")
    shelf = _Shelf(kind)
    app.command("show", help=f"Show a {word} type, the types in it unfolded.")(shelf.show)
    app.command("info", help="The same as show.")(shelf.show)
    app.command("list", help=f"List all {word} types.")(shelf.list)
    app.command("md5", help=f"Print the hash that ROS 1 knows a {word} type by.")(shelf.md5)
    app.command("hash", help=f"Print the hash that ROS 2 knows a {word} type by.")(shelf.hash)
    app.command("package", help=f"List the {word} types of a package.")(shelf.package)
    app.command("packages", help=f"List the packages that have {word} types.")(shelf.packages)
    return app


class _Shelf:
    """The commands, for one kind of types."""

    def __init__(self, kind: Kind) -> None:
        self._kind: Kind = kind

    def _definitions(self) -> Definitions:
        from rosz.introspect.definitions import Definitions

        return Definitions(Call(()).types, self._kind)

    def show(
        self,
        name: _TypeName = "",
        *,
        raw: Annotated[
            bool, Option("-r", "--raw", help="As it is written, comments included.")
        ] = False,
        json: _Json = False,
    ) -> None:
        definitions = self._definitions()
        asked = _asked(name)
        found = definitions.find(asked)
        if json:
            print_json([definitions.summary(one) for one in found])
            return
        for one in found:
            if "/" not in asked:
                print_lines([f"[{_short(one)}]:"])
            print_lines([definitions.text(one) if raw else definitions.show(one)])

    def list(self, *, json: _Json = False) -> None:
        names = Call(()).types.names(self._kind)
        if json:
            print_json(names)
        else:
            print_lines(names)

    def md5(self, name: _TypeName = "", *, json: _Json = False) -> None:
        self._hashes(name, lambda definitions, one: definitions.md5(one), as_json=json)

    def hash(self, name: _TypeName = "", *, json: _Json = False) -> None:
        self._hashes(name, lambda definitions, one: definitions.hash(one), as_json=json)

    def _hashes(self, name: str, of: Callable[[Definitions, str], str], *, as_json: bool) -> None:
        definitions = self._definitions()
        asked = _asked(name)
        found = definitions.find(asked)
        if as_json:
            print_json({_short(one): of(definitions, one) for one in found})
            return
        for one in found:
            title = "" if "/" in asked else f"[{_short(one)}]: "
            print_lines([title + of(definitions, one)])

    def package(
        self,
        package: Annotated[str, Argument(metavar="[PACKAGE]")] = "",
        *,
        single: _Single = False,
        json: _Json = False,
    ) -> None:
        names = Call(()).types.names(self._kind, _asked(package, "package"))
        _print(names, single=single, as_json=json)

    def packages(self, *, single: _Single = False, json: _Json = False) -> None:
        _print(Call(()).types.packages(self._kind), single=single, as_json=json)


def _print(names: list[str], *, single: bool, as_json: bool) -> None:
    if as_json:
        print_json(names)
    else:
        print_lines([" ".join(names)] if single else names)


def _short(name: str) -> str:
    package, _, base = name.split("/")
    return f"{package}/{base}"


def _asked(word: str, what: str = "type") -> str:
    """Return a word of the command line, or of standard input where there is none, as ROS 1."""
    if word:
        return word
    for line in sys.stdin:
        if line.strip():
            return line.strip()
    raise UsageError(f"no {what} is given")
