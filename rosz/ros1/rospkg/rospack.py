"""rospkg's look at the packages on the path."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Self
from xml.etree import ElementTree as ET

from rosz.errors import PackageError, PackageNotFound
from rosz.packages import PackageIndex
from rosz.ros1.importer import package_path
from rosz.ros1.rospkg.manifest import (
    MANIFEST_FILE,
    PACKAGE_FILE,
    InvalidManifest,
    Manifest,
    ResourceNotFound,
    read_manifest,
)

__all__ = ("RosPack", "RosStack", "get_package_name")


class RosPack:
    """Finds packages and reads what they say about themselves.

    Args:
        ros_paths: Folders to look in; those of the process when not given.
    """

    def __init__(self, ros_paths: Sequence[str] | None = None) -> None:
        self._paths = None if ros_paths is None else tuple(map(Path, ros_paths))
        self._manifests: dict[str, Manifest] = {}
        self._caches: dict[str, Any] = {}

    @classmethod
    def get_instance(cls, ros_paths: Sequence[str] | None = None) -> Self:
        """Return one that looks in these folders."""
        return cls(ros_paths)

    @cached_property
    def _index(self) -> PackageIndex:
        return package_path() if self._paths is None else PackageIndex(self._paths)

    @property
    def ros_paths(self) -> list[str]:
        """The folders that are looked in."""
        return [str(root) for root in self._index.roots]

    def get_ros_paths(self) -> list[str]:
        """Return the folders that are looked in."""
        return self.ros_paths

    def list(self) -> list[str]:
        """Return the names of all packages; those whose package.xml cannot be read are left out."""
        return self._index.names()

    def get_path(self, name: str) -> str:
        """Return the folder of a package.

        Raises:
            ResourceNotFound: There is none of that name.
            InvalidManifest: The package.xml in a folder of that name cannot be read.
        """
        try:
            return str(self._index.find(name).path)
        except PackageNotFound as error:
            raise ResourceNotFound(name, ros_paths=self.ros_paths) from error
        except PackageError as error:
            raise InvalidManifest(str(error)) from error

    def get_manifest(self, name: str) -> Manifest:
        """Return what a package says about itself.

        Raises:
            ResourceNotFound: There is no package of that name.
            InvalidManifest: Its package.xml cannot be read.
        """
        if name not in self._manifests:
            folder = Path(self.get_path(name))
            self._manifests[name] = read_manifest(folder, frozenset(self.list()))
        return self._manifests[name]

    def get_depends(self, name: str, implicit: bool = True) -> Sequence[str]:
        """Return the packages on the path that a package needs.

        Args:
            name: The package.
            implicit: Whether to go on to those that they need in turn.

        Raises:
            ResourceNotFound: There is no package of that name.
        """
        found = [depend.name for depend in self.get_manifest(name).depends]
        if not implicit:
            return found
        known = {name: None}
        rest = found
        while rest:
            one = rest.pop(0)
            if one not in known:
                known[one] = None
                rest += [depend.name for depend in self.get_manifest(one).depends]
        del known[name]
        return list(known)

    def get_depends_on(self, name: str, implicit: bool = True) -> Sequence[str]:
        """Return the packages on the path that need a package; see `get_depends`.

        Raises:
            ResourceNotFound: There is no package of that name.
        """
        self.get_path(name)
        return [
            other
            for other in self.list()
            if other != name and name in self.get_depends(other, implicit)
        ]

    def get_rosdeps(self, package: str, implicit: bool = True) -> Sequence[str]:
        """Return what of the system a package needs; see `get_depends`."""
        names = [package, *(self.get_depends(package) if implicit else ())]
        found = {dep.name: None for one in names for dep in self.get_manifest(one).rosdeps}
        return list(found)

    def stack_of(self, name: str) -> None:
        """Return None: packages of today belong to no stack.

        Raises:
            ResourceNotFound: There is no package of that name.
        """
        self.get_path(name)

    def get_custom_cache(self, key: str, default: Any = None) -> Any:
        """Return what a program keeps here under a name."""
        return self._caches.get(key, default)

    def set_custom_cache(self, key: str, value: Any) -> None:
        """Keep a value for a program."""
        self._caches[key] = value


class RosStack:
    """Stacks, of which there are none any more.

    Args:
        ros_paths: Where none are looked for.
    """

    def __init__(self, ros_paths: Sequence[str] | None = None) -> None:
        self.ros_paths = list(ros_paths or ())

    @classmethod
    def get_instance(cls, ros_paths: Sequence[str] | None = None) -> Self:
        """Return one."""
        return cls(ros_paths)

    def list(self) -> Sequence[str]:
        """Return no names."""
        return []

    def get_path(self, name: str) -> str:
        """Find no stack.

        Raises:
            ResourceNotFound: Always.
        """
        raise ResourceNotFound(name, ros_paths=self.ros_paths)


def get_package_name(path: str) -> str | None:
    """Return the name of the package that a file or folder lies in; None if in none.

    Raises:
        InvalidManifest: Its package.xml cannot be read.
    """
    here = Path(path).resolve()
    for folder in (here, *here.parents):
        manifest = folder / PACKAGE_FILE
        if manifest.is_file():
            try:
                name = ET.parse(manifest).getroot().findtext("name")  # noqa: S314  # the user's
            except ET.ParseError as error:
                raise InvalidManifest(f"[{manifest}] cannot be read: {error}") from error
            return (name or "").strip()
        if (folder / MANIFEST_FILE).is_file():
            return folder.name
    return None
