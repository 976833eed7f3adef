"""Repositories, their packages, and the repositories that these depend on."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from rosz.packages import crawl

__all__ = ("Corpus", "Package", "Repository")

_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")
_DEPENDS = re.compile(r"<(?:\w*_)?depend(?:\s[^>]*)?>\s*([^<\s]+)\s*</")
_ROSBUILD_DEPENDS = re.compile(r"<depend\s+package=[\"']([^\"']+)")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_SYSTEM = Path("/usr/share")


class Package(NamedTuple):
    """A package.

    Attributes:
        name: Its name.
        path: Its folder.
        depends: The packages that its manifest names.
    """

    name: str
    path: Path
    depends: frozenset[str]

    def definitions(self, kind: str) -> list[Path]:
        """Return the definitions of ``msg``, ``srv`` or ``action``, sorted."""
        return sorted((self.path / kind).glob(f"*.{kind}"))

    @property
    def has_types(self) -> bool:
        """Whether the package defines types."""
        return any(self.definitions(kind) for kind in ("msg", "srv", "action"))


class Repository:
    """A checkout.

    Args:
        path: Its folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def name(self) -> str:
        """The name of the folder."""
        return self.path.name

    @cached_property
    def packages(self) -> dict[str, Package]:
        """The packages by name."""
        found = (_package(folder) for folder in sorted(crawl(self.path)))
        return {package.name: package for package in reversed(list(found))}


class Corpus:
    """Several repositories.

    Args:
        paths: Their folders.
        installed: Names of repositories that ROS 1 users have installed; rosz has its own modules
            and types in their place, so only the other side finds them.
    """

    def __init__(self, paths: Sequence[Path], installed: Sequence[str] = ()) -> None:
        self.repositories = [Repository(path.resolve()) for path in paths]
        self._installed = frozenset(installed)
        self._home = {
            package: repository
            for repository in reversed(self.repositories)
            for package in repository.packages
        }

    def workspace(self, repository: Repository, *, real: bool) -> list[Repository]:
        """Return a repository and those that hold what it depends on, itself first.

        Args:
            repository: The repository.
            real: Whether for ROS 1, which finds the installed repositories, too.
        """
        found = [repository]
        if real:
            found += [one for one in self.repositories if one.name in self._installed]
        for one in found:
            names = {name for package in one.packages.values() for name in package.depends}
            for name in sorted(names):
                other = self._home.get(name)
                if other is None or other in found or name in repository.packages:
                    continue
                if other.name not in self._installed:
                    found.append(other)
        return found

    def path(self, repository: Repository, *, real: bool) -> str:
        """Return the ``ROS_PACKAGE_PATH`` of a repository."""
        roots = [one.path for one in self.workspace(repository, real=real)]
        return ":".join(map(str, [*roots, _SYSTEM] if real else roots))


def _package(folder: Path) -> Package:
    manifest = folder / "package.xml"
    if not manifest.is_file():  # a package of rosbuild, which has the name of its folder
        text = (folder / "manifest.xml").read_text("utf-8", "replace")
        return Package(folder.name, folder, frozenset(_ROSBUILD_DEPENDS.findall(text)))
    text = _COMMENT.sub("", manifest.read_text("utf-8", "replace"))
    name = _NAME.search(text)
    return Package(name[1] if name else folder.name, folder, frozenset(_DEPENDS.findall(text)))
