"""roslaunch.parent, roslaunch.scriptapi: launches that scripts start and end (roslaunch API)."""

from __future__ import annotations

import atexit
from collections.abc import Sequence
from typing import Any

from rosz.errors import ParamNotFound, UsageError
from rosz.launch.run import Options, Timeouts
from rosz.ros1.exceptions import raised_as
from rosz.ros1.state import ready_context
from rosz.ros1.tools.roslaunch.config import ROSLaunchConfig, load_config_default, node_plan
from rosz.ros1.tools.roslaunch.core import Node, RLException, generate_run_id
from rosz.ros1.tools.roslaunch.pmon import Process, ProcessMonitor


class ROSLaunchRunner:
    """The running launch, as scripts reach it through ``parent.runner``."""

    def __init__(self, parent: ROSLaunchParent, monitor: ProcessMonitor) -> None:
        self.config = parent.config
        self.run_id = parent.run_id
        self.pm = monitor

    def launch_node(self, node: Node, core: bool = False) -> tuple[Process | None, bool]:  # noqa: ARG002  # ROS 1's
        """Start a node; return its process, and whether it could be started.

        Raises:
            RLException: The node is not one that can be started.
        """
        process = self.pm.add(node_plan(node))
        node.process_name = process.name
        return process, process.is_alive() or process.exit_code is not None

    def is_node_running(self, node: Node) -> bool:
        """Return whether the process of a node runs."""
        return node.process_name is not None and self.pm.has_process(node.process_name)

    def spin(self) -> None:
        """Wait until the launch has ended."""
        self.pm.mainthread_spin()

    def spin_once(self) -> bool:
        """Return whether the launch goes on."""
        return self.pm.mainthread_spin_once()

    def stop(self) -> None:
        """End the launch."""
        self.pm.shutdown()


