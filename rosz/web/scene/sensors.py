"""Laser scans, point clouds, ranges, and the fields of view of cameras."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rosz.errors import UsageError
from rosz.transforms import FIELD_FORMATS, Pose
from rosz.web.scene.drawing import (
    BY_HEIGHT,
    BY_INTENSITY,
    OWN,
    Array,
    Drawing,
    color_bytes,
    moved,
    placed,
    rainbow,
)
from rosz.web.scene.setup import Look

MOST_POINTS = 500_000
"""Points of a cloud that are drawn; of more, every second one, or every third."""
_PIXELS = 3.0
_FAR = 1.0


def draw_scan(scan: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a LaserScan."""
    ranges = np.asarray(scan.ranges, dtype=np.float64)
    valid = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)
    angles = scan.angle_min + np.flatnonzero(valid) * scan.angle_increment
    x, y = ranges[valid] * np.cos(angles), ranges[valid] * np.sin(angles)
    points = moved(np.column_stack((x, y, np.zeros_like(x))), pose)
    intensities = np.asarray(scan.intensities, dtype=np.float64)
    values = intensities[valid] if len(intensities) == len(ranges) else None
    draw_points(points, values, None, look, drawing)
    return f"{len(points)} of {len(ranges)} points"


def draw_cloud(cloud: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a PointCloud2.

    Raises:
        UsageError: It has no coordinates, or its data end early.
    """
    rows = _rows(cloud)
    fields = rows.dtype.names or ()
    if any(name not in fields for name in "xyz"):
        raise UsageError(f"the cloud has no x, y and z; its fields are {', '.join(fields)}")
    step = -(-len(rows) // MOST_POINTS) or 1
    rows = rows[::step]
    points = np.column_stack([rows[name] for name in "xyz"]).astype(np.float32)
    finite = np.isfinite(points).all(axis=1)
    points, rows = moved(points[finite], pose), rows[finite]
    values = rows["intensity"].astype(np.float64) if "intensity" in fields else None
    own = next((rows[name] for name in ("rgb", "rgba") if name in fields), None)
    draw_points(points, values, None if own is None else _unpacked(own), look, drawing)
    part = f"every {step}th point, " if step > 1 else ""
    return f"{part}{len(points)} points"


def _rows(cloud: Any) -> Array:
    """Return the points of a cloud as an array of its fields."""
    order = ">" if cloud.is_bigendian else "<"
    fields = [field for field in cloud.fields if field.datatype in FIELD_FORMATS]
    try:
        kind = np.dtype(
            {
                "names": [field.name for field in fields],
                "formats": [order + FIELD_FORMATS[field.datatype] for field in fields],
                "offsets": [field.offset for field in fields],
                "itemsize": cloud.point_step,
            }
        )
    except ValueError as error:
        raise UsageError(f"the fields of the cloud do not fit: {error}") from error
    count, length = cloud.width * cloud.height, cloud.width * cloud.point_step
    needed = cloud.row_step * (cloud.height - 1) + length if count else 0
    if not count:
        return np.zeros(0, kind)
    if len(cloud.data) < needed or cloud.row_step < length:
        raise UsageError(f"the cloud has {len(cloud.data)} bytes of data; expected {needed}")
    if cloud.row_step == length or cloud.height == 1:
        return np.frombuffer(cloud.data, kind, count)
    lines = np.frombuffer(cloud.data[:needed].ljust(cloud.row_step * cloud.height), np.uint8)
    packed = np.ascontiguousarray(lines.reshape(cloud.height, -1)[:, :length])
    return packed.reshape(-1).view(kind)


def _unpacked(values: Array) -> Array:
    """Return the colors of a field ``rgb`` or ``rgba``, in which PCL keeps four bytes."""
    numbers = np.ascontiguousarray(values)
    if numbers.dtype.itemsize != 4:  # noqa: PLR2004
        numbers = numbers.astype(np.uint32)
    numbers = numbers.view(numbers.dtype.str[0] + "u4").astype(np.uint32)
    colors = np.full((len(numbers), 4), 255, dtype=np.uint8)
    for channel, shift in enumerate((16, 8, 0)):
        colors[:, channel] = numbers >> shift & 255
    return colors


def draw_old_cloud(cloud: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a PointCloud."""
    points = np.array([(p.x, p.y, p.z) for p in cloud.points[:MOST_POINTS]]).reshape(-1, 3)
    channels = {channel.name: channel.values for channel in cloud.channels}
    values = channels.get("intensity", channels.get("intensities"))
    listed = None if values is None else np.asarray(values, dtype=np.float64)[: len(points)]
    finite = np.isfinite(points).all(axis=1)
    if listed is not None and len(listed) == len(points):
        listed = listed[finite]
    draw_points(moved(points[finite], pose), listed, None, look, drawing)
    return f"{finite.sum()} points"


def draw_points(
    points: Array, values: Array | None, own: Array | None, look: Look, drawing: Drawing
) -> None:
    """Draw points by the color of a display: of their intensities, their own, or one for all."""
    by = look.color or (OWN if own is not None else BY_INTENSITY)
    if by == OWN and own is not None:
        colors = own
    elif by == BY_INTENSITY and values is not None and len(values) == len(points):
        colors = rainbow(values)
    elif by in {BY_HEIGHT, BY_INTENSITY, OWN}:
        colors = rainbow(points[:, 2])
    else:
        colors = color_bytes(by)
    drawing.points(points, colors, look.size or _PIXELS, pixels=True)


def draw_range(measured: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a Range as a cone from the sensor."""
    color = color_bytes(look.color)
    color[3] = 128
    if not (math.isfinite(measured.range) and measured.range > 0):
        return f"range {measured.range:g}"
    width = 2 * measured.range * math.tan(measured.field_of_view / 2)
    # A cone along z with its tip at the end, turned so that the tip is at the sensor.
    half = math.sqrt(0.5)
    inner = placed(
        Pose((measured.range / 2, 0.0, 0.0), (0.0, -half, 0.0, half)), width, width, measured.range
    )
    drawing.shapes("cone", placed(pose) @ inner, color)
    return f"{measured.range:.3g} m"


def draw_camera(info: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw the field of view of a camera as a pyramid, by its CameraInfo; the size is its height.

    Raises:
        UsageError: The camera is not calibrated.
    """
    (fx, _, cx), (_, fy, cy) = (info.k[0:3], info.k[3:6])
    if not (fx and fy and info.width and info.height):
        raise UsageError("the camera is not calibrated: its k or its size is 0")
    far = look.size or _FAR
    corners = np.array(
        [
            ((u - cx) / fx * far, (v - cy) / fy * far, far)
            for u, v in ((0, 0), (info.width, 0), (info.width, info.height), (0, info.height))
        ]
    )
    ends = [
        point
        for number in range(4)
        for point in (np.zeros(3), corners[number], corners[number], corners[number - 1])
    ]
    drawing.lines(moved(np.array(ends), pose), color_bytes(look.color, "#c13c8b"))
    return f"{info.width} x {info.height}"
