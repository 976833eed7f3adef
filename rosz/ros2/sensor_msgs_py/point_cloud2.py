"""sensor_msgs_py.point_cloud2: clouds as arrays of numpy, and clouds made of points."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import numpy as np

from rosz.errors import UsageError
from rosz.msgs.sensor_msgs.msg import PointCloud2, PointField
from rosz.transforms import FIELD_FORMATS as _FIELD_FORMATS

Array: TypeAlias = np.ndarray[Any, np.dtype[Any]]


def dtype_from_fields(
    fields: Iterable[PointField], point_step: int | None = None, *, bigendian: bool = False
) -> np.dtype[Any]:
    """Return the type of a point, a record with a name for each field.

    Args:
        fields: Fields of the cloud; one of several values has as many names: ``name_0``, ….
        point_step: Bytes from one point to the next; as the fields need when not given.
        bigendian: Whether the most significant byte comes first.
    """
    columns: dict[str, tuple[str, int]] = {}
    for field in fields:
        kind = (">" if bigendian else "<") + _FIELD_FORMATS[field.datatype]
        size = np.dtype(kind).itemsize
        base = field.name or f"unnamed_field_{len(columns)}"
        for index in range(max(field.count, 1)):
            name = f"{base}_{index}" if field.count > 1 else base
            columns[name] = kind, field.offset + index * size
    layout: Any = {
        "names": list(columns),
        "formats": [kind for kind, _ in columns.values()],
        "offsets": [offset for _, offset in columns.values()],
    }
    if point_step is not None:
        layout["itemsize"] = point_step
    kind_of_point: np.dtype[Any] = np.dtype(layout)
    return kind_of_point


def read_points(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[int] | Array | None = None,
    reshape_organized_cloud: bool = False,
) -> Array:
    """Return the points of a cloud as a structured array.

    Args:
        cloud: The cloud.
        field_names: Fields to read; all when not given.
        skip_nans: Whether to leave out points that have a NaN.
        uvs: Indices of the points to read; all when not given.
        reshape_organized_cloud: Whether a cloud of several rows has the shape (height, width).

    Raises:
        UsageError: The argument is not a PointCloud2, has no such field, or its data are too short.
    """
    if not isinstance(cloud, PointCloud2):
        raise UsageError(f"expected a PointCloud2, got {type(cloud).__name__}")
    kind = dtype_from_fields(cloud.fields, cloud.point_step, bigendian=bool(cloud.is_bigendian))
    row = cloud.point_step * cloud.width
    step = max(cloud.row_step, row)
    expected = step * max(cloud.height - 1, 0) + (row if cloud.height else 0)
    if len(cloud.data) < expected:
        raise UsageError(f"the cloud has {len(cloud.data)} bytes; expected {expected}")
    points: Array = np.ndarray(
        (cloud.height, cloud.width), kind, bytes(cloud.data), strides=(step, cloud.point_step)
    )
    if not reshape_organized_cloud or cloud.height <= 1:
        points = points.reshape(-1)
    if field_names is not None:
        unknown = [name for name in field_names if name not in (kind.names or ())]
        if unknown:
            raise UsageError(
                f"the cloud has no field '{unknown[0]}', only {', '.join(kind.names or ())}"
            )
        points = points[list(field_names)]
    if skip_nans:
        sound = np.ones(points.shape, bool)
        for name in points.dtype.names or ():
            sound &= ~np.isnan(points[name])
        points = points[sound]
    return points if uvs is None else points[np.asarray(uvs)]


def read_points_numpy(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[int] | Array | None = None,
    reshape_organized_cloud: bool = False,
) -> Array:
    """Return the points as an array of shape (points, fields), whose fields have one type.

    Args:
        cloud: The cloud.
        field_names: Fields to read; all when not given.
        skip_nans: Whether to leave out points that have a NaN.
        uvs: Indices of the points to read; all when not given.
        reshape_organized_cloud: Whether a cloud of several rows has the shape (height, width,
            fields).

    Raises:
        UsageError: The fields have several types, or as for `read_points`.
    """
    points = read_points(cloud, field_names, skip_nans, uvs, reshape_organized_cloud)
    names = points.dtype.names or ()
    kinds = {points.dtype[name] for name in names}
    if len(kinds) > 1:
        raise UsageError("the fields have several types; name fields of one type, or read_points()")
    return np.stack([points[name] for name in names], axis=-1)


def read_points_list(
    cloud: PointCloud2,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[int] | Array | None = None,
) -> list[Any]:
    """Return the points as named tuples; the arguments are those of `read_points`."""
    points = read_points(cloud, field_names, skip_nans, uvs)
    kind = namedtuple("Point", points.dtype.names or ())  # type: ignore[misc]  # noqa: PYI024
    return [kind(*point) for point in points.tolist()]


def create_cloud(
    header: Any, fields: Sequence[PointField], points: Any, step: int | None = None
) -> PointCloud2:
    """Return a cloud of points.

    Args:
        header: Header of the cloud.
        fields: Fields of a point.
        points: Points: a structured array, one of shape (points, fields) or (height, width,
            fields), or a list of tuples.
        step: Bytes from one point to the next; as the fields need when not given.

    Raises:
        UsageError: The points have another number of values than the fields.
    """
    kind = dtype_from_fields(fields, step)
    names = kind.names or ()
    given = np.asarray(points if isinstance(points, np.ndarray) else list(points))
    if given.dtype.names is not None:
        shape, columns = given.shape, [given[name] for name in given.dtype.names]
    else:
        given = given.reshape(0, len(names)) if given.size == 0 else given
        shape, columns = given.shape[:-1], list(np.moveaxis(given, -1, 0))
    if len(columns) != len(names):
        raise UsageError(f"a point has {len(columns)} values; the fields have {len(names)}")
    cloud = np.zeros(shape, kind)
    for name, column in zip(names, columns, strict=True):
        cloud[name] = column
    height, width = shape if len(shape) == 2 else (1, cloud.size)  # noqa: PLR2004
    return PointCloud2(
        header=header,
        height=height,
        width=width,
        fields=list(fields),
        is_bigendian=False,
        point_step=kind.itemsize,
        row_step=kind.itemsize * width,
        data=cloud.tobytes(),
        is_dense=False,
    )


def create_cloud_xyz32(header: Any, points: Any) -> PointCloud2:
    """Return a cloud of points with the fields x, y and z, of 32 bits each."""
    fields = [
        PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
        for index, name in enumerate("xyz")
    ]
    return create_cloud(header, fields, points)
