"""roslib.stack_manifest: ``stack.xml``, the manifest of a stack of rosbuild."""

from __future__ import annotations

from rosz.ros1.roslib import manifestlib
from rosz.ros1.roslib.manifestlib import ManifestException, StackDepend
from rosz.ros1.rospkg import STACK_FILE

__all__ = (
    "STACK_FILE",
    "ManifestException",
    "StackDepend",
    "StackManifest",
    "parse",
    "parse_file",
)


class StackManifest(manifestlib._Manifest):  # noqa: SLF001  # as in ROS 1
    """The manifest of a stack."""

    def __init__(self) -> None:
        super().__init__("stack")


def parse_file(file: str) -> StackManifest:
    """Return the manifest in a file.

    Raises:
        ManifestException: The file is not a manifest of a stack.
        ValueError: The file does not exist.
    """
    made = StackManifest()
    manifestlib.parse_file(made, file)
    return made


def parse(string: str, filename: str = "string") -> StackManifest:
    """Return the manifest of a text.

    Args:
        string: The text.
        filename: Ignored.

    Raises:
        ManifestException: The text is not a manifest of a stack.
    """
    made = StackManifest()
    manifestlib.parse(made, string, filename)
    return made
