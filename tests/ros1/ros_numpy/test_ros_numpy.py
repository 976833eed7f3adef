"""ros_numpy, beside sensor_msgs.point_cloud2 and tf where these say the same."""

from __future__ import annotations

from typing import Any

import pytest

np = pytest.importorskip("numpy")

from rosz.msgs.geometry_msgs.msg import (  # noqa: E402
    Point,
    Pose,
    Quaternion,
    Transform,
    Vector3,
    Wrench,
)
from rosz.msgs.nav_msgs.msg import MapMetaData, OccupancyGrid  # noqa: E402
from rosz.msgs.sensor_msgs.msg import Image, PointCloud2, PointField  # noqa: E402
from rosz.ros1.client import point_cloud2  # noqa: E402
from rosz.ros1.client.rospy.numpy_msg import numpy_msg  # noqa: E402
from rosz.ros1.client.tf import transformations  # noqa: E402
from rosz.ros1.libraries import ros_numpy  # noqa: E402

RECORDS = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<f4"), ("v", "<u2", (3,))]


def records(count: int) -> Any:
    points = np.zeros(count, RECORDS)
    for at, name in enumerate("xyz"):
        points[name] = np.arange(count) + 10 * at
    points["rgb"] = (np.arange(count, dtype=np.uint32) * 0x010203).view(np.float32)
    points["v"] = np.arange(3 * count).reshape(count, 3)
    return points


@pytest.mark.parametrize("made", [Point(1.0, 2.0, 3.0), Vector3(1.0, 2.0, 3.0)])
def test_points_and_vectors(made: Point | Vector3) -> None:
    plain, homogeneous = ros_numpy.numpify(made), ros_numpy.numpify(made, hom=True)
    assert plain.tolist() == [1, 2, 3]
    assert homogeneous.tolist() == [1, 2, 3, int(isinstance(made, Point))]
    assert ros_numpy.msgify(type(made), plain) == made
    assert ros_numpy.msgify(type(made), homogeneous) == made
    several = ros_numpy.msgify(type(made), np.stack([plain, plain * 2]))
    assert several[0] == made
    assert several[1].y == 4


def test_points_are_divided_and_vectors_are_not() -> None:
    twice = np.array([[2.0, 4.0, 6.0, 2.0], [1.0, 1.0, 1.0, 4.0]])
    assert list(ros_numpy.msgify(Point, twice)) == [Point(1.0, 2.0, 3.0), Point(0.25, 0.25, 0.25)]
    with pytest.raises(AssertionError, match="fourth number"):
        ros_numpy.msgify(Vector3, np.array([0, 0, 0, 1]))


@pytest.mark.parametrize("kind", [Pose, Transform])
def test_poses_are_matrices(kind: type[Any]) -> None:
    turn = transformations.quaternion_from_euler(0.1, 0.2, 0.3)
    position = (Point if kind is Pose else Vector3)(1.0, 2.0, 3.0)
    made = kind(position, Quaternion(*turn))
    matrix = ros_numpy.numpify(made)
    expected = transformations.quaternion_matrix(turn)
    expected[:3, 3] = 1, 2, 3
    np.testing.assert_allclose(matrix, expected)
    both = ros_numpy.msgify(kind, np.stack([matrix, np.eye(4)]))
    np.testing.assert_allclose(ros_numpy.numpify(both[0]), matrix)
    assert ros_numpy.numpify(both[1]).tolist() == np.eye(4).tolist()
    with pytest.raises(AssertionError, match="shape"):
        ros_numpy.msgify(kind, np.eye(3))


@pytest.mark.parametrize("encoding", sorted(ros_numpy.name_to_dtypes))
@pytest.mark.parametrize("order", "<>")
def test_images(encoding: str, order: str) -> None:
    kind, channels = ros_numpy.name_to_dtypes[encoding]
    shape = (3, 4) if channels == 1 else (3, 4, channels)
    pixels = np.arange(12 * channels).reshape(shape).astype(np.dtype(kind).newbyteorder(order))
    message = ros_numpy.msgify(Image, pixels, encoding=encoding)
    assert message.step == 4 * channels * pixels.dtype.itemsize
    assert bool(message.is_bigendian) == (order == ">" and pixels.dtype.itemsize > 1)
    found = ros_numpy.numpify(message)
    np.testing.assert_equal(found, pixels)
    found[...] = 0  # a copy


def test_images_that_do_not_fit() -> None:
    padded = Image(height=2, width=1, encoding="rgb8", step=4, data=bytes(range(8)))
    assert ros_numpy.numpify(padded).tolist() == [[[0, 1, 2]], [[4, 5, 6]]]
    for shape, kind in (((2, 2), np.uint8), ((2, 2, 3), np.float32), ((2,), np.uint8)):
        with pytest.raises(TypeError):
            ros_numpy.msgify(Image, np.zeros(shape, kind), encoding="rgb8")
    with pytest.raises(TypeError, match="'yuv'"):
        ros_numpy.numpify(Image(encoding="yuv"))


