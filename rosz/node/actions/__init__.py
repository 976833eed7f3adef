"""Actions by ROS 2's protocol, for `Node.action_client` and `Node.action_server`.

`states` is the table of goal states, `client` and `server` speak the protocol, and `watch` notices
a server that does not answer. Other packages use `rosz.actions`, which has actionlib's protocol as
well. The names are imported on first use, since few nodes have actions.
"""

from __future__ import annotations

from rosz.lazy import exports_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rosz.node.actions.client import ActionClient, ClientGoal
    from rosz.node.actions.server import ActionServer, GoalServer, ServerGoal, ServerOptions
    from rosz.node.actions.states import (
        ACTIONLIB_STEPS,
        CANCEL,
        FEEDBACK,
        FINAL,
        RESULT,
        RUNNING,
        SEND,
        STATUS,
        TERMINAL,
        TO_ACTIONLIB,
        TO_ROS2,
        ActionlibState,
        GoalState,
    )
    from rosz.node.actions.watch import LONGEST_SILENCE, ServerWatch
else:
    __getattr__ = exports_of(__name__)
