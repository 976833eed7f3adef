"""Actions: goals that take time, give feedback, can be cancelled and end with a result.

The protocol is that of actionlib: five topics below the name of the action (``goal``, ``cancel``,
``status``, ``feedback``, ``result``) and the goal states of ``actionlib_msgs/GoalStatus``. `types`
holds the message classes of an action and the kinds of states, `client` sends goals, `server`
receives them, and `simple_server` executes them one at a time. May import nodes and everything
below them.
"""

from rosz.actions.client import ActionClient, ClientGoal, CommState
from rosz.actions.gateway import ActionGateway, ServiceGateway
from rosz.actions.server import ActionServer, ServerGoal
from rosz.actions.simple_server import SimpleActionServer
from rosz.actions.types import ActionTypes

__all__ = (
    "ActionClient",
    "ActionGateway",
    "ActionServer",
    "ActionTypes",
    "ClientGoal",
    "CommState",
    "ServerGoal",
    "ServiceGateway",
    "SimpleActionServer",
)
