"""Run launch plans: parameters, processes, their output and their end.

`Runner` takes a plan and a `Network`; a `StatusClient` sends requests to running launches; the
public module `report` returns the texts of roslaunch about a plan. May import floors 0 to 5.
`relay` is a program, which runs beside the launch. The names are imported on first use, since
commands have to start fast.
"""

from __future__ import annotations

from rosz.lazy import exports_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rosz.launch.run.agent import serve
    from rosz.launch.run.command import Workplace, container_of, locate, run_command
    from rosz.launch.run.control import LaunchStatus, NodeStatus, StatusClient
    from rosz.launch.run.host import is_local, is_local_address
    from rosz.launch.run.loop import interrupted_by_signals
    from rosz.launch.run.machines import MachineOption
    from rosz.launch.run.network import (
        Network,
        RouterProcess,
        core_params,
        needs_router,
        write_params,
    )
    from rosz.launch.run.protocol import Timeouts
    from rosz.launch.run.runner import Options, Runner, describe_plan
    from rosz.launch.run.supervisor import LaunchProcess, Supervisor
else:
    __getattr__ = exports_of(__name__)


PUBLIC_MODULES = ("report",)
