"""roslaunch.rlutil: what scripts need around a launch."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from rosz.errors import ParamNotFound, RoszError
from rosz.ros1.importer import package_path
from rosz.ros1.roslaunch.config import load_config_default
from rosz.ros1.roslaunch.core import RLException, generate_run_id
from rosz.ros1.state import ready_context

__all__ = (
    "change_terminal_name",
    "check_log_disk_usage",
    "check_roslaunch",
    "get_or_generate_uuid",
    "print_file_list",
    "resolve_launch_arguments",
    "update_terminal_name",
)


def get_or_generate_uuid(
    options_runid: str | None,
    options_wait_for_master: bool,  # noqa: ARG001  # ROS 1's
) -> str:
    """Return the id of the run: the parameter ``/run_id``, the one given, or a new one.

    Args:
        options_runid: The id given.
        options_wait_for_master: Ignored: there is no master.
    """
    try:
        found = ready_context().params.peek("/run_id")
    except ParamNotFound:
        found = None
    return found if isinstance(found, str) else options_runid or generate_run_id()


def resolve_launch_arguments(args: Sequence[str]) -> list[str]:
    """Return a command line with the path of its launch file in place of a package and a name.

    Args:
        args: ``PACKAGE FILE …`` or ``PATH …``.

    Raises:
        RLException: The package or file does not exist.
    """
    if not args:
        return []
    if len(args) > 1 and "/" not in args[0] and args[0] != "-":
        try:
            return [str(package_path().find(args[0]).file(args[1])), *args[2:]]
        except RoszError as error:
            if not Path(args[0]).is_file():
                raise RLException(f"[{args[1]}]: {error}") from error
    if args[0] != "-" and not Path(args[0]).is_file():
        raise RLException(
            f"[{args[0]}] is neither a launch file in package [{args[0]}] nor is [{args[0]}] a"
            " launch file name"
        )
    return [args[0] if args[0] == "-" else str(Path(args[0]).absolute()), *args[1:]]


def check_roslaunch(
    f: str,
    use_test_depends: bool = False,  # noqa: ARG001  # ROS 1's
    ignore_unset_args: bool = False,
) -> str | None:
    """Return what is wrong with a launch file, or None.

    Args:
        f: Its path.
        use_test_depends: Ignored.
        ignore_unset_args: Whether args without a value are allowed.
    """
    try:
        config = load_config_default([(f, [])], None, ignore_unset_args=ignore_unset_args)
    except RLException as error:
        unset = "it has no default, so give it" in str(error)
        return None if ignore_unset_args and unset else str(error)
    wrong = []
    for node in (*config.nodes, *config.tests):
        try:
            package_path().find(node.package).executable(node.type)
        except RoszError as error:
            wrong.append(str(error))
    return "\n".join(wrong) or None


def print_file_list(roslaunch_files: Sequence[str]) -> None:
    """Print the paths of the launch files that some launch files include.

    Raises:
        RLException: A file is refused.
    """
    config = load_config_default(roslaunch_files, None)
    for file in sorted({str(Path(name).absolute()) for name in config.roslaunch_files}):
        sys.stdout.write(f"{file}\n")


def check_log_disk_usage() -> None:
    """Do nothing: the size of log files is bounded."""


def change_terminal_name(args: Sequence[str], is_core: bool) -> None:
    """Name the window of the terminal after launch files.

    Args:
        args: The files.
        is_core: Whether this is a core.
    """
    update_terminal_name("roscore" if is_core else ",".join(args))


def update_terminal_name(ros_master_uri: str) -> None:
    """Name the window of the terminal."""
    if sys.stdout.isatty():
        sys.stdout.write(f"\033]2;{ros_master_uri}\007")
        sys.stdout.flush()
