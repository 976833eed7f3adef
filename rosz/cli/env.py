"""``rosz env``: print shell code that makes ROS 1's command names run rosz.

A folder of small programs goes on the PATH, so that ``timeout 5 rostopic …``, ``nohup roscore`` and
scripts find them as well. Only roscd, which changes the working folder of the shell, is a function.
A second folder goes to the end of the PATH. It has a program for each command that rosz has not,
which names the replacement, where the machine does not have that command. A third one goes on
the PYTHONPATH, so that scripts that are run directly can import rospy. In an interactive shell, the
TAB key runs ``rosz complete``.
"""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path, PurePath
from typing import Annotated

from rosz.cli.commands import OLD_NAMES
from rosz.cli.console import print_json, print_result, warn
from rosz.cli.declare import App, Argument, Option
from rosz.errors import UsageError, near_miss

_CODE = {
    "bash": ("posix.sh", "complete.bash"),
    "zsh": ("posix.sh", "complete.zsh"),
    "fish": ("rosz.fish",),
}
"""The files with the code of each shell; values replace words such as ``@python@``."""

SHELLS = (*_CODE,)

ALIASES = {
    **{name: name for name in OLD_NAMES},
    "catkin_create_pkg": "pkg create --bare",
    "catkin_make": "pkg check --setup",
    "ros2": "ros2",
    "xacro": "run xacro xacro",
}
"""Commands of ROS, with the commands of rosz that replace them."""

_HELPERS = ("roscd", "rosed", "rosls", "rospack")

app = App()


@app.command()
def env_command(
    shell: Annotated[
        str,
        Argument("SHELL", "bash, zsh or fish; $SHELL if omitted.", lambda _: list(SHELLS)),
    ] = "",
    *,
    private: Annotated[
        bool, Option("--private", "Also keep other users of this machine out.")
    ] = False,
    editor: Annotated[
        bool, Option("--editor", "Write what editors need to know rospy and all messages.")
    ] = False,
    json: Annotated[bool, Option("--json", "Print the settings of rosz as JSON.")] = False,
) -> None:
    """Print shell code that makes rostopic, roslaunch and the like run rosz.

    Use it as: eval "$(rosz env)". In fish: rosz env fish | source
    """
    if editor:
        _write_editor(as_json=json)
        return
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
    if private:
        setting = "set -gx ROSZ_RENDEZVOUS" if name == "fish" else "export ROSZ_RENDEZVOUS="
        sys.stdout.write(f"{setting}{' ' * (name == 'fish')}private\n")
    sys.stdout.write(_script(name if name in SHELLS else "bash", home, sys.executable))


def _write_editor(*, as_json: bool) -> None:
    """Write stubs to the user's cache, and print the settings for editors."""
    from rosz.environment import Environment
    from rosz.workspace import write_stubs

    made = write_stubs(Environment.read())
    for package, fault in made.faults.items():
        warn(f"no stubs for package '{package}': {fault}")
    lines = (
        f"{made.modules} modules are in {made.folder}; 'rosz pkg check' keeps them fresh",
        f"pyright     pyrightconfig.json        {_setting('extraPaths', [made.folder])}",
        f"VS Code     .vscode/settings.json     "
        f"{_setting('python.analysis.extraPaths', [made.folder])}",
        f'mypy        [tool.mypy] in pyproject.toml   mypy_path = "{made.folder}"',
        f"the interpreter of the editor is the one that has rosz: {sys.executable}",
    )
    print_result(lines, made, as_json=as_json)


def _setting(name: str, value: object) -> str:
    import json

    return json.dumps({name: value})


def _script(shell: str, home: str, python: str) -> str:
    """Return the code for a shell to evaluate, from the folder of the package and Python."""
    values = {
        "folder": shlex.quote(f"{home}/cli/bin"),
        "absent": shlex.quote(f"{home}/cli/absent"),
        "modules": shlex.quote(f"{home}/ros1/shell"),
        "python": shlex.quote(python),
        "names": " ".join(("rosz", *ALIASES, *_HELPERS)),
    }
    text = "".join(Path(home, "cli", "shell", file).read_text("utf-8") for file in _CODE[shell])
    for name, value in values.items():
        text = text.replace(f"@{name}@", value)
    return text
