"""Plug-ins of colcon, which builds workspaces of ROS 2 (the extra ``rosz[colcon]``).

colcon itself builds packages in Python. Of a package with CMake, rosz installs what needs no
compiler: definitions, and the files and modules that CMakeLists.txt installs. The setup files that
colcon writes also define the commands of rosz. Where a real ROS 2 is set up, the plug-ins change
nothing. The points that they extend are described at https://colcon.readthedocs.io.
"""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

from colcon_core.environment import EnvironmentExtensionPoint, create_environment_scripts
from colcon_core.logging import colcon_logger
from colcon_core.package_augmentation import PackageAugmentationExtensionPoint
from colcon_core.package_descriptor import PackageDescriptor
from colcon_core.python_install_path import get_python_install_path
from colcon_core.shell import create_environment_hook
from colcon_core.task import TaskExtensionPoint, create_file, install

from rosz.errors import RoszError, UsageError
from rosz.packages import MANIFEST, PackageIndex
from rosz.typestore import Kind, TypeStore
from rosz.workspace.programs import compiled_programs

_TYPE = "ros.rosz"
_SHELLS = ("bash", "zsh")
_KINDS: tuple[Kind, ...] = ("msg", "srv", "action")
_COMMENT = re.compile(r"#.*")
_INSTALL = re.compile(
    r"\binstall\s*\(\s*(?:DIRECTORY|FILES|PROGRAMS)\s+([^)]*?)\s+DESTINATION\s+([^\s)]+)",
    re.IGNORECASE,
)
_PYTHON = re.compile(r"\bament_python_install_package\s*\(\s*([^\s)]+)", re.IGNORECASE)
_LIBRARY = re.compile(r"\b(?:add_library|pybind11_add_module)\s*\(\s*([^\s)]+)", re.IGNORECASE)

_log = colcon_logger.getChild(__name__)


def _is_ros_2() -> bool:
    """Return whether a ROS 2 is set up that builds packages with CMake."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return any(Path(prefix, "share", "ament_cmake").is_dir() for prefix in prefixes if prefix)


class CMakePackages(PackageAugmentationExtensionPoint):
    """Tells colcon that rosz installs packages with CMake."""

    PRIORITY = 10
    """Below that of colcon-ros, which tells the type of a package."""

    def augment_package(self, desc: PackageDescriptor, **_options: object) -> None:
        """Give a package the type that `CMakeTask` handles."""
        if desc.type == "ros.ament_cmake" and not _is_ros_2():
            desc.type = _TYPE


class Commands(EnvironmentExtensionPoint):
    """Makes setup files define the commands of rosz, unless the shell has them already."""

    def create_environment_hooks(self, prefix: Path, package: str) -> list[Path]:
        """Write the hooks of a package; return their paths within its prefix."""
        if _is_ros_2():
            return []
        modules = str(Path(__file__).parents[1] / "ros1" / "shell")
        variables = {"ROSZ_PACKAGE_PATH": ("share", "prepend"), "PYTHONPATH": (modules, "append")}
        hooks: list[Path] = []
        for name, (value, mode) in variables.items():
            hook = f"rosz_{name.lower()}"
            hooks += create_environment_hook(hook, prefix, package, name, value, mode=mode)
        for shell in _SHELLS:
            command = f"{shlex.quote(sys.executable)} -P -m rosz env {shell}"
            hook_path = Path("share", package, "hook", f"rosz.{shell}")
            (prefix / hook_path).write_text(f'[ -n "$ROSZ_PYTHON" ] || eval "$({command})"\n')
            hooks.append(hook_path)
        return hooks


class CMakeTask(TaskExtensionPoint):
    """Installs a package with CMake; it has no tests."""

    async def build(self) -> int:
        """Install what needs no compiler; fail if something does need one."""
        args, package = self.context.args, self.context.pkg
        try:
            source = _Source(Path(args.path), package.name)
            source.check()
            for file, target in source.files(get_python_install_path("purelib", {"base": "."})):
                install(args, file, target)
        except (RoszError, OSError) as error:
            _log.error("%s: %s", package.name, error)
            return 1
        create_file(args, f"share/ament_index/resource_index/packages/{package.name}")
        base = Path(args.install_base)
        hooks = create_environment_hook("ament", base, package.name, "AMENT_PREFIX_PATH", "")
        create_environment_scripts(package, args, additional_hooks=hooks)
        return 0

    async def test(self) -> int:
        """Run no tests."""
        return 0


class _Source:
    """The sources of a package with CMake."""

    def __init__(self, path: Path, name: str) -> None:
        self._path = path
        self._name = name
        lists = path / "CMakeLists.txt"
        text = _COMMENT.sub("", lists.read_text("utf-8", "replace")) if lists.is_file() else ""
        text = re.sub(r"\$\{CMAKE_CURRENT_(SOURCE|LIST)_DIR\}/", "", text)
        self._text = re.sub(r"\$\{(CMAKE_)?PROJECT_NAME\}", name, text).replace('"', "")

    def check(self) -> None:
        """Check that the definitions are valid, and that nothing needs a compiler.

        Raises:
            RoszError: A definition is not valid, or something needs a compiler.
        """
        store = TypeStore(PackageIndex([self._path.parent]))
        compiler = {"msg": store.message, "srv": store.service, "action": store.action}
        for kind in _KINDS:
            for name in store.names(kind, self._name) if store.has(self._name, kind) else ():
                compiler[kind](name)
        compiled = [*compiled_programs(self._path), *_LIBRARY.findall(self._text)]
        if compiled:
            raise UsageError(
                f"its C++ ({', '.join(compiled)}) is not compiled: rosz has no C++ API. Leave it"
                f" out with --packages-skip {self._name}, or build it with ROS 2 and run it beside"
                " rosz (rosz help ros2)"
            )

    def files(self, modules: Path) -> Iterator[tuple[str, str]]:
        """Yield the files to install within the package, and their places within the prefix.

        Args:
            modules: The folder for modules of Python, within the prefix.

        Raises:
            UsageError: A file is missing, or has its place outside of the prefix.
        """
        share = Path("share", self._name)
        places = [(word, share) for word in (MANIFEST, *_KINDS) if (self._path / word).exists()]
        for words, destination in _INSTALL.findall(self._text):
            places += [(word, Path(destination)) for word in words.split()]
        places += [(word, modules) for word in _PYTHON.findall(self._text)]
        for word, folder in places:
            top = self._path / word
            if not top.exists():
                raise UsageError(f"'{top}' is to be installed, and does not exist")
            if Path(os.path.normpath(folder)).parts[:1] in ((os.sep,), (os.pardir,)):
                raise UsageError(f"'{word}' is to be installed outside of the prefix: '{folder}'")
            base = top if word.endswith("/") else top.parent
            for file in sorted(top.rglob("*")) if top.is_dir() else [top]:
                if file.is_file() and "__pycache__" not in file.parts:
                    place = folder / file.relative_to(base)
                    yield os.path.relpath(file, self._path), str(place)
