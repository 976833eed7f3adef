"""Debian's Python modules that are not of ROS, for the interpreter of rosz.

Both sides then have the same numpy, OpenCV, wx and pymongo, in the same versions.
"""

from __future__ import annotations

import subprocess
from importlib.metadata import packages_distributions
from pathlib import Path

__all__ = ("link",)

_DEBIAN = Path("/usr/lib/python3/dist-packages")
_PLAIN = frozenset({"catkin_pkg"})
"""Modules whose Debian package is named as ROS's are, and that are distributions of PyPI."""
_SAME = frozenset(
    {"PIL", "_cffi_backend", "cryptography", "cv2", "lz4", "numpy", "serial"}
    | {"matplotlib", "mpl_toolkits"}  # PyPI's ones need a newer numpy than Debian's
)
"""Modules that are taken from Debian though the interpreter of rosz has them, too."""
_INSTALLERS = frozenset({"_distutils_hack", "pip", "pkg_resources", "setuptools", "wheel"})


def link(folder: Path) -> Path:
    """Fill a folder for ``PYTHONPATH`` with links to the modules; return it."""
    folder.mkdir(parents=True, exist_ok=True)
    own = (set(packages_distributions()) - _SAME) | _INSTALLERS
    of_ros = _of_ros()
    for path in sorted(_DEBIAN.iterdir()):
        name = path.name.partition(".")[0]
        module = (path.is_dir() and "." not in path.name) or path.suffix in {".py", ".so"}
        if not module or name in own or (path in of_ros and name not in _PLAIN):
            continue
        if not (folder / path.name).is_symlink():
            (folder / path.name).symlink_to(path)
    return folder


def _of_ros() -> set[Path]:
    """Return the modules that Debian builds from a source package of ROS."""
    show = ["dpkg-query", "--show", "--showformat", "${binary:Package} ${source:Package}\n"]
    found = subprocess.run(show, capture_output=True, text=True, check=True).stdout
    rows = (line.split() for line in found.splitlines())
    names = [row[0] for row in rows if len(row) == 2 and row[1].startswith("ros-")]
    listed = subprocess.run(
        ["dpkg-query", "--listfiles", *names], capture_output=True, text=True, check=True
    ).stdout
    return {
        _DEBIAN / Path(line).relative_to(_DEBIAN).parts[0]
        for line in listed.splitlines()
        if line.startswith(f"{_DEBIAN}/")
    }
