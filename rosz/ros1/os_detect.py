"""rospkg.os_detect and rospkg.distro: which system and which ROS this is."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping

__all__ = ("InvalidDistro", "OsDetect", "OsNotDetected", "current_distro_codename")

_NOETIC = "noetic"


class OsNotDetected(Exception):
    """The system does not tell what it is."""


class InvalidDistro(Exception):
    """The distribution of ROS does not exist."""


class OsDetect:
    """Tells the system by ``/etc/os-release``."""

    def _get(self, key: str) -> str:
        try:
            return platform.freedesktop_os_release().get(key, "")
        except OSError as error:
            raise OsNotDetected(f"cannot read os-release: {error.strerror}") from error

    def detect_os(self, env: Mapping[str, str] | None = None) -> tuple[str, str, str]:
        """Return name, version and code name; ``ROS_OS_OVERRIDE`` counts first (``NAME:CODENAME``).

        Args:
            env: Environment variables; those of the process when not given.

        Raises:
            OsNotDetected: The system does not tell.
        """
        given = (os.environ if env is None else env).get("ROS_OS_OVERRIDE", "")
        if given:
            name, _, codename = given.partition(":")
            return name, codename, codename
        return self._get("ID"), self._get("VERSION_ID"), self._get("VERSION_CODENAME")

    def get_name(self) -> str:
        """Return the name, such as ``debian``."""
        return self.detect_os()[0]

    def get_version(self) -> str:
        """Return the version."""
        return self.detect_os()[1]

    def get_codename(self) -> str:
        """Return the code name, such as ``bookworm``."""
        return self.detect_os()[2]


def current_distro_codename(env: Mapping[str, str] | None = None) -> str:
    """Return ``ROS_DISTRO``, or the distribution of ROS 1 that rosz follows.

    Args:
        env: Environment variables; those of the process when not given.
    """
    return (os.environ if env is None else env).get("ROS_DISTRO") or _NOETIC
