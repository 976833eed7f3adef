"""roslaunch.core: the nodes, machines and parameters of a launch (ROS wiki, roslaunch API)."""

from __future__ import annotations

import os
import sys
import uuid
from collections.abc import Callable, Mapping, Sequence
from typing import Any
from xml.sax.saxutils import escape

from rosz.launch.plan import NodePlan, SetupPlan
from rosz.ros1.tools.rosgraph import get_master_uri, is_master_online, network
from rosz.ros1.tools.rosgraph.names import canonicalize_name, make_global_ns

PHASE_SETUP = "setup"
PHASE_RUN = "run"
PHASE_TEARDOWN = "teardown"
TEST_TIME_LIMIT_DEFAULT = 60

# ROS 1's default time limit, in seconds, for the start of a launch on another machine.
_REGISTER_TIMEOUT = 10.0
_SSH_PORT = 22
_QUOTES = {'"': "&quot;"}
_CWDS = {"node": "node", "ros_home": "ROS_HOME"}

Pairs = Sequence[Sequence[str]]


class RLException(Exception):
    """Base class of roslaunch's errors."""


# Output of the launch; handlers of a program may show it elsewhere.

_printers: list[Callable[[str], object]] = []
_error_printers: list[Callable[[str], object]] = []


def _print(handlers: list[Callable[[str], object]], text: str, stream: Any) -> None:
    for handler in handlers:
        try:
            handler(text)
        except Exception as error:  # noqa: BLE001  # the callback boundary
            sys.stderr.write(f"roslaunch: handler {handler!r} of printed lines failed: {error}\n")
    stream.write(f"{text}\n")
    stream.flush()


def printlog(msg: str) -> None:
    """Print a line, and pass it to the handlers."""
    _print(_printers, msg, sys.stdout)


printlog_bold = printlog


def printerrlog(msg: str) -> None:
    """Print a line to standard error, and pass it to the handlers of errors."""
    _print(_error_printers, msg, sys.stderr)


def add_printlog_handler(h: Callable[[str], object]) -> None:
    """Add a function that is called with each printed line."""
    _printers.append(h)


def add_printerrlog_handler(h: Callable[[str], object]) -> None:
    """Add a function that is called with each line about an error."""
    _error_printers.append(h)


def clear_printlog_handlers() -> None:
    """Remove all handlers of printed lines."""
    _printers.clear()


def clear_printerrlog_handlers() -> None:
    """Remove all handlers of lines about errors."""
    _error_printers.clear()


# A list, so that `set_child_mode` can change the value; only `is_child_mode` reads it.
_child_mode = [False]


def is_child_mode() -> bool:
    """Return whether this process is the child of another launch; see `set_child_mode`."""
    return _child_mode[0]


def set_child_mode(child_mode: bool) -> None:
    """Set whether this process is the child of another launch."""
    _child_mode[0] = child_mode


def generate_run_id() -> str:
    """Return a new id for a launch."""
    return str(uuid.uuid1())


def setup_env(
    node: Node | None,
    machine: Machine,  # noqa: ARG001  # ROS 1's
    master_uri: str,
    env: Mapping[str, str] | None = None,
) -> dict[str, str]:
    """Return the environment variables of a node.

    Args:
        node: The node, or None for a program that is not one.
        machine: Ignored.
        master_uri: Value of ``ROS_MASTER_URI``.
        env: Initial variables; those of the process when not given.
    """
    variables = dict(os.environ if env is None else env)
    variables["ROS_MASTER_URI"] = master_uri
    variables.pop("ROS_NAMESPACE", None)
    if node is not None:
        if node.namespace not in {"", "/"}:
            variables["ROS_NAMESPACE"] = node.namespace.rstrip("/")
        variables.update((name, value) for name, value in node.env_args)
    return variables


class Master:
    """The master that a launch file declares; rosz has no master.

    Args:
        type_: Kind of master.
        uri: URI of the master; that of the environment when not given.
        auto: Ignored.
    """

    ROSMASTER = "rosmaster"
    ZENMASTER = "zenmaster"

    def __init__(
        self, type_: str | None = None, uri: str | None = None, auto: int | None = None
    ) -> None:
        self.auto = auto
        self.type = type_ or Master.ROSMASTER
        self.uri: str = uri or get_master_uri() or ""

    def get_host(self) -> str:
        """Return the host of the URI."""
        return network.parse_http_host_and_port(self.uri)[0]

    def get_port(self) -> int:
        """Return the port of the URI."""
        return network.parse_http_host_and_port(self.uri)[1]

    def is_running(self) -> bool:
        """Return whether the URI is that of this process, and the network can be reached."""
        return self.uri == (get_master_uri() or "") and is_master_online()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Master) and (self.type, self.uri) == (other.type, other.uri)

    __hash__ = None  # type: ignore[assignment]


