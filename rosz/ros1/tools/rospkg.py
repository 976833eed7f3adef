"""rospkg: packages on the package path (documentation of rospkg), from rosz's package index.

Rosdep keys of the system are missing, since nothing is installed with them.
"""

from __future__ import annotations

import builtins
import os
from collections.abc import Container, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from rosz.errors import PackageError, PackageNotFound
from rosz.packages import ManifestTag, PackageIndex, manifest_of, parse_manifest
from rosz.ros1.exceptions import raised_as
from rosz.ros1.importer import package_path

__all__ = (
    "MANIFEST_FILE",
    "PACKAGE_FILE",
    "ROS_ETC_DIR",
    "ROS_HOME",
    "ROS_LOG_DIR",
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "ROS_TEST_RESULTS_DIR",
    "STACK_FILE",
    "InvalidManifest",
    "Manifest",
    "ManifestManager",
    "ResourceNotFound",
    "RosPack",
    "RosStack",
    "get_etc_ros_dir",
    "get_log_dir",
    "get_package_name",
    "get_ros_home",
    "get_ros_package_path",
    "get_ros_paths",
    "get_ros_root",
    "get_test_results_dir",
    "list_by_path",
    "on_ros_path",
)

MANIFEST_FILE = "manifest.xml"
PACKAGE_FILE = "package.xml"
STACK_FILE = "stack.xml"

ROS_ETC_DIR = "ROS_ETC_DIR"
ROS_HOME = "ROS_HOME"
ROS_LOG_DIR = "ROS_LOG_DIR"
ROS_PACKAGE_PATH = "ROS_PACKAGE_PATH"
ROS_ROOT = "ROS_ROOT"
ROS_TEST_RESULTS_DIR = "ROS_TEST_RESULTS_DIR"

_DEPENDS = (
    "depend",
    "buildtool_depend",
    "build_depend",
    "build_export_depend",
    "buildtool_export_depend",
    "exec_depend",
    "run_depend",
    "test_depend",
)

Variables = Mapping[str, str] | None
"""Environment variables; None for those of the process."""


class ResourceNotFound(Exception):
    """A package is not on the package path.

    Attributes:
        ros_paths: Folders that were searched.
    """

    def __init__(self, msg: str, ros_paths: Sequence[str] | None = None) -> None:
        super().__init__(msg)
        self.ros_paths = ros_paths

    def __str__(self) -> str:
        lines = [str(self.args[0])]
        lines += [f"ROS path [{i}]={path}" for i, path in enumerate(self.ros_paths or ())]
        return "\n".join(lines)


class InvalidManifest(Exception):
    """A package.xml cannot be read."""


def get_ros_root(env: Variables = None) -> str | None:
    """Return ``ROS_ROOT``, or None if it is not set."""
    return (os.environ if env is None else env).get(ROS_ROOT)


def _get(env: Variables, name: str, default: str) -> str:
    return (os.environ if env is None else env).get(name, default)


def get_ros_package_path(env: Variables = None) -> str:
    """Return ``ROS_PACKAGE_PATH``; empty if it is not set."""
    return _get(env, "ROS_PACKAGE_PATH", "")


def get_ros_paths(env: Variables = None) -> list[str]:
    """Return the folders that are searched for packages, in order.

    Args:
        env: Variables to read ``ROS_PACKAGE_PATH`` from; all folders of rosz when not given.
    """
    if env is None:
        return [str(root) for root in package_path().roots]
    return [part for part in get_ros_package_path(env).split(os.pathsep) if part]


def get_ros_home(env: Variables = None) -> str:
    """Return ``ROS_HOME`` or ``~/.ros``."""
    return _get(env, "ROS_HOME", str(Path("~/.ros").expanduser()))


def get_log_dir(env: Variables = None) -> str:
    """Return ``ROS_LOG_DIR`` or ``log`` in ROS's home."""
    return _get(env, ROS_LOG_DIR, str(Path(get_ros_home(env), "log")))


