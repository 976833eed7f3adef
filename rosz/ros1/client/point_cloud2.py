"""sensor_msgs.point_cloud2: points of a PointCloud2 as tuples, and clouds made of tuples.

Values are read and written by ``struct``, so numpy is not needed; `ros_numpy` gives arrays.
"""

from __future__ import annotations

import struct
import sys
from collections import namedtuple
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import chain, starmap
from math import isnan
from typing import Any, cast

from rosz.msgs.sensor_msgs.msg import PointCloud2, PointField
from rosz.transforms import FIELD_FORMATS

__all__ = (
    "PointCloud2",
    "PointField",
    "create_cloud",
    "create_cloud_xyz32",
    "read_points",
    "read_points_list",
)

_DATATYPES = {kind: (code, struct.calcsize(f"={code}")) for kind, code in FIELD_FORMATS.items()}
"""Format and size in bytes of a field's value; scripts use this name of ROS 1 too."""


def read_points(
    cloud: PointCloud2,
    field_names: Collection[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[tuple[int, int]] = (),
) -> Iterator[tuple[Any, ...]]:
    """Yield the points of a cloud, row by row, as tuples of their fields by offset.

    Args:
        cloud: The cloud.
        field_names: Fields to read; all when not given. A field of several values yields each.
        skip_nans: Whether to leave out points that have a NaN.
        uvs: Columns and rows of the points to read; all when empty.

    Raises:
        AssertionError: The argument is not a PointCloud2.
        struct.error: The data end before a point.
    """
    _check(cloud)
    layout = struct.Struct(_get_struct_fmt(bool(cloud.is_bigendian), cloud.fields, field_names))
    points = _some_points(cloud, layout, uvs) if uvs else _all_points(cloud, layout)
    if not skip_nans:
        yield from points
        return
    for point in points:
        # The sum is NaN if a value is, and otherwise only for infinite ones of both signs.
        total = sum(point)
        if total == total or not any(map(isnan, point)):  # noqa: PLR0124
            yield point


def read_points_list(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[tuple[int, int]] = (),
) -> list[Any]:
    """Return the points of a cloud as named tuples; the arguments are those of `read_points`.

    The values come in the order of their offsets, whatever the order of ``field_names``.
    """
    _check(cloud)
    if field_names is None:
        field_names = [field.name for field in cloud.fields]
    kind = namedtuple("Point", field_names)  # type: ignore[misc]  # noqa: PYI024
    make = kind._make  # noqa: SLF001  # faster than a call with as many arguments
    return list(map(make, read_points(cloud, field_names, skip_nans, uvs)))


def create_cloud(header: Any, fields: list[PointField], points: Any) -> PointCloud2:
    """Return a little-endian cloud of one row.

    Args:
        header: Its header.
        fields: Its fields.
        points: Values of each point, in the order of the offsets of the fields: tuples, lists, or
            an array of numpy with a row for each point.

    Raises:
        struct.error: A point has another number of values than the fields, or one of another kind.
    """
    layout = struct.Struct(_get_struct_fmt(False, fields))
    data = _packed_array(layout.format, points) if hasattr(points, "dtype") else None
    if data is None:
        data = b"".join(starmap(layout.pack, points))
    count = len(data) // layout.size if layout.size else len(points)
    return PointCloud2(
        header=header,
        height=1,
        width=count,
        is_dense=False,
        is_bigendian=False,
        fields=fields,
        point_step=layout.size,
        row_step=len(data),
        data=data,
    )


def create_cloud_xyz32(header: Any, points: Any) -> PointCloud2:
    """Return a cloud with the fields x, y and z of type FLOAT32; see `create_cloud`."""
    fields = [PointField(name, 4 * at, PointField.FLOAT32, 1) for at, name in enumerate("xyz")]
    return create_cloud(header, fields, points)


def _check(cloud: Any) -> None:
    if getattr(cloud, "_type", "") != PointCloud2._type:
        raise AssertionError(f"expected a sensor_msgs/PointCloud2, got {type(cloud).__name__}")


def _get_struct_fmt(
    is_bigendian: bool, fields: Iterable[PointField], field_names: Collection[str] | None = None
) -> str:
    """Return the format of a point for ``struct``; scripts use this name of ROS 1 too."""
    layout = ">" if is_bigendian else "<"
    end = 0
    for field in sorted(fields, key=lambda field: field.offset):
        if field_names is not None and field.name not in field_names:
            continue
        if end < field.offset:
            layout += f"{field.offset - end}x"
            end = field.offset
        if field.datatype not in _DATATYPES:
            sys.stderr.write(f"field '{field.name}' has no known datatype: {field.datatype}\n")
            continue
        code, size = _DATATYPES[field.datatype]
        layout += code * field.count
        end += size * field.count
    return layout


def _packed_array(layout: str, points: Any) -> bytes | None:
    """Return the data of an array of floats if the fields are all floats of one size."""
    import numpy as np

    kind = {"<f": "<f4", "<d": "<f8"}.get(layout[:2])
    values = len(layout) - 1
    same = kind is not None and layout[1] * values == layout[1:]
    if not same or points.dtype.kind != "f" or points.shape[1:] != (values,):
        return None
    with np.errstate(over="ignore"):
        packed = points.astype(kind)
    if np.count_nonzero(np.isinf(packed)) != np.count_nonzero(np.isinf(points)):
        return None  # the error of struct names the value
    return cast("bytes", packed.tobytes())


def _all_points(cloud: PointCloud2, layout: struct.Struct) -> Iterator[tuple[Any, ...]]:
    data = memoryview(cast("bytes", cloud.data))
    step, row, length = cloud.point_step, cloud.row_step, cloud.width * cloud.point_step
    if not length or step < layout.size or len(data) < cloud.height * row:
        # Unusual sizes: points overlap, or the data end early.
        every = ((u, v) for v in range(cloud.height) for u in range(cloud.width))
        return _some_points(cloud, layout, every)
    unpack = struct.Struct(f"{layout.format}{step - layout.size}x").iter_unpack
    if row == length:
        return unpack(data[: cloud.height * row])
    starts = range(0, cloud.height * row, row)
    return chain.from_iterable(unpack(data[start : start + length]) for start in starts)


def _some_points(
    cloud: PointCloud2, layout: struct.Struct, uvs: Iterable[tuple[int, int]]
) -> Iterator[tuple[Any, ...]]:
    step, row, data = cloud.point_step, cloud.row_step, cast("bytes", cloud.data)
    for u, v in uvs:
        yield layout.unpack_from(data, row * v + step * u)
