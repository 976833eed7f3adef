"""Create packages, and the setup scripts of a workspace.

`create` makes a package that can be run at once: a message, a node that publishes it and a launch
file that starts the node. A bare package has the two files that catkin's tutorials begin with.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import escape

from rosz.errors import LaunchError, UsageError

_NAME = re.compile(r"[a-z][a-z0-9_]*", re.ASCII)

_SCRIPT = "scripts/talker.py"

_TEMPLATES = Path(__file__).with_name("templates")
_MARK = "# written by rosz pkg check --setup"


def create(
    parent: Path,
    name: str,
    dependencies: Sequence[str] = (),
    *,
    bare: bool = False,
    description: str = "",
    maintainer: str = "",
    license_name: str = "",
) -> list[Path]:
    """Create a package that can be run at once, or a bare one as catkin_create_pkg does.

    Args:
        parent: Folder to create the package in.
        name: Name of the package.
        dependencies: Names of packages that it needs.
        bare: Whether to create only package.xml, CMakeLists.txt and empty folders.
        description: Description for package.xml.
        maintainer: Name of the maintainer.
        license_name: Name of the license.

    Returns:
        The files, of which the first is package.xml, then the empty folders.

    Raises:
        UsageError: If the name is not valid.
        LaunchError: If the folder exists, or cannot be written.
    """
    folder = parent / name
    files = {"package.xml": _manifest(name, dependencies, description, maintainer, license_name)}
    empty: list[Path] = []
    if bare:
        components = f" COMPONENTS {' '.join(dependencies)}" if dependencies else ""
        files["CMakeLists.txt"] = fill_template("CMakeLists.txt", name=name, components=components)
        if "roscpp" in dependencies:
            empty.append(folder / "include" / name)
        if {"roscpp", "rospy"} & {*dependencies}:
            empty.append(folder / "src")
    else:
        files["msg/Number.msg"] = fill_template("Number.msg")
        files[_SCRIPT] = fill_template("talker.py", name=name)
        files["launch/talker.launch"] = fill_template("talker.launch", name=name)
    _write(folder, files)
    for inner in empty:
        inner.mkdir(parents=True)
    if not bare:
        (folder / _SCRIPT).chmod(0o755)
    return [*(folder / path for path in files), *empty]


def _manifest(
    name: str, dependencies: Sequence[str], description: str, maintainer: str, license_name: str
) -> str:
    if not _NAME.fullmatch(name):
        raise UsageError(
            f"'{name}' is not a valid package name; expected lower-case letters, digits and"
            " '_', a letter first"
        )
    return fill_template(
        "package.xml",
        name=name,
        description=escape(description or f"The {name} package"),
        maintainer=escape(maintainer or "user"),
        license_name=escape(license_name or "TODO"),
        dependencies="".join(
            f"  <depend>{escape(dependency)}</depend>\n" for dependency in dependencies
        ),
    )


def fill_template(file: str, **values: object) -> str:
    """Return the text of a file in ``templates``, with values in its braces."""
    return (_TEMPLATES / f"{file}.in").read_text("utf-8").format(**values)


def _write(folder: Path, files: Mapping[str, str]) -> None:
    try:
        folder.mkdir()
        for path, text in files.items():
            file = folder / path
            file.parent.mkdir(exist_ok=True)
            file.write_text(text, encoding="utf-8")
    except FileExistsError as error:
        raise LaunchError(f"'{error.filename}' exists already; choose another name") from error
    except OSError as error:
        raise LaunchError(f"cannot create '{error.filename}': {error.strerror}") from error


def write_setup(
    workspace: Path, scripts: Mapping[str, str], *, replace: bool = False
) -> list[Path]:
    """Write the files ``devel/setup.<shell>`` that users source after ``catkin_make``.

    Args:
        workspace: Folder that contains ``src``.
        scripts: Shell code that defines ROS 1's commands, by the suffix of the file.
        replace: Whether files that catkin wrote are replaced.

    Returns:
        The files.

    Raises:
        UsageError: If a file there was written by catkin.
    """
    folder = workspace / "devel"
    source = shlex.quote(str(workspace / "src"))
    files = {folder / f"setup.{shell}": text for shell, text in scripts.items()}
    for file in files:
        ours = replace or not file.exists()
        if not ours and not file.read_text("utf-8", "replace").startswith(_MARK):
            raise UsageError(
                f"'{file}' was written by catkin and is kept; to let rosz write it, remove {folder}"
            )
    folder.mkdir(exist_ok=True)
    for file, text in files.items():
        shell = "setup.fish" if file.suffix == ".fish" else "setup.sh"
        file.write_text(fill_template(shell, mark=_MARK, source=source) + text, encoding="utf-8")
    return list(files)
