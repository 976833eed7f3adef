"""``rosz msg`` and ``rosz srv``: the commands of rosmsg and rossrv; ``rosz gen`` writes modules."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rosz.cli import suggest
from rosz.cli.call import Call, new_group
from rosz.cli.console import print_json, print_lines, print_result
from rosz.cli.declare import App, Argument, Json, Option
from rosz.environment import Environment, package_index
from rosz.errors import UsageError
from rosz.names import short_type

if TYPE_CHECKING:
    from rosz.introspect import Definitions
    from rosz.typestore import Kind

_Single = Annotated[bool, Option("-s", "Print all on one line.")]
_TypeName = Annotated[
    str,
    Argument(
        "TYPE",
        "PACKAGE/NAME, or NAME alone; read from standard input if omitted.",
        suggest.definitions,
    ),
]
_Package = Annotated[
    str, Argument("PACKAGE", "A package; read from standard input if omitted.", suggest.packages)
]


class _Types:
    """The commands for one kind of types."""

    def __init__(self, kind: Kind) -> None:
        self._kind: Kind = kind

    def show(
        self,
        call: Call,
        name: _TypeName = "",
        *,
        raw: Annotated[bool, Option("-r --raw", "Print it as written, with comments.")] = False,
        json: Json = False,
    ) -> None:
        definitions = self._definitions(call)
        wanted = _given(name)
        names = definitions.find(wanted)
        if json:
            print_json([definitions.summary(full) for full in names])
            return
        for full in names:
            if "/" not in wanted:
                print_lines([f"[{short_type(full)}]:"])
            print_lines([definitions.text(full) if raw else definitions.show(full)])

    def list(self, call: Call, *, json: Json = False) -> None:
        names = call.types.names(self._kind)
        print_result(names, names, as_json=json)

    def md5(self, call: Call, name: _TypeName = "", *, json: Json = False) -> None:
        definitions = self._definitions(call)
        _print_hashes(definitions, name, definitions.md5, as_json=json)

    def hash(self, call: Call, name: _TypeName = "", *, json: Json = False) -> None:
        definitions = self._definitions(call)
        _print_hashes(definitions, name, definitions.hash, as_json=json)

    def package(
        self, call: Call, package: _Package = "", *, single: _Single = False, json: Json = False
    ) -> None:
        names = call.types.names(self._kind, _given(package, "package"))
        print_result([" ".join(names)] if single else names, names, as_json=json)

    def packages(self, call: Call, *, single: _Single = False, json: Json = False) -> None:
        names = call.types.packages(self._kind)
        print_result([" ".join(names)] if single else names, names, as_json=json)

    def _definitions(self, call: Call) -> Definitions:
        from rosz.introspect import Definitions

        return Definitions(call.types, self._kind)


def _print_hashes(
    definitions: Definitions, name: str, compute: Callable[[str], str], *, as_json: bool
) -> None:
    wanted = _given(name)
    hashes = {full: compute(full) for full in definitions.find(wanted)}
    lines = (v if "/" in wanted else f"[{short_type(full)}]: {v}" for full, v in hashes.items())
    print_result(lines, {short_type(full): v for full, v in hashes.items()}, as_json=as_json)


def _given(word: str, what: str = "type") -> str:
    """Return a word of the command line; if there is none, of standard input, as rosmsg does."""
    if word:
        return word
    for line in sys.stdin:
        if line.strip():
            return line.strip()
    raise UsageError(f"no {what} is given")


def _new_app(kind: Kind, word: str) -> App:
    app = new_group(f"Show {word} types.")
    types = _Types(kind)
    show = f"Print a {word} type, with the fields of the types in it."
    app.command("show", help=show)(types.show)
    app.command("info", help=f"{show} The same as show.")(types.show)
    app.command("list", help=f"List all {word} types.")(types.list)
    app.command("md5", help=f"Print the MD5 sum by which ROS 1 knows a {word} type.")(types.md5)
    app.command("hash", help=f"Print the hash by which ROS 2 knows a {word} type.")(types.hash)
    app.command("package", help=f"List the {word} types of a package.")(types.package)
    app.command("packages", help=f"List the packages that have {word} types.")(types.packages)
    return app


msg = _new_app("msg", "message")
srv = _new_app("srv", "service")
gen = App()


@gen.command()
def gen_command(
    packages: Annotated[
        list[str] | None,
        Argument(
            "PACKAGE", "Names or folders; the package of this folder if omitted.", suggest.packages
        ),
    ] = None,
    *,
    output: Annotated[
        str,
        Option(
            "-o --output FOLDER", "Where to write; src in the package if omitted.", suggest.files
        ),
    ] = "",
    check: Annotated[
        bool, Option("--check", "Write nothing; the exit code is 1 if a module is stale.")
    ] = False,
) -> int:
    """Write Python modules for messages and services, for editors and type checkers.

    Programs do not need them: a module that is not written is compiled when it is imported.
    """
    from rosz.workspace import Generator

    folder = Path(output).absolute() if output else None
    generator = Generator(package_index(Environment.read()), folder, Path.cwd())
    if check:
        wrong = generator.stale(packages or [])
        print_lines(wrong)
        return int(bool(wrong))
    print_lines(map(str, generator.write(packages or [])))
    return 0