class ROSLaunchParent:
    """A launch of files.

    Args:
        run_id: Id of the run; that of the parameter ``/run_id`` counts if it is set.
        roslaunch_files: Paths, or pairs of a path and a command line with values for its args.
        is_core: Ignored, as are ``port``, ``num_workers``, ``timeout`` and ``master_logger_level``:
            there is no master to start.
        local_only: Whether to leave out nodes of other machines.
        process_listeners: Objects that are notified of processes that die.
        verbose: Whether to print each addition, and command lines.
        force_screen: Whether all nodes write to the screen.
        force_log: Whether none writes its standard output to the screen.
        is_rostest: Ignored.
        roslaunch_strs: Texts of launch files.
        show_summary: Whether to print an overview.
        force_required: Whether all nodes are required.
        sigint_timeout: Seconds from SIGINT to SIGTERM.
        sigterm_timeout: Seconds from SIGTERM to SIGKILL.

    Attributes:
        config: The contents of the launch; read in `start` if a script has set none.
        pm: The processes, once it has started.
        runner: The running launch, or None.

    Raises:
        RLException: A time is not above 0.
    """

    def __init__(  # noqa: PLR0917  # ROS 1's
        self,
        run_id: str,
        roslaunch_files: Sequence[str | tuple[str, Sequence[str]]],
        is_core: bool = False,
        port: int | None = None,
        local_only: bool = False,
        process_listeners: Sequence[Any] | None = None,
        verbose: bool = False,
        force_screen: bool = False,
        force_log: bool = False,
        is_rostest: bool = False,
        roslaunch_strs: Sequence[str] | None = None,
        num_workers: int = 3,
        timeout: float | None = None,
        master_logger_level: Any = False,
        show_summary: bool = True,
        force_required: bool = False,
        sigint_timeout: float = 15.0,
        sigterm_timeout: float = 2.0,
    ) -> None:
        del num_workers, timeout, master_logger_level
        if sigint_timeout <= 0:
            raise RLException(f"SIGINT timeout must be positive, received: {sigint_timeout}")
        if sigterm_timeout <= 0:
            raise RLException(f"SIGTERM timeout must be positive, received: {sigterm_timeout}")
        self.run_id = run_id
        self.roslaunch_files = roslaunch_files
        self.roslaunch_strs = roslaunch_strs
        self.is_core = is_core
        self.is_rostest = is_rostest
        self.port = port
        self.local_only = local_only
        self.verbose = verbose
        self.process_listeners = list(process_listeners or ())
        self._options: dict[str, Any] = {
            "screen": force_screen,
            "log": force_log,
            "required": force_required,
            "overview": show_summary,
            "timeouts": Timeouts(sigint_timeout, sigterm_timeout),
        }
        self.config: ROSLaunchConfig | None = None
        self.runner: ROSLaunchRunner | None = None
        self.pm: ProcessMonitor | None = None
        self.server: None = None
        self.remote_runner: None = None

    def _load_config(self) -> None:
        self.config = load_config_default(
            self.roslaunch_files, self.port, self.roslaunch_strs, verbose=self.verbose
        )

    def start(self, auto_terminate: bool = True) -> None:
        """Set the parameters, and start the nodes.

        Args:
            auto_terminate: Whether the launch ends when all nodes have ended.

        Raises:
            RLException: A file is refused, or the launch cannot begin.
        """
        if self.config is None:
            self._load_config()
        assert self.config is not None  # noqa: S101  # it has just been loaded
        options = Options(
            local=self.local_only,
            verbose=self.verbose,
            title=False,
            stay=not auto_terminate,
            **self._options,
        )
        with raised_as(RLException, UsageError):
            monitor = ProcessMonitor(self.config.to_plan(), options)
        for listener in self.process_listeners:
            monitor.add_process_listener(listener)
        monitor.start()
        atexit.register(self.shutdown)
        self.pm = monitor
        self.runner = ROSLaunchRunner(self, monitor)

    def spin_once(self) -> bool:
        """Return whether the launch goes on."""
        return self.runner is not None and self.runner.spin_once()

    def spin(self) -> None:
        """Wait until the launch has ended; Ctrl-C ends it.

        Raises:
            RLException: It has not started.
        """
        if self.runner is None:
            raise RLException("parent not started yet")
        self.runner.spin()

    def shutdown(self) -> None:
        """End all nodes, and wait for that; a second call has no effect."""
        atexit.unregister(self.shutdown)
        if self.pm is not None:
            self.pm.shutdown()


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
        run_id = ready_context().params.peek("/run_id")
    except ParamNotFound:
        run_id = None
    return run_id if isinstance(run_id, str) else options_runid or generate_run_id()


class ROSLaunch:
    """Starts nodes, and ends them with `stop` or with the script."""

    def __init__(self) -> None:
        self.started = False
        uuid = get_or_generate_uuid(None, options_wait_for_master=False)
        self.parent = ROSLaunchParent(uuid, [], show_summary=False)

    def load(self, f: str) -> None:
        """Read a launch file, for `start`.

        Raises:
            RLException: It is refused.
        """
        self.parent.config = load_config_default([f], None)

    def load_str(self, s: str) -> None:
        """Read the text of a launch file, for `start`; see `load`."""
        self.parent.config = load_config_default([], None, [s])

    def launch(self, node: Node) -> Process:
        """Start a node, and return its process.

        Raises:
            RLException: The launch has not started, or the node cannot be started.
        """
        if not self.started or self.parent.runner is None:
            raise RLException("please start ROSLaunch first")
        if not isinstance(node, Node):
            raise ValueError("arg must be of type Node")  # noqa: TRY004  # as ROS 1
        process, started = self.parent.runner.launch_node(node)
        if process is None or not started:
            why = process.get_exit_description() if process is not None else ""
            raise RLException(f"failed to launch {node.package}/{node.type}: {why}")
        return process

    def start(self) -> None:
        """Begin, with the file or text that was loaded."""
        self.parent.start(auto_terminate=False)
        self.started = True

    def spin(self) -> None:
        """Wait until the launch has ended; Ctrl-C ends it."""
        self.parent.spin()

    def spin_once(self) -> bool:
        """Return whether the launch goes on."""
        return self.parent.spin_once()

    def stop(self) -> None:
        """End all nodes, and wait for that."""
        self.parent.shutdown()
        self.started = False
