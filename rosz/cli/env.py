"""``rosz env``: print what to eval in a shell, so that ROS 1's command names mean rosz."""

from __future__ import annotations

import os
import sys
from pathlib import Path, PurePath
from typing import Annotated

from rosz.cli.declare import App, Argument, Option
from rosz.cli.group import print_json
from rosz.errors import UsageError, near_miss

__all__ = ("app",)

app = App()


@app.command()
def env_command(
    shell: Annotated[
        str, Argument(metavar="[SHELL]", help="bash, zsh or fish; by SHELL when not given.")
    ] = "",
    *,
    json: Annotated[
        bool, Option("--json", help="Print the settings that rosz reads, as JSON.")
    ] = False,
) -> None:
    """Print what makes rostopic, roslaunch and the like mean rosz.

    Use it as: eval "$(rosz env)", in fish: rosz env fish | source
    """
    if json:
        from rosz.environment import Environment

        print_json(Environment.read())
        return
    from rosz.introspect.shells import SHELLS, script

    name = shell or PurePath(os.environ.get("SHELL", "")).name
    home = str(Path(__file__).parent.parent)
    for known in SHELLS:
        if name == known:
            sys.stdout.write(script(known, home, sys.executable))
            return
    if shell:
        raise UsageError(
            f"'{shell}' is no shell that is known; expected {', '.join(SHELLS)}"
            f"{near_miss(shell, SHELLS)}"
        )
    sys.stdout.write(script("bash", home, sys.executable))
