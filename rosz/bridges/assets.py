"""Files of packages that browsers and other clients fetch, such as meshes of a robot."""

from __future__ import annotations

import re
from functools import cached_property
from urllib.parse import unquote, urlsplit

from rosz.environment import Environment, package_index
from rosz.errors import NotFoundError, UsageError
from rosz.packages import PackageIndex

SHOWN = (
    re.compile(
        r"package://(?:[-\w%]+/)*[-\w%.]+"
        r"\.(?:dae|fbx|glb|gltf|jpeg|jpg|mtl|obj|png|stl|tif|tiff|urdf|webp|xacro)",
        re.ASCII | re.IGNORECASE,
    ),
)
"""URIs of files that clients may fetch, unless a bridge is told others."""

_LARGEST = 64 << 20


class Assets:
    """The files that clients may fetch.

    Args:
        environment: The environment that says where packages are.
        allowed: Patterns of whole URIs.
    """

    def __init__(self, environment: Environment, allowed: tuple[re.Pattern[str], ...]) -> None:
        self._environment = environment
        self._allowed = allowed

    @cached_property
    def _packages(self) -> PackageIndex:
        return package_index(self._environment)

    def read(self, uri: str) -> bytes:
        """Return the contents of a file in a package.

        Args:
            uri: ``package://`` and the path of the file, which begins with its package.

        Raises:
            UsageError: Clients may not fetch it, or it cannot be read or is too large.
            RoszError: The package or the file is not found, or the path leads out of the package.
        """
        if not any(pattern.fullmatch(uri) for pattern in self._allowed):
            raise UsageError(
                f"clients may not fetch '{uri}': the patterns of this bridge leave it out"
            )
        try:
            parts = urlsplit(uri)
        except ValueError as error:
            raise UsageError(f"'{uri}' is not a URI: {error}") from error
        if parts.scheme != "package":
            raise UsageError(f"cannot fetch '{uri}': expected package://PACKAGE/FILE")
        name, path = unquote(parts.netloc), unquote(parts.path).lstrip("/")
        package = self._packages.find(name)
        file = package.within(path)
        try:
            if not file.is_file():
                raise NotFoundError(f"package '{name}' ({package.path}) has no file '{path}'")
            if file.stat().st_size > _LARGEST:
                raise UsageError(f"'{uri}' is larger than {_LARGEST >> 20} MB, which is the limit")
            return file.read_bytes()
        except (OSError, ValueError) as error:
            raise UsageError(f"cannot read '{file}': {error}") from error
