"""resource_retriever: files of packages and of the web, by URL (ROS wiki, resource_retriever)."""

from __future__ import annotations

from typing import Final
from urllib.error import URLError
from urllib.request import urlopen

from rosz.ros1.tools.rospkg import RosPack

__all__ = ("PACKAGE_PREFIX", "get", "get_filename")

PACKAGE_PREFIX: Final = "package://"


def get_filename(url: str, use_protocol: bool = True) -> str:
    """Return a URL with the path of the file in place of a package.

    Args:
        url: The URL, such as ``package://turtlesim/images/box.png``; others stay as they are.
        use_protocol: Whether ``file://`` precedes the path.

    Raises:
        Exception: A package is named, but no file in it.
        ResourceNotFound: The package does not exist.
    """
    if not url.startswith(PACKAGE_PREFIX):
        return url
    package, slash, path = url.removeprefix(PACKAGE_PREFIX).partition("/")
    if not slash:
        raise Exception(  # noqa: TRY002  # ROS 1's
            f"Could not parse package:// format into file:// format for {url}"
        )
    return f"{'file://' if use_protocol else ''}{RosPack().get_path(package)}/{path}"


def get(url: str) -> bytes:
    """Return the content of a URL, which may name a package; see `get_filename`.

    Raises:
        Exception: The file cannot be read.
    """
    filename = get_filename(url)
    try:
        with urlopen(filename) as content:  # noqa: S310  # as ROS 1, any that Python knows
            data: bytes = content.read()
            return data
    except URLError as error:
        raise Exception(f"Invalid URL: {filename}") from error  # noqa: TRY002  # ROS 1's
