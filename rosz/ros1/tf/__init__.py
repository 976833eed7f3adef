"""tf: transforms between coordinate frames, and the arithmetic of rotations (ROS wiki, tf).

Point clouds, twists and tf prefixes are not supported.
"""

from rosz.ros1.tf import transformations
from rosz.ros1.tf.frames import (
    ConnectivityException,
    Exception,  # noqa: A004  # ROS 1's
    ExtrapolationException,
    LookupException,
    TransformBroadcaster,
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
