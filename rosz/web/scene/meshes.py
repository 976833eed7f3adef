"""Meshes of robots and markers: files of packages, in a form that browsers read.

STL and GLB go to the browser as they are; OBJ, Collada (DAE), glTF and a GLB that refers to other
files become GLB, by ``trimesh``. A file comes from the folder of a package, and so does what it
refers to, such as textures.
"""

from __future__ import annotations

import io
import json
import posixpath
import re
import struct
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import unquote, urlsplit

import msgspec
import numpy as np

from rosz.bridges.assets import Assets
from rosz.environment import Environment, package_index
from rosz.errors import RoszError, UsageError
from rosz.web.scene.drawing import Array

_AS_THEY_ARE = {".stl": "stl", ".glb": "glb"}
_CONVERTED = (".dae", ".gltf", ".obj")
_PICTURES = (".bmp", ".gif", ".jpeg", ".jpg", ".png", ".tga", ".tif", ".tiff", ".webp")
_NO_PICTURES = (".bin", ".mtl")
_ENDINGS = "|".join(map(re.escape, (*_AS_THEY_ARE, *_CONVERTED, *_PICTURES, *_NO_PICTURES)))
_FILES = re.compile(f"package://.+(?:{_ENDINGS})", re.IGNORECASE)
_GLB_HEADER = struct.Struct("<4sIII4s")
_GLB_CHUNK = struct.Struct("<I4s")
_MEDIA = {"stl": "model/stl", "glb": "model/gltf-binary"}
_UNIT = re.compile(rb"<unit\b[^>]*\bmeter=[\"']([^\"']*)")
_LIBRARY = "needs libraries: pip install 'rosz[web]'"

T = TypeVar("T")

Publish = Callable[[Callable[[], tuple[bytes, str]]], str]


_PICTURE_MEDIA = {"JPEG": "image/jpeg", "PNG": "image/png", "WEBP": "image/webp"}
"""Formats that browsers can show; pictures in other formats are converted to PNG."""


class Mesh(msgspec.Struct, frozen=True):
    """A mesh that browsers can fetch.

    Attributes:
        address: Where.
        form: ``stl`` or ``glb``.
        colored: Whether it has materials of its own.
        mapped: Whether it has texture coordinates.
        missing: Why files that it refers to are not shown.
    """

    address: str
    form: str
    colored: bool
    mapped: bool
    missing: tuple[str, ...]


class Texture(msgspec.Struct, frozen=True):
    """A texture that browsers can fetch.

    Attributes:
        address: Where.
        color: Color of its first pixel, which a mesh without texture coordinates gets, as in rviz.
    """

    address: str
    color: Array


class Meshes:
    """The meshes that a page shows.

    Args:
        environment: The environment that says where packages are.
        add: Function that gives the contents of a file an address.
    """

    def __init__(self, environment: Environment, add: Publish) -> None:
        self._environment = environment
        self._assets = Assets(environment, (_FILES,))
        self._add = add
        self._lock = threading.Lock()
        self._found: dict[str, Mesh | str] = {}
        self._textures: dict[str, Texture | str] = {}

    def find(self, uri: str) -> Mesh:
        """Return a mesh.

        Args:
            uri: ``package://PACKAGE/FILE``, or ``file://`` and the path of a file in a package.

        Raises:
            UsageError: It cannot be shown; the text says why.
        """
        return self._once(uri, self._found, self._open)

    def texture(self, uri: str) -> Texture:
        """Return a texture; its URI and the error are as those of a mesh."""
        return self._once(uri, self._textures, self._open_texture)

    def _once(self, uri: str, cache: dict[str, T | str], read: Callable[[str], T]) -> T:
        """Return the contents of a file; they, or the reason of a failure, are kept."""
        with self._lock:
            mesh = cache.get(uri)
            if mesh is None:
                try:
                    mesh = read(uri)
                except (RoszError, ValueError) as error:  # a URI may be malformed
                    mesh = str(error)
                cache[uri] = mesh
        if isinstance(mesh, str):
            raise UsageError(mesh)
        return mesh

    def _open_texture(self, uri: str) -> Texture:
        data, media, color = read_texture(uri, _read_picture(self._assets, self._in_package(uri)))
        return Texture(self._add(lambda: (data, media)), color)

    def _open(self, uri: str) -> Mesh:
        ending = posixpath.splitext(urlsplit(uri).path)[1].lower()
        form = _AS_THEY_ARE.get(ending, "glb")
        if ending not in _AS_THEY_ARE and ending not in _CONVERTED:
            formats = ", ".join((*_AS_THEY_ARE, *_CONVERTED))
            raise UsageError(f"'{uri}' cannot be shown; expected one of {formats}")
        inside = self._in_package(uri)
        data = self._assets.read(inside)
        colored = _has_materials(ending, data)
        missing: tuple[str, ...] = ()
        if ending in _CONVERTED or (ending == ".glb" and not _is_self_contained(data)):
            resolver = _Resolver(inside, self._assets, self._in_package)
            data = _converted(inside, data, ending[1:], resolver)
            missing = tuple(resolver.missing.values())
        address = self._add(lambda: (data, _MEDIA[form]))
        mapped = form == "glb" and b'"TEXCOORD_0"' in data
        return Mesh(address, form, colored, mapped, missing)

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
    """Loads the files that a mesh refers to, and keeps why it cannot, by their names."""

    def __init__(self, uri: str, assets: Assets, in_package: Callable[[str], str]) -> None:
        self._folder = uri.rpartition("/")[0]
        self._assets = assets
        self._in_package = in_package
        self.missing: dict[str, str] = {}

    def get(self, name: str) -> bytes:
        """Return a file, as ``trimesh`` asks for it.

        Raises:
            OSError: It cannot be read; ``trimesh`` goes on without it.
        """
        path = name.strip().replace("\\", "/")
        uri = path if "://" in path else f"{self._folder}/{path}"
        try:
            scheme, _, rest = self._in_package(uri).partition("://")
            uri = f"{scheme}://{posixpath.normpath(rest)}"
            if uri.lower().endswith(_NO_PICTURES):
                return self._assets.read(uri)
            return read_texture(uri, _read_picture(self._assets, uri))[0]
        except RoszError as error:
            self.missing[name] = f"without '{name}': {error}"
            raise FileNotFoundError(str(error)) from error

    __getitem__ = get


