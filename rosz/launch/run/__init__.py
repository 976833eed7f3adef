"""Carrying launch plans out: parameters, processes, their output and their end.

`Runner` takes a plan and a `Network`; ``order`` and ``statuses`` speak to a launch that runs. May
import floors 0 to 5. Programs that are no part of the launch process: `relay`.
"""

from rosz.launch.run.command import Command, Workplace, run_command
from rosz.launch.run.control import LaunchStatus, NodeStatus, order, statuses
from rosz.launch.run.host import Child, Host, Job
from rosz.launch.run.hub import Hub, wants_hub
from rosz.launch.run.machines import MachineCall
from rosz.launch.run.network import GraphReadiness, Network
from rosz.launch.run.parameters import ParamStore, core_params
from rosz.launch.run.process import Readiness, Timeouts
from rosz.launch.run.runner import Options, Runner
from rosz.launch.run.stopping import interrupted_by_signals

__all__ = (
    "Child",
    "Command",
    "GraphReadiness",
    "Host",
    "Hub",
    "Job",
    "LaunchStatus",
    "MachineCall",
    "Network",
    "NodeStatus",
    "Options",
    "ParamStore",
    "Readiness",
    "Runner",
    "Timeouts",
    "Workplace",
    "core_params",
    "interrupted_by_signals",
    "order",
    "run_command",
    "statuses",
    "wants_hub",
)
