"""laser_geometry beside ROS 1's."""

from __future__ import annotations

import oracle
import pytest

SNIPPET = """
import math
import laser_geometry.laser_geometry as module
from laser_geometry import LaserProjection
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
def scan(count=40, intensities=40, **options):
    ranges = [0.05 * (at + 1) for at in range(count)]
    ranges[1:6] = [math.nan, math.inf, -math.inf, 0.0, 30.0]
    return LaserScan(**{**dict(header=Header(frame_id="laser"), angle_min=-1.5, angle_max=1.5,
        angle_increment=3.0 / 39, time_increment=0.001, range_min=0.1, range_max=1.5,
        ranges=ranges[:count], intensities=[3.5 * at for at in range(intensities)]), **options})
def shown(cloud):
    return [cloud.header.frame_id, cloud.height, cloud.width, cloud.point_step, cloud.row_step,
        bool(cloud.is_dense), bool(cloud.is_bigendian), bytes(cloud.data).hex(),
        [[f.name, f.offset, f.datatype, f.count] for f in cloud.fields]]
option = LaserProjection.ChannelOption
projection = LaserProjection()
result = [
    [shown(projection.projectLaser(scan(), -1.0, options)) for options in range(32)],
    [shown(projection.projectLaser(scan(), cutoff)) for cutoff in (0, 0.5, 1.5, 100)],
    shown(projection.projectLaser(scan(intensities=0))),
    shown(projection.projectLaser(scan(7))), shown(projection.projectLaser(scan(0, 0))),
    shown(LaserProjection().projectLaser(scan_in=scan(), channel_options=option.NONE)),
    shown(projection.projectLaser(scan(angle_min=-0.5, angle_increment=0.01))),
    sorted(name for name in vars(option) if name.isupper()), option.DEFAULT,
    LaserProjection.LASER_SCAN_INVALID, LaserProjection.LASER_SCAN_MIN_RANGE,
    LaserProjection.LASER_SCAN_MAX_RANGE, module.LaserProjection is LaserProjection,
]
"""


@pytest.mark.ros1
def test_clouds_are_those_of_ros_1() -> None:
    pytest.importorskip("numpy")
    oracle.same(SNIPPET, "laser_geometry", "python3-laser-geometry")
