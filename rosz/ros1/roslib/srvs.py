"""roslib.srvs: specs of services (ROS wiki, roslib)."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from rosz.ros1.genmsg import SEP, is_legal_resource_name
from rosz.ros1.roslib import msgs
from rosz.ros1.roslib.msg_types import COMMENTCHAR, MsgSpecException
from rosz.ros1.roslib.packages import list_package_resources, resource_file

__all__ = (
    "COMMENTCHAR",
    "EXT",
    "IODELIM",
    "SEP",
    "SrvSpec",
    "SrvSpecException",
    "get_pkg_srv_specs",
    "is_verbose",
    "list_srv_types",
    "load_from_file",
    "load_from_string",
    "set_verbose",
    "srv_file",
)

EXT = ".srv"
IODELIM = "---"
VERBOSE = False


class SrvSpecException(Exception):
    """The name of a service is not that of a type."""


class SrvSpec:
    """A service.

    Args:
        request: The request.
        response: The response.
        text: Text of the definition.
        full_name: Name with the package.
        short_name: Name without the package.
        package: Package.
    """

    def __init__(  # ROS 1's
        self,
        request: msgs.MsgSpec,
        response: msgs.MsgSpec,
        text: str,
        full_name: str = "",
        short_name: str = "",
        package: str = "",
    ) -> None:
        self.request = request
        self.response = response
        self.text = text
        self.full_name = full_name
        self.short_name = short_name
        self.package = package

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SrvSpec) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        return f"SrvSpec[{self.request!r}, {self.response!r}]"


def is_verbose() -> bool:
    """Return whether files are named on stdout when they are read."""
    return VERBOSE


def set_verbose(v: bool) -> None:
    """Set whether files are named on stdout when they are read."""
    global VERBOSE  # noqa: PLW0603  # ROS 1's
    VERBOSE = v


def list_srv_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of the services of a package, without it.

    Args:
        package: Name of the package.
        include_depends: Whether to add those of the packages that it depends on, with them.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    found = list_package_resources(package, include_depends, "srv", lambda p: p.endswith(EXT))
    return [name.removesuffix(EXT) for name in found]


def srv_file(package: str, type_: str) -> str:
    """Return the path of the definition of a service; it need not exist.

    Raises:
        InvalidROSPkgException: The package does not exist.
    """
    return resource_file(package, "srv", type_ + EXT)


def get_pkg_srv_specs(package: str) -> tuple[list[tuple[str, SrvSpec]], list[str]]:
    """Return the services of a package, and the names of those that cannot be read.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    specs: list[tuple[str, SrvSpec]] = []
    failures: list[str] = []
    for name in list_srv_types(package, include_depends=False):
        try:
            specs.append(load_from_file(srv_file(package, name), package))
        except (MsgSpecException, SrvSpecException, OSError) as error:
            failures.append(name)
            sys.stderr.write(f"ERROR: unable to load {name}, {error}\n")
    return specs, failures


def load_from_string(
    text: str, package_context: str = "", full_name: str = "", short_name: str = ""
) -> SrvSpec:
    """Return the spec of a definition; see `roslib.msgs.load_from_string`.

    Raises:
        MsgSpecException: The text is not a definition.
    """
    parts: list[list[str]] = [[], []]
    half = 0
    for line in text.split("\n"):
        if line.strip().startswith(IODELIM):
            half = 1
        else:
            parts[half].append(line)
    request, response = (
        msgs.load_from_string(
            "\n".join(lines), package_context, f"{full_name}{role}", f"{short_name}{role}"
        )
        for lines, role in zip(parts, ("Request", "Response"), strict=True)
    )
    return SrvSpec(request, response, text, full_name, short_name, package_context)


def load_from_file(file_name: str, package_context: str = "") -> tuple[str, SrvSpec]:
    """Return the name and the spec of the service in a file.

    Args:
        file_name: Path of the file.
        package_context: Package of the service; the name has none when empty.

    Raises:
        MsgSpecException: The file does not hold a definition.
        SrvSpecException: Its name is not that of a type.
        OSError: The file cannot be read.
    """
    path = Path(file_name)
    package = package_context.rstrip(SEP)
    base = path.name.removesuffix(EXT)
    name = f"{package}{SEP}{base}" if package else base
    if VERBOSE:
        where = f" into namespace [{package}]" if package else ""
        sys.stdout.write(f"Load spec from {file_name}{where}\n")
    if not is_legal_resource_name(name):
        raise SrvSpecException(f"{file_name}: {name} is not a legal service type name")
    return name, load_from_string(path.read_text("utf-8"), package, name, base)


Spec = msgs.MsgSpec | SrvSpec
"""The specs that functions of `roslib.gentools` take."""


def parts_of(spec: Any) -> list[msgs.MsgSpec]:
    """Return the messages of a spec: itself, or the request and the response.

    Raises:
        MsgSpecException: It is neither a message nor a service.
    """
    if isinstance(spec, SrvSpec):
        return [spec.request, spec.response]
    if isinstance(spec, msgs.MsgSpec):
        return [spec]
    raise MsgSpecException("spec does not appear to be a message or service")
