"""Build the C++ programs of a workspace with the catkin of the machine, if it has one."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from rosz.errors import NotFoundError

_OURS = Path(__file__).parent.parent
_PACKAGES = (
    "g++ catkin libroscpp-dev libstd-msgs-dev ros-message-generation ros-message-runtime"
    " libdynamic-reconfigure-config-init-mutex-dev python3-dynamic-reconfigure"
)


def build(workspace: Path, words: Sequence[str], environ: Mapping[str, str]) -> int:
    """Run catkin's own ``catkin_make``, which prints its steps and the errors of the compiler.

    Args:
        workspace: Folder that contains ``src``.
        words: Options and targets for ``catkin_make``.
        environ: Environment variables; the folders of rosz in them are left out.

    Returns:
        Its exit code.

    Raises:
        NotFoundError: If catkin, a C++ compiler or roscpp is not installed.
    """
    environ = {
        **environ,
        "PWD": str(workspace),  # which catkin_make takes for the working folder
        **{name: _without_ours(environ.get(name, "")) for name in ("PATH", "PYTHONPATH")},
    }
    catkin = shutil.which("catkin_make", path=environ["PATH"])
    compiler = environ.get("CXX") or shutil.which("c++", path=environ["PATH"])
    # The headers are beside it: in /usr, or in /opt/ros/noetic.
    header = Path(catkin).resolve().parent.parent / "include/ros/ros.h" if catkin else None
    there = {"catkin": catkin, "a C++ compiler": compiler, "roscpp": header and header.exists()}
    absent = [name for name, place in there.items() if not place]
    if catkin is None or absent:
        raise NotFoundError(
            f"C++ programs are not built without {' and '.join(absent)}; see 'rosz help cpp', and"
            f" type:\nsudo apt install {_PACKAGES}"
        )
    command = [catkin]
    # CMake looks for any python3, and the one of rosz has no catkin_pkg.
    first = Path(catkin).read_text("utf-8", "replace").partition("\n")[0]
    if first.startswith("#!/") and "python" in first and "env " not in first:
        command.append(f"-DPYTHON_EXECUTABLE={first[2:].split()[0]}")
    return subprocess.run([*command, *words], cwd=workspace, env=environ, check=False).returncode


def _without_ours(value: str) -> str:
    folders = value.split(os.pathsep)
    return os.pathsep.join(f for f in folders if f and not Path(f).is_relative_to(_OURS))
