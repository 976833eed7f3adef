"""roslaunch.core: nodes, machines and parameters as scripts make them (ROS wiki, roslaunch API)."""

from __future__ import annotations

import functools
import os
import socket
import sys
import uuid
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar
from urllib.parse import urlsplit
from xml.sax.saxutils import escape
from xmlrpc.client import MultiCall, ServerProxy

from rosz.launch.plan import NodePlan, SetupPlan
from rosz.ros1.rosgraph import get_master_uri, is_master_online, network
from rosz.ros1.rosgraph.names import canonicalize_name, make_global_ns

__all__ = (
    "PHASE_RUN",
    "PHASE_SETUP",
    "PHASE_TEARDOWN",
    "TEST_TIME_LIMIT_DEFAULT",
    "Executable",
    "Machine",
    "Master",
    "Node",
    "Param",
    "RLException",
    "RosbinExecutable",
    "Test",
    "add_printerrlog_handler",
    "add_printlog_handler",
    "clear_printerrlog_handlers",
    "clear_printlog_handlers",
    "generate_run_id",
    "get_master_uri_env",
    "is_child_mode",
    "is_machine_local",
    "local_machine",
    "printerrlog",
    "printlog",
    "printlog_bold",
    "remap_localhost_uri",
    "rle_wrapper",
    "set_child_mode",
    "setup_env",
)

PHASE_SETUP = "setup"
PHASE_RUN = "run"
PHASE_TEARDOWN = "teardown"
TEST_TIME_LIMIT_DEFAULT = 60

_REGISTER_TIMEOUT = 10.0
_SSH_PORT = 22
_CWDS = {"node": "node", "ros_home": "ROS_HOME"}

F = TypeVar("F", bound=Callable[..., Any])
Pairs = Sequence[Sequence[str]]


class RLException(Exception):
    """Base class of roslaunch's errors."""


def rle_wrapper(fn: F) -> F:
    """Return a function that prints an `RLException` in place of raising it."""

    @functools.wraps(fn)
    def call(*args: Any, **options: Any) -> Any:
        try:
            return fn(*args, **options)
        except RLException as error:
            printerrlog(str(error))
            return None

    return call  # type: ignore[return-value]


# Output of the launch, which programs may show elsewhere.

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


def printlog_bold(msg: str) -> None:
    """Print an important line, and pass it to the handlers."""
    _print(_printers, msg, sys.stdout)


def printerrlog(msg: str) -> None:
    """Print a line about an error, and pass it to the handlers of errors."""
    _print(_error_printers, msg, sys.stderr)


def add_printlog_handler(h: Callable[[str], object]) -> None:
    """Call a function with each line that is printed."""
    _printers.append(h)


def add_printerrlog_handler(h: Callable[[str], object]) -> None:
    """Call a function with each line about an error."""
    _error_printers.append(h)


def clear_printlog_handlers() -> None:
    """Remove all handlers of lines."""
    _printers.clear()


def clear_printerrlog_handlers() -> None:
    """Remove all handlers of lines about errors."""
    _error_printers.clear()


# The environment.

_child_mode = [False]


def is_child_mode() -> bool:
    """Return whether this process was said to be the child of another launch."""
    return _child_mode[0]


def set_child_mode(child_mode: bool) -> None:
    """Say whether this process is the child of another launch."""
    _child_mode[0] = child_mode


def generate_run_id() -> str:
    """Return a new id for a launch."""
    return str(uuid.uuid1())


def get_master_uri_env(*_: Any) -> str | None:
    """Return the URI of the master, at which nothing listens."""
    return get_master_uri()


