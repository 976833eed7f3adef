"""Run launch plans: parameters, processes, their output and their end.

`Runner` takes a plan and a `Network`; a `StatusClient` sends requests to running launches. May
import floors 0 to 5. `relay` is a program, which runs beside the launch. The public modules are
those that start-up needs alone.
"""

from rosz.launch.run.command import Command, Workplace, run_command
from rosz.launch.run.control import LaunchStatus, NodeStatus, StatusClient
from rosz.launch.run.excerpt import Excerpt
from rosz.launch.run.host import Child, Host, ProcessSpec, is_local
from rosz.launch.run.loop import interrupted_by_signals
from rosz.launch.run.machines import MachineOption
from rosz.launch.run.network import (
    Network,
    RouterProcess,
    core_params,
    needs_router,
    write_params,
)
from rosz.launch.run.process_tree import ProcessTree
from rosz.launch.run.runner import Options, Runner, describe_plan
from rosz.launch.run.supervisor import Process as LaunchProcess
from rosz.launch.run.supervisor import Supervisor, Timeouts

__all__ = (
    "Child",
    "Command",
    "Excerpt",
    "Host",
    "LaunchProcess",
    "LaunchStatus",
    "MachineOption",
    "Network",
    "NodeStatus",
    "Options",
    "ProcessSpec",
    "ProcessTree",
    "RouterProcess",
    "Runner",
    "StatusClient",
    "Supervisor",
    "Timeouts",
    "Workplace",
    "core_params",
    "describe_plan",
    "interrupted_by_signals",
    "is_local",
    "needs_router",
    "run_command",
    "write_params",
)

PUBLIC_MODULES = ("agent", "command", "network")
