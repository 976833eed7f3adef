"""``rosz env``: print shell code that makes ROS 1's command names run rosz."""

from __future__ import annotations

import os
import sys
from pathlib import Path, PurePath
from typing import Annotated

from rosz.cli import suggest
from rosz.cli.console import print_json
from rosz.cli.declare import App, Argument, Option
from rosz.cli.shells import SHELLS, script
from rosz.errors import UsageError, near_miss

__all__ = ("app",)

app = App()


@app.command()
def env_command(
    shell: Annotated[
        str,
        Argument(
            "SHELL", "bash, zsh or fish; the one in the variable SHELL if omitted.", suggest.shells
        ),
    ] = "",
    *,
    json: Annotated[bool, Option("--json", "Print the settings of rosz as JSON.")] = False,
) -> None:
    """Print shell code that makes rostopic, roslaunch and the like run rosz.

    Use it as: eval "$(rosz env)". In fish: rosz env fish | source
    """
    if json:
        from rosz.environment import Environment

        print_json(Environment.read())
        return
    name = shell or PurePath(os.environ.get("SHELL", "")).name
    if shell and shell not in SHELLS:
        raise UsageError(
            f"'{shell}' is not a known shell; expected {', '.join(SHELLS)}"
            f"{near_miss(shell, SHELLS)}"
        )
    home = str(Path(__file__).parent.parent)
    sys.stdout.write(script(name if name in SHELLS else "bash", home, sys.executable))
