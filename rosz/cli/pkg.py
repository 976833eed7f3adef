"""``rosz pkg``: list, find, create and check packages."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rosz.cli.declare import App, Argument, Option
from rosz.errors import NotFoundError

if TYPE_CHECKING:
    from rosz.packages import Package, PackageIndex

__all__ = ("app",)

app = App("List, find, create and check packages.")


@app.command("list")
def list_packages(
    *,
    names: Annotated[bool, Option("--names", "-n", help="Only their names.")] = False,
    json: Annotated[bool, Option("--json", help="As JSON.")] = False,
) -> None:
    """List all packages with their folders."""
    index = _index()
    packages = index.packages()
    for fault in index.broken:
        sys.stderr.write(f"WARNING: {fault}\n")
    if json:
        import msgspec

        rows = {package.name: str(package.path) for package in packages}
        sys.stdout.write(msgspec.json.format(msgspec.json.encode(rows)).decode() + "\n")
        return
    for package in packages:
        sys.stdout.write(f"{package.name}\n" if names else f"{package.name} {package.path}\n")


@app.command("find")
def find_package(
    name: Annotated[
        str, Argument(metavar="[PACKAGE]", help="The workspace is meant if none is named.")
    ] = "",
    *,
    json: Annotated[bool, Option("--json", help="As JSON.")] = False,
) -> None:
    """Print the folder of a package."""
    package = _index().find(name) if name else _workspace()
    if json:
        from rosz.cli.group import print_json

        print_json({"name": package.name, "path": str(package.path)})
    else:
        sys.stdout.write(f"{package.path}\n")


@app.command("create")
def create_package(
    name: Annotated[str, Argument(metavar="NAME")],
    dependencies: Annotated[list[str] | None, Argument(metavar="[DEPENDENCY]...")] = None,
    *,
    description: Annotated[
        str, Option("--description", "-d", metavar="TEXT", help="What it is.")
    ] = "",
    maintainer: Annotated[
        str, Option("--maintainer", "-m", metavar="NAME", help="Who looks after it.")
    ] = "",
    license_name: Annotated[
        str, Option("--license", "-l", metavar="NAME", help="Under what terms.")
    ] = "",
    bare: Annotated[
        bool, Option("--bare", help="Without them: two files, as catkin_create_pkg does.")
    ] = False,
) -> None:
    """Create a package in the present folder, with a message, a talker and a launch file."""
    from rosz.workspace import create, create_bare

    facts = {"description": description, "maintainer": maintainer, "license_name": license_name}
    if bare:
        made = create_bare(Path.cwd(), name, dependencies or [], **facts)
        _tell_of_bare(made, Path.cwd())
    else:
        folder = create(Path.cwd(), name, dependencies or [], **facts)
    index = _index()
    for dependency in dependencies or []:
        if dependency not in index.names() and dependency not in _BUILT_IN:
            sys.stderr.write(f"WARNING: dependency '{dependency}' is not on the package path\n")
    if not bare:
        sys.stdout.write(
            f"created {folder}\nrun it with: rosz launch {folder / 'launch' / 'talker.launch'}\n"
        )


def _tell_of_bare(made: Sequence[Path], parent: Path) -> None:
    """Say what has been made, in the words of catkin_create_pkg."""
    for path in made:
        kind = "folder" if path.is_dir() else "file"
        sys.stdout.write(f"Created {kind} {path.relative_to(parent)}\n")
    sys.stdout.write(
        f"Successfully created files in {made[0].parent}."
        " Please adjust the values in package.xml.\n"
    )


@app.command("check", tolerant=True)
def check_command(
    words: Annotated[
        list[str] | None,
        Argument(
            metavar="[FOLDER|PACKAGE]...", help="The workspace around the present folder, if none."
        ),
    ] = None,
    *,
    setup: Annotated[
        bool, Option("--setup", help="Write devel/setup.bash and its kin, as catkin_make.")
    ] = False,
    json: Annotated[bool, Option("--json", help="As JSON.")] = False,
) -> int:
    """Check packages: manifest, definitions, launch files, .cfg files and scripts.

    Exit code 1 if there is an error. Options and targets of catkin_make are passed over.
    """
    from rosz.cli.pkg_check import check_packages, set_up

    code = check_packages(words or (), as_json=json)
    if setup:
        set_up()
    return code


# What ROS 1 packages list as dependencies and rosz brings, though not as packages.
_BUILT_IN = frozenset(
    {"catkin", "message_generation", "message_runtime", "roslib", "rospy", "roscpp"}
)


def _workspace() -> Package:
    """Return the first place that packages are looked for in, as ``roscd`` alone goes there.

    Raises:
        NotFoundError: There is none but what is installed.
    """
    from rosz.environment import Environment
    from rosz.packages import Package

    for root in Environment.read().package_roots:
        path = root.parent if root.name == "src" else root
        return Package(path.name, path)
    raise NotFoundError(
        "no workspace: ROSZ_PACKAGE_PATH is not set, and no folder 'src' or package.xml is here or"
        " above"
    )


def _index() -> PackageIndex:
    from rosz.environment import Environment, package_index

    return package_index(Environment.read())
