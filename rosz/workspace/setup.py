"""``devel/setup.bash`` and its kin, which course documents source after ``catkin_make``."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path

from rosz.errors import UsageError

__all__ = ("write_setup",)

_MARK = "# written by rosz pkg check --setup"
_POSIX = """\
{mark}: the packages of this workspace are found, and ROS 1's commands mean rosz
case ":${{ROSZ_PACKAGE_PATH-}}:" in
  *:{source}:*) ;;
  *) export ROSZ_PACKAGE_PATH={source}"${{ROSZ_PACKAGE_PATH:+:$ROSZ_PACKAGE_PATH}}" ;;
esac
"""
_FISH = """\
{mark}: the packages of this workspace are found, and ROS 1's commands mean rosz
if not contains {source} (string split : -- "$ROSZ_PACKAGE_PATH")
    set -gx ROSZ_PACKAGE_PATH (string trim --right --chars : -- {source}:"$ROSZ_PACKAGE_PATH")
end
"""


def write_setup(workspace: Path, scripts: Mapping[str, str]) -> list[Path]:
    """Write ``devel/setup.<shell>``, and return the files.

    Args:
        workspace: Folder with ``src`` in it.
        scripts: What each shell has to evaluate for ROS 1's commands, by the suffix of its file.

    Raises:
        UsageError: A file there is not ours: catkin has built this workspace.
    """
    folder = workspace / "devel"
    source = shlex.quote(str(workspace / "src"))
    files = {folder / f"setup.{shell}": text for shell, text in scripts.items()}
    for file in files:
        if file.exists() and not file.read_text("utf-8", "replace").startswith(_MARK):
            raise UsageError(
                f"'{file}' is catkin's and stays; remove {folder} to have rosz write one"
            )
    folder.mkdir(exist_ok=True)
    for file, text in files.items():
        head = _FISH if file.suffix == ".fish" else _POSIX
        file.write_text(head.format(mark=_MARK, source=source) + text, encoding="utf-8")
    return list(files)
