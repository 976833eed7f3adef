"""tf: coordinate frames, and the arithmetic of rotations (ROS wiki, tf).

Point clouds and twists are not transformed here, and there are no tf prefixes.
"""

from rosz.ros1.tf import transformations
from rosz.ros1.tf.broadcaster import TransformBroadcaster
from rosz.ros1.tf.listener import (
    ConnectivityException,
    Exception,  # noqa: A004  # ROS 1's
    ExtrapolationException,
    LookupException,
    Transformer,
    TransformerROS,
    TransformListener,
)

__all__ = (
    "ConnectivityException",
    "Exception",
    "ExtrapolationException",
    "LookupException",
    "TransformBroadcaster",
    "TransformListener",
    "Transformer",
    "TransformerROS",
    "transformations",
)
