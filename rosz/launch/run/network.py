"""The network of a launch: its parameters, the conditions of ``wait_for``, and its router.

Parameters are written before any node starts, as one change. In a full mesh the number of links
grows with the square of the number of nodes. Above some number, a launch therefore starts ``rosz
core`` as a router and makes its nodes clients of it.
"""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import msgspec

from rosz.environment import Environment
from rosz.errors import LaunchError, ParamNotFound
from rosz.launch.plan import Condition, Plan, SetupPlan
from rosz.launch.run.console import Console
from rosz.launch.run.loop import Loop
from rosz.launch.run.process_tree import TAG
from rosz.lifecycle import Closing
from rosz.params import DELETED, Change, condense, normalise, split
from rosz.session import Session, is_listening

if TYPE_CHECKING:
    from rosz.node import Context
    from rosz.params.replica import Replica

RUN_ID: Final = "/run_id"

# The parameters of roscore that say which ROS this is: the last release of Noetic. The line ends
# are part of the values, because roscore takes them from the output of commands.
_ROSDISTRO: Final = "noetic\n"
_ROSVERSION: Final = "1.17.4\n"

MESH_LIMIT: Final = 24
"""Largest number of nodes that start faster in a mesh than as clients, measured on two cores."""

_MODE: Final = "ROSZ_MODE"
_START_TIMEOUT: Final = 60.0
_CHECK_INTERVAL: Final = 0.01
_RESTART_DELAY: Final = 0.5
_CLOSE_TIMEOUT: Final = 2.0


class Network:
    """The parameters and the graph of a context, as a launch uses them.

    Args:
        context: The context of the launch process, whose replica keeps the parameters alive.
        router: The router that was started for the launch, or None if its nodes form a mesh.

    Attributes:
        session: The session that replies to requests about the launch, or None.
        alone: Whether no other process holds the parameters.
    """

    def __init__(self, context: Context, router: RouterProcess | None = None) -> None:
        self._graph = context.graph
        self._replica = context.params
        self.session: Session | None = context.session
        self.domain = context.domain
        self.alone = not self._replica.members()
        self.router = router

    def holds(self, condition: Condition) -> bool:
        """Return whether a condition is true now."""
        if condition.kind == "param":
            return self.has(condition.name)
        view = self._graph.view()
        if condition.kind == "topic":
            return bool(view.publishers(condition.name))
        if condition.kind == "service":
            return bool(view.servers(condition.name))
        return condition.name in view.nodes()

    def get(self, name: str) -> Any:
        """Return the value of a parameter.

        Raises:
            ParamNotFound: If it is not set.
        """
        return self._replica.peek(name)

    @property
    def is_simulated(self) -> bool:
        """Whether nodes that start now take their time from ``/clock``."""
        try:
            return self.get("/use_sim_time") is True
        except ParamNotFound:
            return False

    def has(self, name: str) -> bool:
        """Return whether a parameter is set."""
        return self._replica.has(name)

    def write(self, values: Mapping[str, Any], deleted: Iterable[str] = ()) -> None:
        """Delete some parameters, then set some, as one change; see `write_params`."""
        write_params(self._replica, values, deleted)

    def dump(self, name: str) -> str:
        """Return the subtree at a parameter as YAML.

        Raises:
            ParamNotFound: If it is not set.
        """
        from rosz.params.yaml import dump

        return dump(self._replica.peek(name))


def write_params(replica: Replica, values: Mapping[str, Any], deleted: Iterable[str] = ()) -> None:
    """Delete some parameters, then set some, as one change.

    The names are global; deleted ones that are not set are ignored.

    Raises:
        ParamError: If a value is not a parameter value; nothing has changed then.
    """
    changes: list[Change] = []
    for name in deleted:
        path = split(name)
        if not path:
            changes.append((path, {}))
        elif replica.has(name):
            changes.append((path, DELETED))
    changes += [(split(name), normalise(value, name)) for name, value in values.items()]
    replica.write(condense(changes))


def core_params(run_id: str) -> dict[str, Any]:
    """Return the parameters that a ROS 1 core sets when it starts."""
    return {RUN_ID: run_id, "/rosdistro": _ROSDISTRO, "/rosversion": _ROSVERSION}


def launch_uri(pid: int) -> dict[str, Any]:
    """Return the parameter that shows a running launch."""
    host = socket.gethostname()
    name = re.sub(r"[^a-z0-9]", "_", host.lower())
    return {f"/roslaunch/uris/host_{name}__{pid}": f"rosz://{host}/{pid}"}