class Machine:
    """A computer that nodes run on; see ``<machine>``."""

    def __init__(  # noqa: PLR0917  # ROS 1's
        self,
        name: str,
        address: str,
        env_loader: str | None = None,
        ssh_port: int = _SSH_PORT,
        user: str | None = None,
        password: str | None = None,
        assignable: bool = True,
        env_args: Pairs = (),  # noqa: ARG002  # ROS 1's
        timeout: float | None = None,
    ) -> None:
        self.name = name
        self.env_loader = env_loader
        self.user = user or None
        self.password = password or None
        self.address = address
        self.ssh_port = ssh_port
        self.assignable = assignable
        self.timeout = timeout or _REGISTER_TIMEOUT

    def config_key(self) -> str:
        """Return a text that is equal for machines that are reached in the same way."""
        return (
            f"Machine(address[{self.address}] env_loader[{self.env_loader}]"
            f" ssh_port[{self.ssh_port}] user[{self.user or ''}] password[{self.password or ''}]"
            f" timeout[{self.timeout}])"
        )

    def config_equals(self, m2: object) -> bool:
        """Return whether another machine is reached in the same way."""
        return isinstance(m2, Machine) and self.config_key() == m2.config_key()

    def __str__(self) -> str:
        return (
            f"Machine(name[{self.name}] env_loader[{self.env_loader}] address[{self.address}]"
            f" ssh_port[{self.ssh_port}] user[{self.user}] assignable[{self.assignable}]"
            f" timeout[{self.timeout}])"
        )

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Machine)
            and self.name == other.name
            and self.assignable == other.assignable
            and self.config_equals(other)
        )

    __hash__ = None  # type: ignore[assignment]


_LOCAL = Machine("", "localhost")


def local_machine() -> Machine:
    """Return this machine."""
    return _LOCAL


class Param:
    """A parameter to set.

    Args:
        key: Name of the parameter.
        value: Value of the parameter.
    """

    def __init__(self, key: str, value: Any) -> None:
        self.key: str = canonicalize_name(key)
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Param) and (self.key, self.value) == (other.key, other.value)

    def __str__(self) -> str:
        return f"{self.key}={self.value}"

    __repr__ = __str__
    __hash__ = None  # type: ignore[assignment]


class Node:
    """A process to start; the arguments are the attributes of ``<node>``.

    Attributes:
        plan: The node as the launch file declares it, with all attributes; None in scripts.

    Raises:
        ValueError: The value of an attribute is not valid.
    """

    def __init__(  # noqa: PLR0917  # ROS 1's
        self,
        package: str,
        node_type: str,
        name: str | None = None,
        namespace: str = "/",
        machine_name: str | None = None,
        args: str = "",
        respawn: bool = False,
        respawn_delay: float = 0.0,
        remap_args: Pairs | None = None,
        env_args: Pairs | None = None,
        output: str | None = None,
        cwd: str | None = None,
        launch_prefix: str | None = None,
        required: bool = False,
        filename: str = "<unknown>",
    ) -> None:
        self.package = package
        self.type = node_type
        self.name = name or None
        self.namespace: str = make_global_ns(namespace or "/")
        self.machine_name = machine_name or None
        self.respawn = respawn
        self.respawn_delay = respawn_delay
        self.args = args or ""
        self.remap_args = list(remap_args or ())
        self.env_args = list(env_args or ())
        self.output = output
        self.cwd = _CWDS.get(cwd.lower()) if cwd else None
        self.launch_prefix = launch_prefix or None
        self.required = required
        self.filename = filename
        self.process_name: str | None = None
        self.machine: Machine | None = None
        self.plan: NodePlan | None = None
        if cwd and self.cwd is None:
            raise ValueError(f"cwd must be one of 'ROS_HOME', 'node', not '{cwd}'")
        self._check()

    def _check(self) -> None:
        if not self.package.strip():
            raise ValueError("package must be non-empty")
        if not self.type.strip():
            raise ValueError("type must be non-empty")
        if self.name and "/" in self.name:
            raise ValueError("node name cannot contain a namespace")
        if self.output not in {None, "", "log", "screen"}:
            raise ValueError(f"output must be one of 'log', 'screen', not '{self.output}'")
        if self.required and self.respawn:
            raise ValueError("respawn and required cannot both be set to true")

    def xmltype(self) -> str:
        """Return the name of the tag."""
        return "node"

    def xmlattrs(self) -> list[tuple[str, Any]]:
        """Return the attributes of the tag."""
        return [
            ("pkg", self.package),
            ("type", self.type),
            ("machine", self.machine_name),
            ("ns", self.namespace),
            ("args", self.args),
            ("output", self.output),
            ("cwd", self.cwd),
            ("respawn", self.respawn),
            ("respawn_delay", self.respawn_delay),
            ("name", self.name),
            ("launch-prefix", self.launch_prefix),
            ("required", self.required),
        ]

    def to_xml(self) -> str:
        """Return the node as XML."""
        attributes = " ".join(
            f'{name}="{escape(str(value), _QUOTES)}"'
            for name, value in self.xmlattrs()
            if value is not None
        )
        # Like ROS 1, this does not escape the values of inner tags.
        inner = [f'  <remap from="{old}" to="{new}" />\n' for old, new in self.remap_args]
        inner += [f'  <env name="{name}" value="{value}" />\n' for name, value in self.env_args]
        return f"<{self.xmltype()} {attributes}>\n{''.join(inner)}</{self.xmltype()}>"


