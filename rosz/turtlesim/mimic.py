"""The program ``mimic``: a turtle does what another one does.

Its topics are ``input/pose`` and ``output/cmd_vel``; remapping ``input`` or ``output`` moves all
that is below, as it does for a namespace of roscpp.
"""

from __future__ import annotations

from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.turtlesim.msg import Pose
from rosz.node import Node
from rosz.node.standard import serve_loggers

__all__ = ("main",)


def main() -> None:
    """Mimic until told to end."""
    with Node("turtle_mimic") as node:
        serve_loggers(node)
        output = f"{node.resolve('output')}/cmd_vel"
        commands = node.publisher(output, Twist, queue_size=1)

        def follow(pose: Pose) -> None:
            commands.publish(
                Twist(Vector3(x=pose.linear_velocity), Vector3(z=pose.angular_velocity))
            )

        node.subscription(f"{node.resolve('input')}/pose", Pose, follow, queue_size=1)
        node.spin()