def set_params(plan: Plan, network: Network, console: Console, extra: Mapping[str, Any]) -> None:
    """Do the setup steps of a plan, then clear and set its parameters as one change.

    Raises:
        LaunchError: If a file cannot be written.
        ParamError: If a value is not a parameter value; nothing has been set then.
    """
    for step in plan.setup:
        _run_step(step, network, console)
    values = dict(extra)
    for param in plan.params:
        values[param.target] = param.value
    if values or plan.clear:
        network.write(values, plan.clear)


def _run_step(step: SetupPlan, network: Network, console: Console) -> None:
    if step.action == "delete":
        console.say(f"running rosparam delete {step.name}")
        if network.has(step.name):
            network.write({}, [step.name])
        else:
            console.error(f"{step.place}: parameter '{step.name}' is not set, so it is not deleted")
        return
    console.say(f"running rosparam dump {step.file} {step.name}")
    try:
        text = network.dump(step.name)
    except ParamNotFound:
        console.error(f"{step.place}: parameter '{step.name}' is not set, so it is not dumped")
        return
    try:
        _dump_file(step).write_text(text, encoding="utf-8")
    except OSError as error:
        raise LaunchError(
            f"{step.place}: cannot dump to '{step.file}': {error.strerror}"
        ) from error


def _dump_file(step: SetupPlan) -> Path:
    """Return the file to dump to, which must be a regular one if it exists.

    Through a link, another user could have any file overwritten; a pipe may never be read.
    """
    file = Path(step.file)
    if file.is_symlink():
        raise LaunchError(
            f"{step.place}: cannot dump to '{file}': it is a link to '{file.readlink()}'; name the"
            " file itself"
        )
    if file.exists() and not file.is_file():
        raise LaunchError(f"{step.place}: cannot dump to '{file}': it is not a regular file")
    return file


def needs_router(nodes: int, environment: Environment, environ: Mapping[str, str]) -> bool:
    """Return whether a launch should start a router.

    It should for many nodes, and for nodes connected to another machine: without a router here, all
    that they send to each other would pass through that machine, and end with the connection. It
    should not if the user has chosen a mode or a Zenoh configuration, or if another process already
    listens at the rendezvous.
    """
    dials = bool(nodes and environment.connect and not environment.listen)
    return (
        (nodes > MESH_LIMIT or dials)
        and not environ.get(_MODE)
        and not environment.zenoh_config
        and not is_listening(environment.rendezvous)
    )


class RouterProcess(Closing):
    """A ``rosz core`` process that listens at the rendezvous.

    Attributes:
        environment: Settings of its clients.
        environ: Environment variables of its clients.

    Raises:
        LaunchError: If it does not start.
    """

    def __init__(self, environment: Environment, environ: Mapping[str, str]) -> None:
        self.environment = msgspec.structs.replace(environment, mode="client")
        self.environ = {**environ, _MODE: "client"}
        # An outer launch would wait for it as for a part of its node.
        self._own_environ = {name: value for name, value in environ.items() if name != TAG}
        self._closing = False
        self._process = self._start()
        try:
            self._wait_until_listening(environment.rendezvous)
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def _start(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-P", "-m", "rosz", "core", "--owner", str(os.getpid())],
            env=self._own_environ,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )

    def _wait_until_listening(self, rendezvous: str) -> None:
        deadline = time.monotonic() + _START_TIMEOUT
        while not is_listening(rendezvous):
            if self._process.poll() is not None:
                raise LaunchError(
                    f"the core for these nodes ended with exit code {self._process.returncode};"
                    f" {_MODE}=peer starts them without one"
                )
            if time.monotonic() > deadline:
                raise LaunchError(
                    f"the core for these nodes does not answer at {rendezvous} within"
                    f" {_START_TIMEOUT:g} s; {_MODE}=peer starts them without one"
                )
            time.sleep(_CHECK_INTERVAL)

    def keep_running(self, loop: Loop, console: Console) -> None:
        """Start the process again whenever it ends, until `close`."""

        def ended() -> None:
            code = self._process.wait()
            if self._closing:
                return
            console.error(f"[core] process has died [pid {self.pid}, exit code {code}].")
            loop.later(_RESTART_DELAY, restart)

        def restart() -> None:
            console.say("[core] restarting process")
            try:
                self._process = self._start()
            except OSError as error:
                console.error(f"[core] cannot be started: {error.strerror}")
                loop.later(_RESTART_DELAY, restart)
                return
            console.strong(f"process[core]: started with pid [{self.pid}]")
            loop.watch_exit(self.pid, ended)

        loop.watch_exit(self.pid, ended)

    def close(self) -> None:
        """End the process; a second call has no effect."""
        self._closing = True
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(_CLOSE_TIMEOUT)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
