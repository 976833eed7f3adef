"""rosmsg: definitions of messages and services (ROS wiki, rosmsg)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from rosz.errors import RoszError
from rosz.introspect import Definitions
from rosz.ros1.importer import type_store
from rosz.ros1.tool import Tool
from rosz.ros1.tools.rospkg import ResourceNotFound, RosPack

MODE_MSG = ".msg"
MODE_SRV = ".srv"


class ROSMsgException(Exception):
    """A definition is not found, or is invalid."""


def get_msg_text(type_: str, raw: bool = False, rospack: RosPack | None = None) -> str:  # noqa: ARG001
    """Return the definition of a message.

    Args:
        type_: Type name, such as ``std_msgs/String``.
        raw: Whether to return the text of the file; otherwise comments are removed, and the fields
            of nested messages are added.
        rospack: Ignored; all types that can be imported are found.

    Raises:
        ROSMsgException: The type does not exist, or its definition is invalid.
    """
    return _read(MODE_MSG, type_, Definitions.text if raw else Definitions.show)


def get_srv_text(type_: str, raw: bool = False, rospack: RosPack | None = None) -> str:  # noqa: ARG001
    """Return the definition of a service; see `get_msg_text`."""
    return _read(MODE_SRV, type_, Definitions.text if raw else Definitions.show)


def _definitions(mode: str) -> Definitions:
    if mode not in {MODE_MSG, MODE_SRV}:
        raise ValueError(f"Unknown mode: {mode}; expected {MODE_MSG} or {MODE_SRV}")
    return Definitions(type_store(), "msg" if mode == MODE_MSG else "srv")


def _read(mode: str, name: str, read: Callable[[Definitions, str], str]) -> str:
    definitions = _definitions(mode)
    try:
        return read(definitions, definitions.find(name)[0])
    except RoszError as error:
        raise ROSMsgException(f"Unable to load {mode[1:]} [{name}]: {error}") from error


def rosmsg_md5(mode: str, type_: str) -> str:
    """Return the MD5 hash of a definition; see `get_msg_text`."""
    return _read(mode, type_, Definitions.md5)


def list_msgs(package: str, rospack: RosPack | None = None) -> list[str]:
    """Return the names of the messages of a package, as ``package/Name``."""
    return list_types(package, MODE_MSG, rospack)


def list_srvs(package: str, rospack: RosPack | None = None) -> list[str]:
    """Return the names of the services of a package, as ``package/Name``."""
    return list_types(package, MODE_SRV, rospack)


def list_types(package: str, mode: str = MODE_MSG, rospack: RosPack | None = None) -> list[str]:
    """Return the names of the messages or services of a package.

    Raises:
        ResourceNotFound: The package does not exist.
        ValueError: The mode is neither `MODE_MSG` nor `MODE_SRV`.
    """
    kind: Any = "msg" if mode == MODE_MSG else "srv"
    _definitions(mode)
    store = type_store()
    if not store.has(package, kind):
        (rospack or RosPack()).get_path(package)
        return []
    return store.names(kind, package)


def iterate_packages(rospack: RosPack, mode: str) -> Iterator[tuple[str, str]]:
    """Yield the packages with messages or services, and the folders; see `list_types`."""
    _definitions(mode)
    for name in rospack.list():
        folder = Path(rospack.get_path(name), mode[1:])
        if folder.is_dir():
            yield name, str(folder)


def rosmsg_search(rospack: RosPack, mode: str, base_type: str) -> Iterator[str]:
    """Yield the types of a base name in all packages.

    Args:
        rospack: Packages to search.
        mode: `MODE_MSG` or `MODE_SRV`.
        base_type: Name without package, such as ``String``.
    """
    for name, _ in iterate_packages(rospack, mode):
        try:
            types = list_types(name, mode, rospack)
        except ResourceNotFound:
            continue
        yield from (type_name for type_name in types if type_name.rpartition("/")[2] == base_type)


def _tool(mode: str) -> Tool:
    _definitions(mode)
    return Tool(f"ros{mode[1:]}")


def fullusage(mode: str) -> str:
    """Return the help of ``rosmsg`` or ``rossrv``."""
    return _tool(mode).usage()


def rosmsgmain(mode: str = MODE_MSG) -> None:
    """Run the command line of the process as ``rosmsg`` or ``rossrv``.

    Raises:
        SystemExit: The command failed, or its help was asked for.
    """
    _tool(mode).main()


def _command(mode: str, name: str, argv: Sequence[str] | None) -> None:
    """Run a command; like in ROS 1, the command line of the process has a program in front."""
    words = sys.argv[2:] if argv is None else argv[1:]
    _tool(mode).main(["", name, *words])


def rosmsg_cmd_show(mode: str, full: str, alias: str = "show") -> None:  # noqa: ARG001  # ROS 1's
    """Run ``rosmsg show`` with the command line of the process."""
    _command(mode, alias, None)


def rosmsg_cmd_md5(mode: str, full: str) -> None:  # noqa: ARG001
    """Run ``rosmsg md5`` with the command line of the process."""
    _command(mode, "md5", None)


def rosmsg_cmd_package(mode: str, full: str) -> None:  # noqa: ARG001
    """Run ``rosmsg package`` with the command line of the process."""
    _command(mode, "package", None)


def rosmsg_cmd_packages(mode: str, full: str, argv: Sequence[str] | None = None) -> None:  # noqa: ARG001
    """Run ``rosmsg packages``.

    Args:
        mode: `MODE_MSG` or `MODE_SRV`.
        full: Ignored.
        argv: The command and its options; from the command line of the process when not given.
    """
    _command(mode, "packages", argv)


def rosmsg_cmd_list(mode: str, full: str, argv: Sequence[str] | None = None) -> None:  # noqa: ARG001
    """Run ``rosmsg list``; see `rosmsg_cmd_packages`."""
    _command(mode, "list", argv)
