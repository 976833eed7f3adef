"""Actions: goals that take time, give feedback, can be cancelled and end with a result.

There are two protocols. The protocol of ROS 2 has three services and two topics; it is part of
nodes (`rosz.node.actions`). The protocol of actionlib has five topics. `ActionlibClient`,
`ActionlibServer` and `SimpleActionServer` use it, and also reach programs of ROS 2
(`translation`). A gateway connects programs that support different protocols. `listing` finds the
actions of a network. This package may import nodes and everything below them. Names are imported
on first use, so that commands start fast.
"""

from __future__ import annotations

from rosz.lazy import exports_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rosz.actions.actionlib_client import ActionlibClient, ActionlibClientGoal
    from rosz.actions.actionlib_server import ActionlibServer, ActionlibServerGoal
    from rosz.actions.comm_state import CommState
    from rosz.actions.gateway import ServiceGateway, TopicGateway
    from rosz.actions.listing import (
        ActionEntry,
        action_type,
        describe_action,
        find_action,
        list_actions,
        view_of_action,
        wait_for_action,
    )
    from rosz.actions.simple_server import SimpleActionServer
    from rosz.actions.types import ActionTypes
    from rosz.node.actions import (
        FINAL,
        RESULT,
        SEND,
        STATUS,
        TERMINAL,
        ActionClient,
        ActionlibState,
        ActionServer,
        ClientGoal,
        GoalState,
        ServerGoal,
    )
else:
    __getattr__ = exports_of(__name__)
