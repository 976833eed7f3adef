"""Messages in other frames: points, poses, vectors, wrenches and point clouds."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from rosz.errors import UsageError
from rosz.msgs.geometry_msgs import msg as geometry
from rosz.msgs.sensor_msgs.msg import PointCloud2, PointField
from rosz.transforms.poses import Pose, compose, rotate

if TYPE_CHECKING:
    import numpy as np

    from rosz.msgs.std_msgs.msg import Header

    Array = np.ndarray[Any, np.dtype[Any]]

_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)
FIELD_FORMATS = {
    PointField.INT8: "b",
    PointField.UINT8: "B",
    PointField.INT16: "h",
    PointField.UINT16: "H",
    PointField.INT32: "i",
    PointField.UINT32: "I",
    PointField.FLOAT32: "f",
    PointField.FLOAT64: "d",
}
"""The formats of a PointField's datatypes in ``struct`` and numpy, without the order of bytes."""
_FLOATS = (PointField.FLOAT32, PointField.FLOAT64)


def transform_message(message: Any, pose: Pose, header: Header) -> Any:
    """Return a message in another frame.

    Args:
        message: A ``PointStamped``, ``PoseStamped``, ``Vector3Stamped``, ``WrenchStamped`` or
            ``PointCloud2``.
        pose: Pose of the frame of the message in the other frame.
        header: Header of the result.

    Raises:
        UsageError: It is another message, or a cloud without coordinates.
    """
    for kind, transform in _TRANSFORMS.items():
        if isinstance(message, kind):
            return transform(message, pose, header)
    names = ", ".join(sorted(kind.__name__ for kind in _TRANSFORMS))
    raise UsageError(f"cannot transform a {type(message).__name__}; expected one of {names}")


def transform_point(
    message: geometry.PointStamped, pose: Pose, header: Header
) -> geometry.PointStamped:
    """Return a point in another frame."""
    p = message.point
    moved = compose(pose, Pose((p.x, p.y, p.z), _NO_ROTATION))
    return geometry.PointStamped(header, geometry.Point(*moved.translation))


def transform_pose(
    message: geometry.PoseStamped, pose: Pose, header: Header
) -> geometry.PoseStamped:
    """Return a pose in another frame."""
    p, q = message.pose.position, message.pose.orientation
    moved = compose(pose, Pose((p.x, p.y, p.z), (q.x, q.y, q.z, q.w)))
    point, rotation = geometry.Point(*moved.translation), geometry.Quaternion(*moved.rotation)
    return geometry.PoseStamped(header, geometry.Pose(point, rotation))


def transform_vector(
    message: geometry.Vector3Stamped, pose: Pose, header: Header
) -> geometry.Vector3Stamped:
    """Return a vector in another frame, where only its direction differs."""
    return geometry.Vector3Stamped(header, _rotated(message.vector, pose))


def transform_wrench(
    message: geometry.WrenchStamped, pose: Pose, header: Header
) -> geometry.WrenchStamped:
    """Return a wrench in another frame, where only its directions differ."""
    force, torque = _rotated(message.wrench.force, pose), _rotated(message.wrench.torque, pose)
    return geometry.WrenchStamped(header, geometry.Wrench(force, torque))


def _rotated(vector: geometry.Vector3, pose: Pose) -> geometry.Vector3:
    return geometry.Vector3(*rotate(pose.rotation, (vector.x, vector.y, vector.z)))


def transform_cloud(
    cloud: PointCloud2, pose: Pose, header: Header, names: Sequence[str] = ("x", "y", "z")
) -> PointCloud2:
    """Return a cloud in another frame.

    Its layout stays, and so do all fields but the coordinates: normals are not rotated. With numpy
    it is many times faster, with the same result.

    Args:
        cloud: Cloud with coordinates of type FLOAT32 or FLOAT64.
        pose: Pose of the frame of the cloud in the other frame.
        header: Header of the result.
        names: Names of the fields of the coordinates.

    Raises:
        UsageError: A coordinate is missing or has another type, or the data end early.
        OverflowError: A coordinate is too large for its field.
    """
    places = [_place(cloud, name) for name in names]
    needed = (cloud.height - 1) * cloud.row_step + cloud.width * cloud.point_step
    if cloud.width and cloud.height and len(cloud.data) < needed:
        raise UsageError(f"the cloud has {len(cloud.data)} bytes of data; expected {needed}")
    data = bytearray(cloud.data)
    if not _move_arrays(cloud, pose, places, data):
        _move_points(cloud, pose, places, data)
    return PointCloud2(
        header=header,
        height=cloud.height,
        width=cloud.width,
        fields=cloud.fields,
        is_bigendian=cloud.is_bigendian,
        point_step=cloud.point_step,
        row_step=cloud.row_step,
        data=bytes(data),
        is_dense=cloud.is_dense,
    )