def remap_localhost_uri(uri: str, force_localhost: bool = False) -> str:
    """Return a URI of this machine with the name by which others reach it.

    Args:
        uri: The URI.
        force_localhost: Whether to do so even if its host is another machine.
    """
    parts = urlsplit(uri)
    if force_localhost or parts.hostname == "localhost":
        return f"{parts.scheme}://{network.get_host_name()}:{parts.port}/"
    return uri


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
        env: Variables to start from; those of the process when not given.
    """
    made = dict(os.environ if env is None else env)
    made["ROS_MASTER_URI"] = master_uri
    made.pop("ROS_NAMESPACE", None)
    if node is not None:
        if node.namespace not in {"", "/"}:
            made["ROS_NAMESPACE"] = node.namespace.rstrip("/")
        made.update((name, value) for name, value in node.env_args)
    return made


# Parts of a launch.


class Master:
    """The master as launch files of old declare it; there is none.

    Args:
        type_: Kind of master.
        uri: Its URI; that of the environment when not given.
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

    def get(self) -> ServerProxy:
        """Return a proxy of the URI, at which nothing listens."""
        return ServerProxy(self.uri)

    def get_multi(self) -> MultiCall:
        """Return calls at once of the URI, at which nothing listens."""
        return MultiCall(self.get())

    def is_running(self) -> bool:
        """Return whether the network can be reached, if the URI is that of this process."""
        return self.uri == (get_master_uri() or "") and is_master_online()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Master) and (self.type, self.uri) == (other.type, other.uri)

    __hash__ = None  # type: ignore[assignment]


class Machine:
    """A computer that nodes run on; see ``<machine>``.

    Raises:
        RLException: The name or address is missing.
    """

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
        """Return a text that differs between machines that are not the same."""
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


_local: list[Machine] = []


def local_machine() -> Machine:
    """Return this machine."""
    if not _local:
        _local.append(Machine("", "localhost"))
    return _local[0]


def is_machine_local(machine: Machine) -> bool:
    """Return whether a machine is this one, for the current user."""
    try:
        addresses = {entry[4][0] for entry in socket.getaddrinfo(machine.address, 0)}
    except socket.gaierror as error:
        raise RLException(f"cannot resolve host address for machine [{machine.address}]") from error
    own = any(network.is_local_address(str(address)) for address in addresses)
    return own and machine.user in {None, os.environ.get("USER")}


class Param:
    """A parameter to set.

    Args:
        key: Its name.
        value: Its value.
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
        plan: What a launch file says beyond the attributes here, or None.

    Raises:
        ValueError: An attribute has a value that it cannot have.
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
        if not self.package.strip():
            raise ValueError("package must be non-empty")
        if not self.type.strip():
            raise ValueError("type must be non-empty")
        if self.name and "/" in self.name:
            raise ValueError("node name cannot contain a namespace")
        if output not in {None, "", "log", "screen"}:
            raise ValueError(f"output must be one of 'log', 'screen', not '{output}'")
        if cwd and self.cwd is None:
            raise ValueError(f"cwd must be one of 'ROS_HOME', 'node', not '{cwd}'")
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
            f'{name}="{_xml_escape(value)}"' for name, value in self.xmlattrs() if value is not None
        )
        inner = [f'  <remap from="{old}" to="{new}" />\n' for old, new in self.remap_args]
        inner += [f'  <env name="{name}" value="{value}" />\n' for name, value in self.env_args]
        return f"<{self.xmltype()} {attributes}>\n{''.join(inner)}</{self.xmltype()}>"

    def to_remote_xml(self) -> str:
        """Return the node as XML without its machine."""
        machine, self.machine_name = self.machine_name, None
        try:
            return self.to_xml()
        finally:
            self.machine_name = machine


class Test(Node):
    """A test, which rostest runs; the arguments are the attributes of ``<test>``.

    Raises:
        ValueError: An attribute has a value that it cannot have.
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
        cmd: Its program.
        args: Its arguments.
        phase: When to run it: `PHASE_SETUP`, `PHASE_RUN` or `PHASE_TEARDOWN`.

    Attributes:
        step: The step of a launch file that it stands for, or None.
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
    """A command of ROS."""

    def __str__(self) -> str:
        return f"ros/bin/{super().__str__()}"


def _xml_escape(value: Any) -> str:
    return escape(str(value), {'"': "&quot;"})
