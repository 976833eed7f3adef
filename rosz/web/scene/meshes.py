"""Meshes of robots and markers: files of packages, in a form that browsers read.

STL and GLB go to the browser as they are; OBJ and Collada (DAE) become GLB, by ``trimesh``. A file
comes from the folder of a package, and so does what it refers to.
"""

from __future__ import annotations

import io
import posixpath
import re
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import msgspec

from rosz.bridges.assets import SHOWN, Assets
from rosz.environment import Environment, package_index
from rosz.errors import RoszError, UsageError

__all__ = ("Mesh", "Meshes")

_AS_THEY_ARE = {".stl": "stl", ".glb": "glb"}
_CONVERTED = (".dae", ".obj")
_MEDIA = {"stl": "model/stl", "glb": "model/gltf-binary"}
_UNIT = re.compile(rb"<unit\b[^>]*\bmeter=[\"']([^\"']*)")
_LIBRARY = "needs libraries: pip install 'rosz[web]'"

Publish = Callable[[Callable[[], tuple[bytes, str]]], str]


class Mesh(msgspec.Struct, frozen=True):
    """A mesh that browsers can fetch.

    Attributes:
        address: Where.
        form: ``stl`` or ``glb``.
        colored: Whether it has colors of its own.
    """

    address: str
    form: str
    colored: bool


class Meshes:
    """The meshes that a page shows.

    Args:
        environment: The environment that says where packages are.
        add: Function that gives the contents of a file an address.
    """

    def __init__(self, environment: Environment, add: Publish) -> None:
        self._environment = environment
        self._assets = Assets(environment, SHOWN)
        self._add = add
        self._lock = threading.Lock()
        self._found: dict[str, Mesh | str] = {}

    def find(self, uri: str) -> Mesh:
        """Return a mesh.

        Args:
            uri: ``package://PACKAGE/FILE``, or ``file://`` and the path of a file in a package.

        Raises:
            UsageError: It cannot be shown; the text says why.
        """
        with self._lock:
            found = self._found.get(uri)
            if found is None:
                try:
                    found = self._open(uri)
                except RoszError as error:
                    found = str(error)
                self._found[uri] = found
        if isinstance(found, str):
            raise UsageError(found)
        return found

    def _open(self, uri: str) -> Mesh:
        ending = posixpath.splitext(urlsplit(uri).path)[1].lower()
        form = _AS_THEY_ARE.get(ending, "glb")
        if ending not in _AS_THEY_ARE and ending not in _CONVERTED:
            known = ", ".join((*_AS_THEY_ARE, *_CONVERTED))
            raise UsageError(f"'{uri}' cannot be shown; expected one of {known}")
        inside = self._in_package(uri)
        data = self._assets.read(inside)
        if ending in _CONVERTED:
            data = _converted(inside, data, ending[1:], self._assets)
        address = self._add(lambda: (data, _MEDIA[form]))
        return Mesh(address, form, form == "glb")

    def _in_package(self, uri: str) -> str:
        """Return a URI of a package, also for the path of a file in one."""
        parts = urlsplit(uri)
        if parts.scheme != "file":
            return uri
        path = Path(posixpath.normpath(unquote(parts.path)))
        for package in package_index(self._environment).packages():
            if path.is_relative_to(package.path):
                return f"package://{package.name}/{path.relative_to(package.path)}"
        raise UsageError(f"'{uri}' is in no package; only files of packages are shown")


class _Resolver:
    """Loads the files that a mesh refers to, from its folder and its package.

    Args:
        uri: URI of the mesh.
        assets: The files of packages.
    """

    def __init__(self, uri: str, assets: Assets) -> None:
        self._folder = uri.rpartition("/")[0]
        self._assets = assets

    def get(self, name: str) -> bytes:
        """Return a file, as ``trimesh`` asks for it.

        Raises:
            OSError: It cannot be read; ``trimesh`` goes on without it.
        """
        scheme, _, path = f"{self._folder}/{name}".partition("://")
        try:
            return self._assets.read(f"{scheme}://{posixpath.normpath(path)}")
        except RoszError as error:
            raise FileNotFoundError(str(error)) from error

    def __getitem__(self, name: str) -> bytes:
        return self.get(name)


def _converted(uri: str, data: bytes, kind: str, assets: Assets) -> bytes:
    """Return a mesh as GLB.

    Raises:
        UsageError: It is not well-formed, or a library is not installed.
    """
    try:
        import collada  # noqa: F401  # trimesh needs it for DAE, and says so late
        import trimesh
    except ImportError as error:
        raise UsageError(f"'{uri}' {_LIBRARY}") from error
    resolver: Any = _Resolver(uri, assets)
    try:
        scene: Any = trimesh.load_scene(io.BytesIO(data), file_type=kind, resolver=resolver)
        factor = _metres(data) if kind == "dae" else 1.0
        if factor != 1.0:
            scene.apply_scale(factor)
        exported = scene.export(file_type="glb")
    except Exception as error:  # its parsers raise whatever bytes lead them to
        raise UsageError(f"'{uri}' is not a mesh that can be read: {error}") from error
    return bytes(exported)


def _metres(collada: bytes) -> float:
    """Return the metres of the unit of a Collada file.

    Raises:
        ValueError: It is not a number.
    """
    unit = _UNIT.search(collada)
    return 1.0 if unit is None else float(unit[1])
