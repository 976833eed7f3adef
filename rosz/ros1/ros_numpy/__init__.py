"""ros_numpy: messages as arrays of numpy, and back.

Needs the extra ``rosz[numpy]``. May import numpy, message classes and tf.
"""

from __future__ import annotations

from rosz.ros1.ros_numpy import geometry, image, occupancy_grid, point_cloud2
from rosz.ros1.ros_numpy.registry import msgify, numpify, numpy_msg

PUBLIC_MODULES = ("geometry", "image", "occupancy_grid", "point_cloud2", "registry")

__all__ = (
    "geometry",
    "image",
    "msgify",
    "numpify",
    "numpy_msg",
    "occupancy_grid",
    "point_cloud2",
)