def _read_picture(assets: Assets, uri: str) -> bytes:
    """Return the contents of a picture of a package."""
    if not uri.lower().endswith(_PICTURES):
        raise UsageError(f"'{uri}' cannot be shown; expected one of {', '.join(_PICTURES)}")
    return assets.read(uri)


def read_texture(uri: str, data: bytes) -> tuple[bytes, str, Array]:
    """Return a picture for browsers, its media type, and the color of its first pixel.

    Args:
        uri: Where it is from.
        data: The contents of the file.

    Raises:
        UsageError: It is not a picture that can be read, or a library is not installed.
    """
    try:
        from PIL import Image
    except ImportError as error:
        raise UsageError(f"'{uri}' needs a library: pip install 'rosz[web]'") from error
    try:
        with Image.open(io.BytesIO(data)) as picture:
            form = picture.format or ""
            whole = picture.convert("RGBA")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise UsageError(f"'{uri}' is not a picture that can be read: {error}") from error
    color = np.array(whole.getpixel((0, 0)), dtype=np.uint8)
    if form not in _PICTURE_MEDIA:
        buffer = io.BytesIO()
        whole.save(buffer, "PNG")
        form, data = "PNG", buffer.getvalue()
    return data, _PICTURE_MEDIA[form], color


def _has_materials(ending: str, data: bytes) -> bool:
    """Return whether a mesh has materials of its own."""
    sign = {".dae": b"<instance_material", ".obj": b"usemtl", ".stl": b""}.get(ending, b"material")
    return bool(sign) and sign in data


def _is_self_contained(glb: bytes) -> bool:
    """Return whether a GLB refers to no other files, however a browser reads it.

    three.js takes what does not begin as a GLB for the text of a glTF, and the last of several
    chunks of JSON for the only one. It fetches each ``uri`` that is not data.
    """
    try:
        magic, version, size, length, kind = _GLB_HEADER.unpack_from(glb)
        start = _GLB_HEADER.size + length
        tree = json.loads(glb[_GLB_HEADER.size : start])
        while start < size:
            extent, other = _GLB_CHUNK.unpack_from(glb, start)
            start += _GLB_CHUNK.size + extent
            if other == b"JSON":
                return False
    except (struct.error, ValueError, RecursionError):
        return False
    if (magic, version, kind, size) != (b"glTF", 2, b"JSON", len(glb)):
        return False
    return all(uri.startswith("data:") and "," in uri for uri in _uris(tree))


def _uris(tree: Any) -> Iterator[str]:
    """Yield everything in a glTF that is called a URI."""
    waiting = [tree]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            if "uri" in value:
                yield str(value["uri"])
            waiting.extend(value.values())
        elif isinstance(value, list):
            waiting.extend(value)


def _converted(uri: str, data: bytes, kind: str, resolver: Any) -> bytes:
    """Return a mesh as GLB."""
    try:
        import collada  # noqa: F401  # trimesh needs it for DAE, and says so late
        import PIL  # noqa: F401  # trimesh goes on without textures where it is missing
        import trimesh
    except ImportError as error:
        raise UsageError(f"'{uri}' {_LIBRARY}") from error
    try:
        scene: Any = trimesh.load_scene(io.BytesIO(data), file_type=kind, resolver=resolver)
        unit = _UNIT.search(data) if kind == "dae" else None
        if unit is not None and float(unit[1]) != 1.0:
            scene.apply_scale(float(unit[1]))
        exported = scene.export(file_type="glb")
    except Exception as error:  # its parsers raise whatever bytes lead them to
        raise UsageError(f"'{uri}' is not a mesh that can be read: {error}") from error
    return bytes(exported)
