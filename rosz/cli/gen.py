"""``rosz gen``: write Python modules for the messages and services of packages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from rosz.cli import suggest
from rosz.cli.console import print_lines
from rosz.cli.declare import App, Argument, Option

__all__ = ("app",)

app = App()


@app.command()
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
