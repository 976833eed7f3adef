"""``python -m rosz.ros1 SCRIPT [ARGUMENTS]``: run a Python script with ROS 1's names importable.

A name of a command of ROS 1, such as ``rosparam``, runs that command of rosz, unless it is a file.
``--container`` in place of a script runs several; see `rosz.ros1.container`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from rosz.errors import RoszError

_USAGE = "usage: python -m rosz.ros1 SCRIPT [ARGUMENTS]\n"


def main(argv: Sequence[str], begin: Callable[[], object] | None = None) -> None:
    """Run the script that the command line names.

    Args:
        argv: Arguments without the program name.
        begin: Function to call right before the script runs.
    """
    if argv and argv[0] == "--container":
        from rosz.ros1.container import main as run_several

        sys.exit(run_several(argv[1:], begin))
    from rosz.ros1.importer import install
    from rosz.ros1.script import Script

    if not argv or argv[0] in {"-h", "--help"}:
        sys.stderr.write(_USAGE)
        sys.exit(0 if argv else 2)
    try:
        install()
        script = Script(_script(argv[0]))
    except RoszError as error:
        sys.stderr.write(f"ERROR: {error}\n")
        sys.exit(1)
    if begin is not None:
        begin()
    script.run(argv[1:])


def _script(word: str) -> str:
    """Return the path of a script, which may be given as the name of a command of ROS 1."""
    command = Path(__file__).parents[1] / "share" / word / word
    if "/" not in word and not Path(word).exists() and command.is_file():
        return str(command)
    return word


if __name__ == "__main__":
    main(sys.argv[1:])
