"""sensor_msgs.point_cloud2 beside ROS 1's."""

from __future__ import annotations

import importlib.util
import struct
from typing import Any

import oracle
import pytest

from rosz.msgs.sensor_msgs.msg import PointField
from rosz.ros1.client import point_cloud2
from rosz.ros1.importer import install, uninstall

SNIPPET = """
import math, struct, sys
import sensor_msgs.point_cloud2 as pc2
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
F = PointField
nan, inf = float("nan"), float("inf")
one_of_each = [("a", 0, F.INT8, 1), ("b", 1, F.UINT8, 1), ("c", 2, F.INT16, 1),
    ("d", 4, F.UINT16, 1), ("e", 8, F.INT32, 1), ("f", 12, F.UINT32, 1),
    ("g", 16, F.FLOAT32, 1), ("h", 24, F.FLOAT64, 2)]
xyz = [("x", 0, F.FLOAT32, 1), ("y", 4, F.FLOAT32, 1), ("z", 8, F.FLOAT32, 1)]
unordered = [("z", 8, F.FLOAT32, 1), ("x", 0, F.FLOAT32, 1), ("odd", 13, F.UINT8, 1)]
values = (-5, 200, -3000, 60000, -70000, 4000000000, 1.5, 2.25, -1e300)
points = [(1, 2, 3), (nan, 0, 1), (inf, -inf, 2), (0.1, nan, nan), (5, 6, 7), (8, 9, 10)]
made = lambda fields: [PointField(*one) for one in fields]
words = lambda items: [[repr(v) for v in item] for item in items]
def shown(cloud):
    return [cloud.height, cloud.width, cloud.point_step, cloud.row_step,
        bool(cloud.is_bigendian), bool(cloud.is_dense),
        list(cloud.data), [f.name for f in cloud.fields], cloud.header.frame_id]
def grid(big, fields=xyz, step=16, row=56):
    layout = (">" if big else "<") + "3f4x"
    data = b"".join(
        struct.pack(layout, *point) + (b"padding!" if at % 3 == 2 else b"")
        for at, point in enumerate(points))
    return PointCloud2(Header(frame_id="map"), 2, 3, made(fields), big, step, row, data, False)
def read(cloud, *args, **options):
    return tried(lambda: words(pc2.read_points(cloud, *args, **options)))
line = pc2.create_cloud_xyz32(Header(frame_id="map"), points)
mixed = pc2.create_cloud(Header(), made(one_of_each), [values, values])
short = pc2.create_cloud_xyz32(Header(), points)
short.data = bytes(short.data)[:-5]
overlapping = pc2.create_cloud_xyz32(Header(), points)
overlapping.point_step = 4
result = [
    shown(line), shown(mixed), read(line), read(mixed), read(mixed, ["h", "b"]),
    [read(grid(big), names, skip, where)
        for big in (False, True) for names in (None, ["z", "x"], ["y"], [], ["none"])
        for skip in (False, True) for where in ([], [(0, 0), (2, 1), (0, 1)])],
    read(grid(False, unordered)), read(grid(False, unordered), ["odd", "z"], True),
    words(pc2.read_points_list(grid(False), skip_nans=True)),
    [repr(p) for p in pc2.read_points_list(line, ("x", "y"), uvs=[(4, 0)])],
    read(short), read(short, uvs=[(0, 0)]), read(short, uvs=[(5, 0)]), read(3),
    read(overlapping), read(PointCloud2()), tried(pc2.create_cloud, Header(), made(xyz), [(1, 2)]),
    tried(pc2.create_cloud, Header(), made(one_of_each), [(1.5,) * 9]),
    shown(pc2.create_cloud(Header(), made(unordered), [(1, 2, 3)])),
    shown(pc2.create_cloud_xyz32(Header(), [])), read(pc2.create_cloud_xyz32(Header(), [])),
    struct.calcsize(pc2._get_struct_fmt(True, made(one_of_each), {"c", "h"})),
    hasattr(pc2.read_points(line), "send"), sorted(pc2._DATATYPES.values()),
]
"""


@pytest.mark.ros1
def test_points_are_those_of_ros_1() -> None:
    oracle.same(SNIPPET, "sensor_msgs.point_cloud2", "python3-sensor-msgs")


@pytest.mark.parametrize("kind", ["<f4", ">f4", "<f8", "<i4", "<u2"])
def test_arrays_make_the_clouds_of_their_lists(kind: str) -> None:
    np = pytest.importorskip("numpy")
    points = np.arange(12).reshape(4, 3)[:, ::-1].astype(kind)
    for number in PointField.FLOAT32, PointField.FLOAT64:
        fields = [PointField(name, 8 * at, number, 1) for at, name in enumerate("xyz")]
        cloud = point_cloud2.create_cloud(None, fields, points)
        assert cloud == point_cloud2.create_cloud(None, fields, points.tolist())
        assert list(point_cloud2.read_points(cloud)) == [tuple(row) for row in points.tolist()]
    cloud = point_cloud2.create_cloud_xyz32(None, points)
    assert cloud == point_cloud2.create_cloud_xyz32(None, points.tolist())


def test_arrays_that_do_not_fit_are_refused() -> None:
    np = pytest.importorskip("numpy")
    with pytest.raises(struct.error):
        point_cloud2.create_cloud_xyz32(None, np.zeros((2, 4)))
    with pytest.raises(OverflowError):
        point_cloud2.create_cloud_xyz32(None, np.full((2, 3), 1e300))


def test_a_field_of_unknown_type_is_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    cloud = point_cloud2.create_cloud_xyz32(None, [(1, 2, 3)])
    cloud.fields[1].datatype = 77
    assert list(point_cloud2.read_points(cloud)) == [(1, 3)]
    assert capsys.readouterr().err == "field 'y' has no known datatype: 77\n"


def test_both_ways_to_import_it() -> None:
    install()
    try:
        assert importlib.util.find_spec("sensor_msgs.point_cloud2") is not None
        space: dict[str, Any] = {}
        exec("import sensor_msgs.point_cloud2\nfrom sensor_msgs import point_cloud2", space)
        assert space["point_cloud2"] is space["sensor_msgs"].point_cloud2 is point_cloud2
    finally:
        uninstall()
