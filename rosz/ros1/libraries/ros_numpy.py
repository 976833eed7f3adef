"""ros_numpy: messages as arrays of numpy, and back.

Vectors, points and quaternions are arrays of numbers, poses and transforms 4x4 matrices, images and
grids arrays of rows and columns, clouds arrays of records. Arrays of more dimensions give arrays of
geometric messages.

Needs the extra ``rosz[numpy]``. May import numpy, message classes and tf.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, Literal, TypeVar

import numpy as np

from rosz.message import Message
from rosz.msgs.geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3
from rosz.msgs.nav_msgs.msg import MapMetaData, OccupancyGrid
from rosz.msgs.sensor_msgs.msg import Image, PointCloud2, PointField
from rosz.ros1.client.rospy.numpy_msg import numpy_msg
from rosz.ros1.client.tf import transformations
from rosz.transforms import FIELD_FORMATS

__all__ = (
    "geometry",
    "image",
    "msgify",
    "numpify",
    "numpy_msg",
    "occupancy_grid",
    "point_cloud2",
)

geometry: ModuleType  # built by the importer, as the next three
image: ModuleType
occupancy_grid: ModuleType
point_cloud2: ModuleType

Converter = Callable[..., Any]
_F = TypeVar("_F", bound=Converter)

_to_numpy: dict[tuple[type[Any], bool], Converter] = {}
_from_numpy: dict[tuple[type[Any], bool], Converter] = {}


def converts_to_numpy(msgtype: type[Any], plural: bool = False) -> Callable[[_F], _F]:
    """Register a function that converts a message, or a list of messages, to an array.

    Raises:
        TypeError: The type is not a message class.
    """
    return _declaring(_to_numpy, msgtype, plural)


def converts_from_numpy(msgtype: type[Any], plural: bool = False) -> Callable[[_F], _F]:
    """Register a function that converts an array back; see `converts_to_numpy`."""
    return _declaring(_from_numpy, msgtype, plural)


def numpify(msg: Any, *args: Any, **kwargs: Any) -> Any:
    """Return the array of a message or of a list of messages; None for None.

    Args:
        msg: The message or list.
        args: Further arguments of the function that converts it.
        kwargs: Likewise.

    Raises:
        ValueError: No function converts messages of that type, or the list is empty.
    """
    if msg is None:
        return None
    convert = _find(_to_numpy, type(msg), plural=False)
    if convert is None and isinstance(msg, Sequence):
        if not msg:
            raise ValueError("an empty list does not say of what it is; expected messages")
        convert = _find(_to_numpy, type(msg[0]), plural=True)
    if convert is None:
        raise ValueError(f"no array for {type(msg).__name__}; expected {_names(_to_numpy)}")
    return convert(msg, *args, **kwargs)


def msgify(msg_type: type[Any], numpy_obj: Any, *args: Any, **kwargs: Any) -> Any:
    """Return the message of an array.

    Args:
        msg_type: Class of the message.
        numpy_obj: The array.
        args: Further arguments of the function that converts it.
        kwargs: Likewise; ``plural=True`` returns a list of messages.

    Raises:
        ValueError: No function converts arrays to messages of that type.
    """
    convert = _find(_from_numpy, msg_type, plural=kwargs.pop("plural", False))
    if convert is None:
        raise ValueError(f"no {msg_type.__name__} of an array; expected {_names(_from_numpy)}")
    return convert(numpy_obj, *args, **kwargs)


def _declaring(
    table: dict[tuple[type[Any], bool], Converter], msgtype: type[Any], plural: bool
) -> Callable[[_F], _F]:
    if not issubclass(msgtype, Message):
        raise TypeError(f"expected a message class, got {msgtype.__name__}")

    def declare(function: _F) -> _F:
        table[msgtype, plural] = function
        return function

    return declare


def _find(
    table: dict[tuple[type[Any], bool], Converter], msgtype: type[Any], *, plural: bool
) -> Converter | None:
    """Return the function of a class, or of its nearest base class that has one."""
    converters = (table.get((each, plural)) for each in msgtype.__mro__)
    return next((function for function in converters if function is not None), None)


def _names(table: dict[tuple[type[Any], bool], Converter]) -> str:
    return ", ".join(sorted(f"{each.__name__}{'[]' * plural}" for each, plural in table))


_HOMOGENEOUS = 4


@converts_to_numpy(Vector3)
def vector3_to_numpy(msg: Vector3, hom: bool = False) -> Any:
    """Return ``[x, y, z]``, and a 0 after it if ``hom``."""
    return np.array([msg.x, msg.y, msg.z, 0] if hom else [msg.x, msg.y, msg.z])


@converts_from_numpy(Vector3)
def numpy_to_vector3(arr: Any) -> Any:
    """Return the vector of ``[x, y, z]`` or ``[x, y, z, 0]``.

    Raises:
        AssertionError: The fourth number is not 0.
    """
    if arr.shape[-1] == _HOMOGENEOUS:
        if np.any(arr[..., -1]):
            raise AssertionError("expected 0 as the fourth number of a vector; a point has 1 there")
        arr = arr[..., :-1]
    return _each(lambda row: Vector3(*row.tolist()), arr, 1)


@converts_to_numpy(Point)
def point_to_numpy(msg: Point, hom: bool = False) -> Any:
    """Return ``[x, y, z]``, and a 1 after it if ``hom``."""
    return np.array([msg.x, msg.y, msg.z, 1] if hom else [msg.x, msg.y, msg.z])


@converts_from_numpy(Point)
def numpy_to_point(arr: Any) -> Any:
    """Return the point of ``[x, y, z]``, or of ``[x, y, z, w]`` divided by ``w``."""
    if arr.shape[-1] == _HOMOGENEOUS:
        arr = arr[..., :-1] / arr[..., -1:]
    return _each(lambda row: Point(*row.tolist()), arr, 1)


@converts_to_numpy(Quaternion)
def quat_to_numpy(msg: Quaternion) -> Any:
    """Return ``[x, y, z, w]``."""
    return np.array([msg.x, msg.y, msg.z, msg.w])


@converts_from_numpy(Quaternion)
def numpy_to_quat(arr: Any) -> Any:
    """Return the quaternion of ``[x, y, z, w]``.

    Raises:
        AssertionError: The array has another shape.
    """
    _check(arr, (4,))
    return _each(lambda row: Quaternion(*row.tolist()), arr, 1)


@converts_to_numpy(Transform)
def transform_to_numpy(msg: Transform) -> Any:
    """Return the 4x4 matrix of a transform."""
    return _matrix(msg.translation, msg.rotation)


@converts_from_numpy(Transform)
def numpy_to_transform(arr: Any) -> Any:
    """Return the transform of a 4x4 matrix; errors are those of `numpy_to_quat`."""
    _check(arr, (4, 4))
    return _each(lambda matrix: Transform(_translation(Vector3, matrix), _rotation(matrix)), arr, 2)


@converts_to_numpy(Pose)
def pose_to_numpy(msg: Pose) -> Any:
    """Return the 4x4 matrix of a pose."""
    return _matrix(msg.position, msg.orientation)


@converts_from_numpy(Pose)
def numpy_to_pose(arr: Any) -> Any:
    """Return the pose of a 4x4 matrix; errors are those of `numpy_to_quat`."""
    _check(arr, (4, 4))
    return _each(lambda matrix: Pose(_translation(Point, matrix), _rotation(matrix)), arr, 2)


def _matrix(position: Any, orientation: Any) -> Any:
    matrix = transformations.quaternion_matrix(quat_to_numpy(orientation))
    matrix[:3, 3] = position.x, position.y, position.z
    return matrix


def _translation(kind: Callable[..., Any], matrix: Any) -> Any:
    return kind(*matrix[:3, 3].tolist())


def _rotation(matrix: Any) -> Quaternion:
    return Quaternion(*map(float, transformations.quaternion_from_matrix(matrix)))


def _check(array: Any, shape: tuple[int, ...]) -> None:
    if array.shape[-len(shape) :] != shape:
        raise AssertionError(f"expected an array of shape {shape}, got {array.shape}")


def _each(make: Callable[[Any], Any], array: Any, dimensions: int) -> Any:
    """Return the message of an array; if that has more dimensions, an array of messages."""
    if array.ndim == dimensions:
        return make(array)
    made = np.empty(array.shape[:-dimensions], object)
    for at in np.ndindex(made.shape):
        made[at] = make(array[at])
    return made


_KINDS = {
    "8U": np.uint8,
    "8S": np.int8,
    "16U": np.uint16,
    "16S": np.int16,
    "32S": np.int32,
    "32F": np.float32,
    "64F": np.float64,
}
_CHANNELS = {"rgb": 3, "rgba": 4, "bgr": 3, "bgra": 4, "mono": 1}
_PATTERNS = ("rggb", "bggr", "gbrg", "grbg")

name_to_dtypes: dict[str, tuple[type[Any], int]] = {
    **{f"{name}8": (np.uint8, count) for name, count in _CHANNELS.items()},
    **{f"{name}16": (np.uint16, count) for name, count in _CHANNELS.items()},
    **{f"bayer_{pattern}8": (np.uint8, 1) for pattern in _PATTERNS},
    **{f"bayer_{pattern}16": (np.uint16, 1) for pattern in _PATTERNS},
    **{f"{name}C{count}": (kind, count) for name, kind in _KINDS.items() for count in range(1, 5)},
}
"""Type of the values and number of channels of each encoding."""


@converts_to_numpy(Image)
def image_to_numpy(msg: Image) -> Any:
    """Return a copy of the pixels; an image of one channel has two dimensions.

    Raises:
        TypeError: The encoding is unknown.
    """
    kind, channels = _kind(msg.encoding)
    dtype = np.dtype(kind).newbyteorder(">" if msg.is_bigendian else "<")
    pixel = channels * dtype.itemsize
    strides = (msg.step or msg.width * pixel, pixel, dtype.itemsize)
    data: Any = msg.data
    array = np.ndarray((msg.height, msg.width, channels), dtype, data, strides=strides).copy()
    return array[..., 0] if channels == 1 else array


@converts_from_numpy(Image)
def numpy_to_image(arr: Any, encoding: str) -> Image:
    """Return the message of an array of pixels.

    Raises:
        TypeError: The encoding is unknown, or the array does not match it.
    """
    kind, expected = _kind(encoding)
    if arr.ndim not in {2, 3}:
        raise TypeError(f"expected rows, columns and channels, got an array of shape {arr.shape}")
    height, width, channels = (*arr.shape, 1)[:3]
    if (channels, arr.dtype.type) != (expected, kind):
        raise TypeError(
            f"an image of encoding '{encoding}' has {expected} channels of {kind.__name__}, got"
            f" {channels} of {arr.dtype.name}"
        )
    order = arr.dtype.byteorder
    return Image(
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=int(order == ">" or (order == "=" and sys.byteorder == "big")),
        step=width * channels * arr.dtype.itemsize,
        data=arr.tobytes(),
    )


def _kind(encoding: str) -> tuple[type[Any], int]:
    if encoding not in name_to_dtypes:
        raise TypeError(f"unknown encoding '{encoding}'; expected {', '.join(name_to_dtypes)}")
    return name_to_dtypes[encoding]


_UNKNOWN = -1
_DIMENSIONS = 2


@converts_to_numpy(OccupancyGrid)
def occupancygrid_to_numpy(msg: OccupancyGrid) -> Any:
    """Return the cells, with those that are unknown (-1) masked."""
    cells = np.asarray(msg.data, np.int8).reshape(msg.info.height, msg.info.width)
    return np.ma.array(cells, mask=cells == _UNKNOWN, fill_value=_UNKNOWN)


@converts_from_numpy(OccupancyGrid)
def numpy_to_occupancy_grid(arr: Any, info: MapMetaData | None = None) -> OccupancyGrid:
    """Return the grid of an array of cells; masked ones keep the values below the mask.

    Args:
        arr: The cells.
        info: Resolution and origin; width and height are set.

    Raises:
        TypeError: The array has another type than int8, or is not of rows and columns.
    """
    if arr.ndim != _DIMENSIONS:
        raise TypeError(f"expected an array of rows and columns, got one of shape {arr.shape}")
    if arr.dtype != np.int8:
        raise TypeError(f"expected cells of int8, got {arr.dtype.name}")
    cells: Any = arr.data if isinstance(arr, np.ma.MaskedArray) else arr
    grid = OccupancyGrid(info=info or MapMetaData(), data=cells.ravel())
    grid.info.height, grid.info.width = cells.shape
    return grid


DUMMY_FIELD_PREFIX = "__"
"""Prefix of the names of bytes that belong to no field."""

type_mappings: list[tuple[int, np.dtype[Any]]] = [
    (number, np.dtype(kind)) for number, kind in FIELD_FORMATS.items()
]
pftype_to_nptype = dict(type_mappings)
nptype_to_pftype = {kind: number for number, kind in type_mappings}
pftype_sizes = {number: kind.itemsize for number, kind in type_mappings}

_COLORS = ("r", "g", "b")


@converts_to_numpy(PointField, plural=True)
def fields_to_dtype(fields: Sequence[PointField], point_step: int) -> list[Any]:
    """Return names and types of fields, in the order of the list, for ``numpy.dtype``.

    Each byte before, between and after the fields has a name of its own.
    """
    described: list[Any] = []
    end = 0

    def pad(until: int) -> int:
        described.extend((f"{DUMMY_FIELD_PREFIX}{at}", np.uint8) for at in range(end, until))
        return max(end, until)

    for field in fields:
        end = pad(field.offset)
        kind = pftype_to_nptype[field.datatype]
        described.append((field.name, _several(kind, field.count)))
        end += kind.itemsize * field.count
    end = pad(point_step)
    return described


@converts_from_numpy(PointField, plural=True)
def dtype_to_fields(dtype: Any) -> list[PointField]:
    """Return the fields of a type of records.

    Raises:
        TypeError: A PointField cannot have the type of a field.
    """
    fields = []
    for name in dtype.names:
        kind, offset = dtype.fields[name][:2]
        item, shape = kind.subdtype or (kind, ())
        if item not in nptype_to_pftype:
            expected = ", ".join(nptype.name for nptype in nptype_to_pftype)
            raise TypeError(f"field '{name}' has type {item}; a PointField may have {expected}")
        fields.append(PointField(name, offset, nptype_to_pftype[item], int(np.prod(shape))))
    return fields


@converts_to_numpy(PointCloud2)
def pointcloud2_to_array(cloud_msg: PointCloud2, squeeze: bool = True) -> Any:
    """Return the points of a cloud without copying them; the array is read-only.

    Args:
        cloud_msg: The cloud.
        squeeze: Whether a cloud of one row becomes an array of one dimension.
    """
    order: Literal[">", "<"] = ">" if cloud_msg.is_bigendian else "<"
    kinds = [
        _several(pftype_to_nptype[field.datatype].newbyteorder(order), field.count)
        for field in cloud_msg.fields
    ]
    point = np.dtype(
        {
            "names": [field.name for field in cloud_msg.fields],
            "formats": kinds,
            "offsets": [field.offset for field in cloud_msg.fields],
            "itemsize": cloud_msg.point_step,
        }
    )
    height, width = cloud_msg.height, cloud_msg.width
    data: Any = cloud_msg.data
    if squeeze and height == 1:
        return np.ndarray((width,), point, data)
    row = cloud_msg.row_step or width * cloud_msg.point_step
    return np.ndarray((height, width), point, data, strides=(row, cloud_msg.point_step))


@converts_from_numpy(PointCloud2)
def array_to_pointcloud2(cloud_arr: Any, stamp: Any = None, frame_id: str | None = None) -> Any:
    """Return the cloud of an array of records; errors are those of `dtype_to_fields`.

    Args:
        cloud_arr: The points, in one or two dimensions.
        stamp: Time of the header.
        frame_id: Frame of the header.
    """
    points = np.atleast_2d(cloud_arr)
    cloud = PointCloud2(
        height=points.shape[0],
        width=points.shape[1],
        fields=dtype_to_fields(points.dtype),
        point_step=points.dtype.itemsize,
        row_step=points.dtype.itemsize * points.shape[1],
        is_dense=all(bool(np.isfinite(points[name]).all()) for name in points.dtype.names or ()),
        data=points.tobytes(),
    )
    if stamp is not None:
        cloud.header.stamp = stamp
    if frame_id is not None:
        cloud.header.frame_id = frame_id
    return cloud


def merge_rgb_fields(cloud_arr: Any) -> Any:
    """Return points whose fields r, g and b are one field ``rgb`` of float32, as PCL has it."""
    r, g, b = (np.asarray(cloud_arr[name], np.uint32) for name in _COLORS)
    packed = np.asarray((r << 16) | (g << 8) | b, np.uint32)
    return _replaced(cloud_arr, _COLORS, {"rgb": packed.view(np.float32)})


def split_rgb_field(cloud_arr: Any) -> Any:
    """Return points whose field ``rgb`` of float32 is the fields r, g and b of uint8."""
    packed = np.ascontiguousarray(cloud_arr["rgb"]).view(np.uint32)
    shifts = zip(_COLORS, (16, 8, 0), strict=True)
    colors = {name: ((packed >> shift) & 255).astype(np.uint8) for name, shift in shifts}
    return _replaced(cloud_arr, ("rgb",), colors)


def get_xyz_points(cloud_array: Any, remove_nans: bool = True, dtype: Any = float) -> Any:
    """Return the coordinates x, y and z along the last axis.

    Args:
        cloud_array: The points.
        remove_nans: Whether to leave out points with a NaN or an infinite coordinate.
        dtype: Type of the coordinates.
    """
    if remove_nans:
        cloud_array = cloud_array[
            np.logical_and.reduce([np.isfinite(cloud_array[axis]) for axis in "xyz"])
        ]
    points = np.empty((*cloud_array.shape, 3), dtype)
    for at, axis in enumerate("xyz"):
        points[..., at] = cloud_array[axis]
    return points


def pointcloud2_to_xyz_array(cloud_msg: PointCloud2, remove_nans: bool = True) -> Any:
    """Return the coordinates of the points of a cloud; see `get_xyz_points`."""
    return get_xyz_points(pointcloud2_to_array(cloud_msg), remove_nans=remove_nans)


def _several(kind: Any, count: int) -> Any:
    return kind if count == 1 else np.dtype((kind, (count,)))


def _replaced(points: Any, names: Sequence[str], columns: dict[str, Any]) -> Any:
    """Return points without some fields, and with other ones after the rest."""
    kept = [name for name in points.dtype.names if name not in names]
    kinds = [(name, points.dtype.fields[name][0]) for name in kept]
    kinds += [(name, column.dtype) for name, column in columns.items()]
    made = np.zeros(points.shape, np.dtype(kinds))
    for name in kept:
        made[name] = points[name]
    for name, column in columns.items():
        made[name] = column
    return made