def get_test_results_dir(env: Variables = None) -> str:
    """Return ``ROS_TEST_RESULTS_DIR`` or ``test_results`` in ROS's home."""
    return _get(env, ROS_TEST_RESULTS_DIR, str(Path(get_ros_home(env), "test_results")))


def get_etc_ros_dir(env: Variables = None) -> str:
    """Return ``ROS_ETC_DIR`` or ``/etc/ros``."""
    return _get(env, ROS_ETC_DIR, "/etc/ros")


def on_ros_path(p: str, env: Variables = None) -> bool:
    """Return whether a file or folder lies in a folder that is searched for packages."""
    here = Path(p).resolve()
    return any(here.is_relative_to(Path(root).resolve()) for root in get_ros_paths(env))


# Manifests (REP 127, REP 140, REP 149).


class Depend:
    """A package that another package depends on."""

    def __init__(self, name: str, type_: str = "package") -> None:
        self.name = name
        self.type = type_

    def __repr__(self) -> str:
        return self.name

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Depend) and (self.name, self.type) == (other.name, other.type)

    def __hash__(self) -> int:
        return hash((self.name, self.type))


class RosDep:
    """A dependency of a package that is not on the package path."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __repr__(self) -> str:
        return self.name


class Export:
    """An element of the ``<export>`` section of a package.xml."""

    def __init__(self, tag: str, attrs: dict[str, str], text: str) -> None:
        self.tag = tag
        self.attrs = attrs
        self.str = text

    def get(self, attr: str) -> str | None:
        """Return an attribute, or None if the element does not have it."""
        return self.attrs.get(attr)


class Manifest:
    """The content of a package.xml; texts that it does not give are empty."""

    def __init__(
        self, type_: str = "package", filename: str | None = None, is_catkin: bool = False
    ) -> None:
        self.type = type_
        self.filename = filename
        self.is_catkin = is_catkin
        self.name = self.description = self.brief = self.author = self.version = ""
        self.license = self.license_url = self.url = self.status = self.notes = ""
        self.licenses: list[str] = []
        self.depends: list[Depend] = []
        self.rosdeps: list[RosDep] = []
        self.exports: list[Export] = []

    def get_export(self, tag: str, attr: str, convert: bool = True) -> list[str]:
        """Return an attribute of all exported elements of a name.

        Args:
            tag: Name of the elements.
            attr: Name of the attribute.
            convert: Whether to replace ``${prefix}`` by the folder of the package.
        """
        tags = [export.attrs for export in self.exports if export.tag == tag]
        texts = [attributes[attr] for attributes in tags if attr in attributes]
        prefix = str(Path(self.filename or "").parent)
        return [text.replace("${prefix}", prefix) for text in texts] if convert else texts


def read_manifest(folder: Path, packages: Container[str]) -> Manifest:
    """Read the package.xml of a folder, or the manifest.xml of a package of rosbuild.

    Args:
        folder: Folder of the package.
        packages: Names of the packages on the path; other dependencies become ``rosdeps``.

    Raises:
        InvalidManifest: The file cannot be read.
    """
    is_rosbuild = manifest_of(folder) == folder / MANIFEST_FILE
    top = _parse(folder / (MANIFEST_FILE if is_rosbuild else PACKAGE_FILE))
    manifest = Manifest(filename=str(folder / MANIFEST_FILE), is_catkin=not is_rosbuild)
    manifest.description = _text(top, "description")
    manifest.url = _text(top, "url")
    exported = next((section.tags for section in top.all("export")), [])
    manifest.exports = [Export(tag.name, tag.attributes, tag.text.strip()) for tag in exported]
    if is_rosbuild:
        _read_rosbuild(manifest, folder, top)
        return manifest
    manifest.name = _text(top, "name")
    manifest.version = _text(top, "version")
    manifest.licenses = [tag.text.strip() for tag in top.all("license")]
    manifest.license = ", ".join(manifest.licenses)
    manifest.author = ", ".join(
        [f"Maintainer: {_person(tag)}" for tag in top.all("maintainer")]
        + [_person(tag) for tag in top.all("author")]
    )
    names = {tag.text.strip(): None for kind in _DEPENDS for tag in top.all(kind)}
    manifest.depends = [Depend(name) for name in names if name in packages]
    manifest.rosdeps = [RosDep(name) for name in names if name not in packages]
    return manifest


def _read_rosbuild(manifest: Manifest, folder: Path, top: ManifestTag) -> None:
    """Read a manifest.xml, whose dependencies are packages and rosdeps by their tags."""
    manifest.name = folder.name
    manifest.brief = next((tag.attributes.get("brief", "") for tag in top.all("description")), "")
    manifest.license = _text(top, "license")
    manifest.author = _text(top, "author")
    manifest.depends = [Depend(tag.attributes.get("package", "")) for tag in top.all("depend")]
    manifest.rosdeps = [RosDep(tag.attributes.get("name", "")) for tag in top.all("rosdep")]


def _parse(path: Path) -> ManifestTag:
    with raised_as(InvalidManifest, PackageError):
        return parse_manifest(path)


def _text(top: ManifestTag, name: str) -> str:
    return next((" ".join(tag.text.split()) for tag in top.all(name)), "")


def _person(tag: ManifestTag) -> str:
    name, address = tag.text.strip(), tag.attributes.get("email")
    return f"{name} <{address}>" if address else name


class ManifestManager:
    """Finds packages and reads their manifests.

    Args:
        manifest_name: Name of the manifests: ``package.xml`` or ``manifest.xml``; both are read.
        ros_paths: Folders to search; those of the process when not given.
    """

    def __init__(
        self,
        manifest_name: str,  # noqa: ARG002
        ros_paths: Sequence[str] | None = None,
    ) -> None:
        self._paths = None if ros_paths is None else tuple(map(Path, ros_paths))
        self._manifests: dict[str, Manifest] = {}
        self._caches: dict[str, Any] = {}

    @cached_property
    def _index(self) -> PackageIndex:
        return package_path() if self._paths is None else PackageIndex(self._paths)

    @property
    def ros_paths(self) -> list[str]:
        """The folders that are searched."""
        return [str(root) for root in self._index.roots]

    def get_ros_paths(self) -> list[str]:
        """Return the folders that are searched."""
        return self.ros_paths

    def list(self) -> list[str]:
        """Return the names of all packages, except those with an unreadable package.xml."""
        return self._index.names()

    def get_path(self, name: str) -> str:
        """Return the folder of a package.

        Raises:
            ResourceNotFound: The package does not exist.
            InvalidManifest: The package.xml in a folder of that name cannot be read.
        """
        try:
            return str(self._index.find(name).path)
        except PackageNotFound as error:
            raise ResourceNotFound(name, ros_paths=self.ros_paths) from error
        except PackageError as error:
            raise InvalidManifest(str(error)) from error

    def get_manifest(self, name: str) -> Manifest:
        """Return the manifest of a package; the errors are those of `get_path`."""
        if name not in self._manifests:
            folder = Path(self.get_path(name))
            self._manifests[name] = read_manifest(folder, frozenset(self.list()))
        return self._manifests[name]

    def get_depends(self, name: str, implicit: bool = True) -> Sequence[str]:
        """Return the packages on the path that a package depends on.

        Args:
            name: Name of the package.
            implicit: Whether to include the dependencies of the dependencies.

        Raises:
            ResourceNotFound: The package does not exist.
        """
        direct = [depend.name for depend in self.get_manifest(name).depends]
        if not implicit:
            return direct
        reached = {name: None}
        rest = direct
        while rest:
            package = rest.pop(0)
            if package not in reached:
                reached[package] = None
                rest += [depend.name for depend in self.get_manifest(package).depends]
        del reached[name]
        return list(reached)

    def get_depends_on(self, name: str, implicit: bool = True) -> Sequence[str]:
        """Return the packages on the path that depend on a package; see `get_depends`."""
        self.get_path(name)
        return [
            other
            for other in self.list()
            if other != name and name in self.get_depends(other, implicit)
        ]

    def get_custom_cache(self, key: str, default: Any = None) -> Any:
        """Return a value that the program stored with `set_custom_cache`."""
        return self._caches.get(key, default)

    def set_custom_cache(self, key: str, value: Any) -> None:
        """Store a value for the program."""
        self._caches[key] = value


class RosPack(ManifestManager):
    """The packages on the package path.

    Args:
        ros_paths: Folders to search; those of the process when not given.
    """

    def __init__(self, ros_paths: Sequence[str] | None = None) -> None:
        super().__init__(MANIFEST_FILE, ros_paths)

    @classmethod
    def get_instance(cls, ros_paths: Sequence[str] | None = None) -> Self:
        """Return an instance that searches these folders."""
        return cls(ros_paths)

    def get_rosdeps(self, package: str, implicit: bool = True) -> Sequence[str]:
        """Return the dependencies of a package that are not on the path; see `get_depends`."""
        names = [package, *(self.get_depends(package) if implicit else ())]
        keys = (dep.name for name in names for dep in self.get_manifest(name).rosdeps)
        return list(dict.fromkeys(keys))

    def stack_of(self, name: str) -> None:
        """Return None, since catkin packages do not belong to stacks; see `get_path`."""
        self.get_path(name)


class RosStack:
    """The stacks of rosbuild on the package path: folders with a ``stack.xml``.

    Args:
        ros_paths: Folders to search; those of the process when not given.
    """

    def __init__(self, ros_paths: Sequence[str] | None = None) -> None:
        self.ros_paths = get_ros_paths() if ros_paths is None else [*ros_paths]

    @classmethod
    def get_instance(cls, ros_paths: Sequence[str] | None = None) -> Self:
        """Return an instance."""
        return cls(ros_paths)

    @cached_property
    def _folders(self) -> dict[str, str]:
        folders: dict[str, str] = {}
        for root in reversed(self.ros_paths):
            folders |= list_by_path(STACK_FILE, root)
        return folders

    def list(self) -> builtins.list[str]:
        """Return the names of all stacks."""
        return [*self._folders]

    def get_path(self, name: str) -> str:
        """Return the folder of a stack.

        Raises:
            ResourceNotFound: The stack does not exist.
        """
        try:
            return self._folders[name]
        except KeyError:
            raise ResourceNotFound(name, ros_paths=self.ros_paths) from None

    def packages_of(self, name: str) -> Sequence[str]:
        """Return the names of the packages in a stack; the errors are those of `get_path`."""
        return RosPack([self.get_path(name)]).list()


def list_by_path(
    manifest_name: str, path: str, cache: dict[str, str] | None = None
) -> dict[str, str]:
    """Return the names and folders of the stacks or packages in a folder.

    Args:
        manifest_name: Name of the file that such a folder has.
        path: The folder.
        cache: Dict that gets them as well.
    """
    folders: dict[str, str] = {}
    for folder, below, files in os.walk(path, followlinks=True):
        if manifest_name in files:
            folders.setdefault(Path(folder).name, folder)
        if {manifest_name, PACKAGE_FILE, MANIFEST_FILE, "CATKIN_IGNORE"} & set(files):
            below.clear()
        below[:] = [name for name in sorted(below) if not name.startswith(".")]
    if cache is not None:
        cache.update(folders)
    return folders


def get_package_name(path: str) -> str | None:
    """Return the name of the package of a file or folder, or None if it lies in no package.

    Raises:
        InvalidManifest: The package.xml cannot be read.
    """
    here = Path(path).resolve()
    for folder in (here, *here.parents):
        manifest = manifest_of(folder)
        if manifest is not None:
            is_rosbuild = manifest.name == MANIFEST_FILE
            return folder.name if is_rosbuild else _text(_parse(manifest), "name")
    return None