class Test(Node):
    """A test, which rostest runs; the arguments are the attributes of ``<test>``.

    Raises:
        ValueError: The value of an attribute is not valid.
    """

    __test__ = False

    def __init__(  # noqa: PLR0917  # ROS 1's
        self,
        test_name: str,
        package: str,
        node_type: str,
        name: str | None = None,
        namespace: str = "/",
        machine_name: str | None = None,
        args: str = "",
        remap_args: Pairs | None = None,
        env_args: Pairs | None = None,
        time_limit: float | None = None,
        cwd: str | None = None,
        launch_prefix: str | None = None,
        retry: int | None = None,
        filename: str = "<unknown>",
    ) -> None:
        super().__init__(
            package,
            node_type,
            name=name,
            namespace=namespace,
            machine_name=machine_name,
            args=args,
            remap_args=remap_args,
            env_args=env_args,
            output="log",
            cwd=cwd,
            launch_prefix=launch_prefix,
            filename=filename,
        )
        self.test_name = test_name
        self.retry = retry or 0
        limit = time_limit or TEST_TIME_LIMIT_DEFAULT
        if isinstance(limit, bool) or not isinstance(limit, int | float):
            raise ValueError("'time-limit' must be a number")  # noqa: TRY004  # as ROS 1
        self.time_limit: float = float(limit)
        if self.time_limit <= 0:
            raise ValueError("'time-limit' must be a positive number")

    def xmltype(self) -> str:
        """Return the name of the tag."""
        return "test"

    def xmlattrs(self) -> list[tuple[str, Any]]:
        """Return the attributes of the tag."""
        kept = [pair for pair in super().xmlattrs() if not pair[0].startswith("respawn")]
        extra: list[tuple[str, Any]] = [("test-name", self.test_name)]
        if self.retry:
            extra.append(("retry", str(self.retry)))
        if self.time_limit != TEST_TIME_LIMIT_DEFAULT:
            extra.append(("time-limit", self.time_limit))
        return [*kept, *extra]


class Executable:
    """A command of a launch.

    Args:
        cmd: Program to run.
        args: Arguments of the program.
        phase: When to run it: `PHASE_SETUP`, `PHASE_RUN` or `PHASE_TEARDOWN`.

    Attributes:
        step: The step of the launch file that declares the command, or None.
    """

    def __init__(self, cmd: str, args: Sequence[str], phase: str = PHASE_RUN) -> None:
        self.command = cmd
        self.args = args
        self.phase = phase
        self.step: SetupPlan | None = None

    def __str__(self) -> str:
        return f"{self.command} {' '.join(self.args)}"

    def __repr__(self) -> str:
        return str(self)


class RosbinExecutable(Executable):
    """A command in ROS's folder ``bin``."""

    def __str__(self) -> str:
        return f"ros/bin/{super().__str__()}"
