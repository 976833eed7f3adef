"""Parameters of a launch, written before any of its nodes starts: one batch, all or nothing."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol

from rosz.errors import LaunchError, ParamNotFound
from rosz.launch.plan.model import Plan, SetupPlan
from rosz.launch.run.console import Console

__all__ = ("ParamStore", "carry_out", "core_params", "launch_uri")

RUN_ID = "/run_id"

# What roscore sets; programs and people look there to see which ROS this is, and it is Noetic's
# last. The line ends are part of the values, because roscore takes them from commands.
_ROSDISTRO = "noetic\n"
_ROSVERSION = "1.17.4\n"


class ParamStore(Protocol):
    """The parameters, as a launch needs them."""

    def get(self, name: str) -> Any:
        """Return the value of a global name.

        Raises:
            ParamNotFound: It is not set.
        """

    def has(self, name: str) -> bool:
        """Tell whether a global name is set."""

    def write(self, values: Mapping[str, Any], deleted: Iterable[str] = ()) -> None:
        """Delete some names, then set some, as one change; what is not there needs no deletion."""

    def dump(self, name: str) -> str:
        """Return the subtree at a global name as YAML.

        Raises:
            ParamNotFound: It is not set.
        """


def core_params(run_id: str) -> dict[str, Any]:
    """Return the parameters that a ROS 1 core sets when it starts.

    Args:
        run_id: Id of the run.
    """
    return {RUN_ID: run_id, "/rosdistro": _ROSDISTRO, "/rosversion": _ROSVERSION}


def launch_uri(pid: int) -> dict[str, Any]:
    """Return the parameter by which a running launch shows.

    Args:
        pid: Process id of the launch.
    """
    host = socket.gethostname()
    name = re.sub(r"[^a-z0-9]", "_", host.lower())
    return {f"/roslaunch/uris/host_{name}__{pid}": f"rosz://{host}/{pid}"}


def carry_out(plan: Plan, store: ParamStore, console: Console, extra: Mapping[str, Any]) -> None:
    """Do the set-up of a plan, then clear and set its parameters as one change.

    Args:
        plan: The plan.
        store: Where to.
        console: Told of what there was nothing to do for.
        extra: Parameters of the launch itself, by name.

    Raises:
        LaunchError: A file cannot be written.
        ParamError: A value is not acceptable; nothing has been set.
    """
    for step in plan.setup:
        _set_up(step, store, console)
    values = dict(extra)
    for param in plan.params:
        values[param.target] = param.value
    if values or plan.clear:
        store.write(values, plan.clear)


def _set_up(step: SetupPlan, store: ParamStore, console: Console) -> None:
    if step.action == "delete":
        console.say(f"running rosparam delete {step.name}")
        if store.has(step.name):
            store.write({}, [step.name])
        else:
            console.error(f"{step.place}: parameter '{step.name}' is not set, so it is not deleted")
        return
    console.say(f"running rosparam dump {step.file} {step.name}")
    try:
        text = store.dump(step.name)
    except ParamNotFound:
        console.error(f"{step.place}: parameter '{step.name}' is not set, so it is not dumped")
        return
    try:
        _target(step).write_text(text, encoding="utf-8")
    except OSError as error:
        raise LaunchError(
            f"{step.place}: cannot dump to '{step.file}': {error.strerror}"
        ) from error


def _target(step: SetupPlan) -> Path:
    """Return what to dump to; no link, by which somebody else could have a file overwritten.

    Nor what would not take it, such as a pipe that nobody reads.
    """
    file = Path(step.file)
    if file.is_symlink():
        raise LaunchError(
            f"{step.place}: cannot dump to '{file}': it is a link to '{file.readlink()}'; name the"
            " file itself"
        )
    if file.exists() and not file.is_file():
        raise LaunchError(f"{step.place}: cannot dump to '{file}': it is no regular file")
    return file
