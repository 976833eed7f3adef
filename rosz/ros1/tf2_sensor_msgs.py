"""tf2_sensor_msgs: transformed point clouds, also by buffers once it is imported (ROS wiki)."""

from __future__ import annotations

from typing import Any

from rosz.msgs.sensor_msgs.msg import PointCloud2
from rosz.ros1.point_cloud2 import create_cloud, read_points
from rosz.ros1.tf2_ros import ConvertRegistration, TransformRegistration
from rosz.transforms import Pose, compose, pose_of

__all__ = ("do_transform_cloud",)

_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)


def do_transform_cloud(cloud: PointCloud2, transform: Any) -> PointCloud2:
    """Transform the points of a cloud by a TransformStamped.

    Args:
        cloud: Cloud whose first three fields are ``x``, ``y`` and ``z``.
        transform: The transform.
    """
    pose = pose_of(transform.transform)
    moved = [
        (*compose(pose, Pose((x, y, z), _NO_ROTATION)).translation, *rest)
        for x, y, z, *rest in read_points(cloud)
    ]
    return create_cloud(transform.header, cloud.fields, moved)


TransformRegistration().add(PointCloud2, do_transform_cloud)
ConvertRegistration().add_to_msg(PointCloud2, lambda cloud: cloud)
ConvertRegistration().add_from_msg(PointCloud2, lambda cloud: cloud)