def test_grids() -> None:
    cells = np.array([[0, -1, 50], [100, 0, 0]], np.int8)
    message = ros_numpy.msgify(OccupancyGrid, cells, info=MapMetaData(resolution=0.5))
    assert (message.info.width, message.info.height, message.info.resolution) == (3, 2, 0.5)
    found = ros_numpy.numpify(OccupancyGrid._decode(OccupancyGrid._encode(message)))
    assert found[0, 1] is np.ma.masked
    assert found.data.tolist() == cells.tolist()
    assert list(ros_numpy.msgify(OccupancyGrid, found).data) == cells.ravel().tolist()
    for wrong in (cells.astype(int), cells.ravel()):
        with pytest.raises(TypeError):
            ros_numpy.msgify(OccupancyGrid, wrong)


def test_clouds() -> None:
    points = records(5)
    cloud = ros_numpy.msgify(PointCloud2, points, frame_id="map")
    flat = [(x, y, z, rgb, *v) for x, y, z, rgb, v in points.tolist()]
    assert list(point_cloud2.read_points(cloud)) == flat
    assert (cloud.header.frame_id, cloud.height, cloud.width, cloud.is_dense) == ("map", 1, 5, True)
    np.testing.assert_equal(ros_numpy.numpify(cloud), points)
    assert ros_numpy.numpify(cloud, squeeze=False).shape == (1, 5)
    assert ros_numpy.pointcloud2_to_xyz_array(cloud).tolist() == [
        [at, at + 10, at + 20] for at in range(5)
    ]
    made = ros_numpy.msgify(numpy_msg(PointCloud2), points)
    np.testing.assert_equal(
        ros_numpy.numpify(numpy_msg(PointCloud2)._decode(PointCloud2._encode(made))), points
    )
    assert ros_numpy.numpify(point_cloud2.create_cloud_xyz32(None, [])).shape == (0,)


@pytest.mark.parametrize("big", [False, True])
def test_clouds_of_other_programs(big: bool) -> None:
    fields = [PointField("z", 8, PointField.FLOAT32, 1), PointField("i", 2, PointField.UINT16, 2)]
    kind = {"names": ["z", "i"], "formats": ["f4", ("u2", 2)], "offsets": [8, 2], "itemsize": 16}
    points = np.zeros((2, 3), np.dtype(kind).newbyteorder("><"[not big]))
    points["z"], points["i"] = np.arange(6).reshape(2, 3), np.arange(12).reshape(2, 3, 2)
    data = b"".join(row.tobytes() + b"end!" for row in points)
    cloud = PointCloud2(
        height=2, width=3, fields=fields, is_bigendian=big, point_step=16, row_step=52, data=data
    )
    np.testing.assert_equal(ros_numpy.numpify(cloud)["z"], points["z"])
    np.testing.assert_equal(ros_numpy.numpify(cloud)["i"], points["i"])
    assert ros_numpy.numpify(fields, point_step=16)[:3] == [
        *[(f"__{at}", np.uint8) for at in range(3)]
    ]


def test_fields_and_types() -> None:
    kind = np.dtype([("x", "<f4"), ("n", "i1", (2, 2))])
    fields = ros_numpy.msgify(PointField, kind, plural=True)
    assert fields == [
        PointField("x", 0, PointField.FLOAT32, 1),
        PointField("n", 4, PointField.INT8, 4),
    ]
    described = ros_numpy.numpify(fields, point_step=10)
    assert np.dtype(described).names == ("x", "n", "__8", "__9")
    with pytest.raises(TypeError, match="int64"):
        ros_numpy.msgify(PointField, np.dtype([("a", "i8")]), plural=True)


def test_colors() -> None:
    split = ros_numpy.split_rgb_field(records(4))
    assert split.dtype.names == ("x", "y", "z", "v", "r", "g", "b")
    assert [split[name].tolist() for name in "rgb"] == [[0, 1, 2, 3], [0, 2, 4, 6], [0, 3, 6, 9]]
    merged = ros_numpy.merge_rgb_fields(split)
    assert merged.dtype.names == ("x", "y", "z", "v", "rgb")
    np.testing.assert_equal(merged["rgb"].view(np.uint32), np.arange(4, dtype=np.uint32) * 0x010203)


def test_nans_are_left_out() -> None:
    points = records(3)
    points["y"][1] = np.nan
    assert len(ros_numpy.get_xyz_points(points)) == 2
    assert ros_numpy.get_xyz_points(points, remove_nans=False).shape == (3, 3)
    assert not ros_numpy.msgify(PointCloud2, points).is_dense


def test_own_types_are_declared() -> None:
    @ros_numpy.converts_to_numpy(Wrench)
    def of_wrench(message: Wrench, factor: int) -> float:
        return message.force.x * factor

    try:
        assert ros_numpy.numpify(Wrench(force=Vector3(2.0, 0.0, 0.0)), 3) == 6
    finally:
        del ros_numpy._to_numpy[Wrench, False]
    assert ros_numpy.numpify(None) is None
    for wrong in (Wrench(), list[Any](), "text"):
        with pytest.raises(ValueError, match="expected"):
            ros_numpy.numpify(wrong)
    with pytest.raises(ValueError, match="no Wrench of an array"):
        ros_numpy.msgify(Wrench, np.zeros(3))
    with pytest.raises(TypeError, match="message class"):
        ros_numpy.converts_to_numpy(int)
