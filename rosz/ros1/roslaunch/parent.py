"""roslaunch.parent: a launch that a script starts and ends (ROS wiki, roslaunch API)."""

from __future__ import annotations

import atexit
import sys
from collections.abc import Sequence
from typing import Any

from rosz.errors import UsageError
from rosz.launch.run import Options, Timeouts
from rosz.ros1.roslaunch.config import ROSLaunchConfig, load_config_default, node_plan
from rosz.ros1.roslaunch.core import Node, RLException
from rosz.ros1.roslaunch.pmon import Process, ProcessMonitor

__all__ = ("ROSLaunchParent", "ROSLaunchRunner")


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
        verbose: Whether to print what is added, and command lines.
        force_screen: Whether all nodes write to the screen.
        force_log: Whether none writes its standard output to the screen.
        is_rostest: Ignored.
        roslaunch_strs: Texts of launch files.
        show_summary: Whether to print an overview.
        force_required: Whether all nodes are required.
        sigint_timeout: Seconds from SIGINT to SIGTERM.
        sigterm_timeout: Seconds from SIGTERM to SIGKILL.

    Attributes:
        config: What there is to launch; read in `start` if a script has set none.
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
        try:
            monitor = ProcessMonitor(self.config.to_plan(), options, (sys.stdout, sys.stderr))
        except UsageError as error:
            raise RLException(str(error)) from error
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