def _place(cloud: PointCloud2, name: str) -> tuple[int, str]:
    """Return the offset of a coordinate in each point, and its format for ``struct``."""
    field = next((field for field in cloud.fields if field.name == name), None)
    if field is None or field.datatype not in _FLOATS or field.count > 1:
        got = "none" if field is None else f"datatype {field.datatype}, count {field.count}"
        raise UsageError(f"the cloud has no coordinate '{name}': expected one float, got {got}")
    code = FIELD_FORMATS[field.datatype]
    if field.offset + struct.calcsize(f"={code}") > cloud.point_step:
        raise UsageError(f"the coordinate '{name}' ends after point_step {cloud.point_step}")
    return field.offset, (">" if cloud.is_bigendian else "<") + code


def _move_points(
    cloud: PointCloud2, pose: Pose, places: list[tuple[int, str]], data: bytearray
) -> None:
    layouts = [(offset, struct.Struct(code)) for offset, code in places]
    for row in range(cloud.height):
        for column in range(cloud.width):
            at = row * cloud.row_step + column * cloud.point_step
            x, y, z = (layout.unpack_from(data, at + offset)[0] for offset, layout in layouts)
            moved = compose(pose, Pose((x, y, z), _NO_ROTATION)).translation
            for (offset, layout), value in zip(layouts, moved, strict=True):
                layout.pack_into(data, at + offset, value)


def _move_arrays(
    cloud: PointCloud2, pose: Pose, places: list[tuple[int, str]], data: bytearray
) -> bool:
    """Move all points at once; return whether that is possible."""
    try:
        import numpy as np
    except ImportError:
        return False
    shape, strides = (cloud.height, cloud.width), (cloud.row_step, cloud.point_step)
    if 0 in shape:
        return True
    if cloud.height > 1 and cloud.row_step < cloud.width * cloud.point_step:
        return False  # the rows overlap
    views = [np.ndarray(shape, code[0] + code[1], data, offset, strides) for offset, code in places]
    old = [view.astype(float) for view in views]
    with np.errstate(all="ignore"):
        new = _moved(pose, *old)
        for view, values in zip(views, new, strict=True):
            view[...] = values
        largest = [
            np.isinf(view) & np.isfinite(values) for view, values in zip(views, new, strict=True)
        ]
    if any(map(np.any, largest)):
        raise OverflowError("a coordinate of the transformed cloud is too large for its field")
    return True


def _moved(pose: Pose, *points: Array) -> tuple[Array, Array, Array]:
    """Return the coordinates of many points in another frame."""
    # The operations of `compose`, in their order, so that each bit of the result is the same.
    (px, py, pz), (ax, ay, az, aw) = pose
    x, y, z = (values + 0.0 for values in points)
    tx, ty, tz = 2.0 * (ay * z - az * y), 2.0 * (az * x - ax * z), 2.0 * (ax * y - ay * x)
    return (
        px + x + aw * tx + ay * tz - az * ty,
        py + y + aw * ty + az * tx - ax * tz,
        pz + z + aw * tz + ax * ty - ay * tx,
    )


_TRANSFORMS: dict[type[Any], Callable[[Any, Pose, Header], Any]] = {
    geometry.PointStamped: transform_point,
    geometry.PoseStamped: transform_pose,
    geometry.Vector3Stamped: transform_vector,
    geometry.WrenchStamped: transform_wrench,
    PointCloud2: transform_cloud,
}
