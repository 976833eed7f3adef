"""laser_geometry: laser scans as point clouds (ROS wiki, laser_geometry).

Needs the extra ``rosz[numpy]``. May import numpy and message classes.
"""

from __future__ import annotations

from rosz.ros1.laser_geometry.laser_geometry import LaserProjection

PUBLIC_MODULES = ("laser_geometry",)

__all__ = ("LaserProjection",)
