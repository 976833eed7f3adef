"""``rosz gen``: write Python modules for the messages and services of packages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from rosz.cli.declare import App, Argument, Option
from rosz.cli.group import print_lines

__all__ = ("app",)

app = App()


@app.command()
def gen_command(
    packages: Annotated[
        list[str] | None,
        Argument(
            metavar="[PACKAGE]...", help="Names or folders; the one around this folder if none."
        ),
    ] = None,
    *,
    output: Annotated[
        str,
        Option(
            "-o", "--output", metavar="FOLDER", help="Where; src in the package when not given."
        ),
    ] = "",
    check: Annotated[
        bool, Option("--check", help="Write nothing; exit code 1 if something is stale.")
    ] = False,
) -> int:
    """Write Python modules for messages and services, for editors and type checkers.

    Running programs needs none of this: what is not generated is compiled when it is imported.
    """
    from rosz.environment import Environment, package_index
    from rosz.workspace.generate import Generator

    folder = Path(output).absolute() if output else None
    generator = Generator(package_index(Environment.read()), folder, Path.cwd())
    if check:
        wrong = generator.stale(packages or [])
        print_lines(wrong)
        return int(bool(wrong))
    print_lines(map(str, generator.write(packages or [])))
    return 0
