"""roslib.manifest: ``manifest.xml``, the manifest of a package of rosbuild."""

from __future__ import annotations

from pathlib import Path

from rosz.ros1.roslib import manifestlib
from rosz.ros1.roslib.manifestlib import Depend, Export, ManifestException, ROSDep, VersionControl
from rosz.ros1.roslib.packages import InvalidROSPkgException, get_pkg_dir
from rosz.ros1.rospkg import MANIFEST_FILE

__all__ = (
    "MANIFEST_FILE",
    "Depend",
    "Export",
    "Manifest",
    "ManifestException",
    "ROSDep",
    "VersionControl",
    "load_manifest",
    "manifest_file",
    "parse",
    "parse_file",
)


class Manifest(manifestlib._Manifest):  # noqa: SLF001  # as in ROS 1
    """The manifest of a package."""

    def __init__(self) -> None:
        super().__init__("package")


def manifest_file(package: str, required: bool = True) -> str | None:
    """Return the path of the manifest of a package.

    Args:
        package: Name of the package.
        required: Whether to raise an error if it has none; otherwise return None.

    Raises:
        InvalidROSPkgException: The package does not exist, or it has no manifest.
    """
    folder = get_pkg_dir(package, required)
    if folder is None:
        return None
    file = Path(folder, MANIFEST_FILE)
    if file.is_file():
        return str(file)
    if required:
        raise InvalidROSPkgException(
            f"Package '{package}' is improperly configured: no {file.name}"
        )
    return None


def load_manifest(package: str) -> Manifest:
    """Return the manifest of a package.

    Raises:
        InvalidROSPkgException: The package does not exist, or it has no manifest.
        ManifestException: It is not valid.
    """
    return parse_file(manifest_file(package) or "")


def parse_file(file: str) -> Manifest:
    """Return the manifest in a file.

    Raises:
        ManifestException: The file is not a manifest.
        ValueError: The file does not exist.
    """
    made = Manifest()
    manifestlib.parse_file(made, file)
    return made


def parse(string: str, filename: str = "string") -> Manifest:
    """Return the manifest of a text.

    Args:
        string: The text.
        filename: Ignored.

    Raises:
        ManifestException: The text is not a manifest.
    """
    made = Manifest()
    manifestlib.parse(made, string, filename)
    return made
