"""sensor_msgs_py: clouds as arrays, and back."""

from __future__ import annotations

import pytest

from rosz.errors import UsageError
from rosz.msgs.sensor_msgs.msg import PointCloud2, PointField
from rosz.msgs.std_msgs.msg import Header

np = pytest.importorskip("numpy")
point_cloud2 = pytest.importorskip("rosz.ros2.sensor_msgs_py.point_cloud2")

FIELDS = [
    PointField(name="x", offset=0, datatype=PointField.FLOAT32, count=1),
    PointField(name="id", offset=8, datatype=PointField.UINT16, count=2),
]


def test_points_of_several_types_and_counts() -> None:
    cloud = point_cloud2.create_cloud(Header(frame_id="map"), FIELDS, [(1.5, 2, 3), (4, 5, 6)], 16)
    assert (cloud.point_step, cloud.row_step, cloud.width, cloud.height) == (16, 32, 2, 1)
    assert cloud.header.frame_id == "map"
    points = point_cloud2.read_points(cloud)
    assert points.dtype.names == ("x", "id_0", "id_1")
    assert points.tolist() == [(1.5, 2, 3), (4.0, 5, 6)]
    assert point_cloud2.read_points(cloud, ["id_1"], uvs=[1]).tolist() == [(6,)]
    assert point_cloud2.read_points_list(cloud)[0].id_1 == 3
    assert point_cloud2.read_points_numpy(cloud, ["id_0", "id_1"]).tolist() == [[2, 3], [5, 6]]
    with pytest.raises(UsageError, match="the fields have several types"):
        point_cloud2.read_points_numpy(cloud)


def test_rows_and_nans() -> None:
    given = np.arange(12, dtype=np.float32).reshape(2, 2, 3)
    given[1, 1, 2] = np.nan
    cloud = point_cloud2.create_cloud_xyz32(Header(), given)
    assert (cloud.height, cloud.width) == (2, 2)
    assert point_cloud2.read_points(cloud, reshape_organized_cloud=True).shape == (2, 2)
    assert point_cloud2.read_points(cloud, skip_nans=True).shape == (3,)
    back = point_cloud2.read_points_numpy(cloud, reshape_organized_cloud=True)
    assert np.array_equal(back, given, equal_nan=True)
    cloud.row_step += 4
    cloud.data = cloud.data[:24] + bytes(4) + cloud.data[24:]
    assert point_cloud2.read_points(cloud)["x"].tolist() == [0, 3, 6, 9]
    structured = point_cloud2.create_cloud(Header(), cloud.fields, point_cloud2.read_points(cloud))
    assert point_cloud2.read_points(structured)["y"].tolist() == [1, 4, 7, 10]


def test_the_other_order_of_bytes() -> None:
    field = PointField(name="x", offset=0, datatype=PointField.FLOAT64, count=1)
    data = np.array([1.0, 2.0], ">f8").tobytes()
    cloud = PointCloud2(
        height=1, width=2, fields=[field], is_bigendian=True, point_step=8, row_step=16, data=data
    )
    assert point_cloud2.read_points(cloud)["x"].tolist() == [1.0, 2.0]


def test_no_points() -> None:
    cloud = point_cloud2.create_cloud_xyz32(Header(), [])
    assert (cloud.width, cloud.data) == (0, b"")
    assert point_cloud2.read_points_list(cloud) == []


def test_wrong_clouds() -> None:
    cloud = point_cloud2.create_cloud_xyz32(Header(), [(1, 2, 3)])
    with pytest.raises(UsageError, match="no field 'w', only x, y, z"):
        point_cloud2.read_points(cloud, ["w"])
    cloud.data = cloud.data[:-1]
    with pytest.raises(UsageError, match="has 11 bytes; expected 12"):
        point_cloud2.read_points(cloud)
    with pytest.raises(UsageError, match="expected a PointCloud2, got Header"):
        point_cloud2.read_points(Header())
    with pytest.raises(UsageError, match="a point has 2 values; the fields have 3"):
        point_cloud2.create_cloud_xyz32(Header(), [(1, 2)])
