"""Transformed point clouds: Debian's results, with numpy and without."""

from __future__ import annotations

import random
import struct
import sys
from typing import Any

import pytest
from oracle import ours, real

from rosz.errors import UsageError
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.sensor_msgs.msg import PointCloud2
from rosz.msgs.sensor_msgs.msg import PointField as F
from rosz.msgs.std_msgs.msg import Header
from rosz.ros1.client.tf2_sensor_msgs import do_transform_cloud
from rosz.transforms import pose_of, transform_cloud

XYZ = [F("x", 0, F.FLOAT32, 1), F("y", 4, F.FLOAT32, 1), F("z", 8, F.FLOAT32, 1)]
EXTRA = [*XYZ, F("normal_x", 16, F.FLOAT32, 3), F("ring", 28, F.UINT16, 1)]
LAYOUT = "3f4x3fH10x"
MOVE = TransformStamped(
    Header(frame_id="map"),
    "laser",
    Transform(Vector3(1.5, -0.3, 0.1), Quaternion(0.1, 0.2, 0.3, 0.9273618495495703)),
)
POSE = pose_of(MOVE.transform)


def make_cloud(*, big: bool = False, fields: list[F] = EXTRA) -> PointCloud2:
    """Return a cloud of three rows, with padding after points and rows, a NaN and an infinity."""
    numbers = random.Random(7)
    layout = (">" if big else "<") + LAYOUT
    rows = []
    for row in range(3):
        points = [[numbers.gauss(0, 50) for _ in range(6)] for _ in range(4)]
        points[row][row] = float("nan")
        points[3][row] = float("inf")
        rows.append(b"".join(struct.pack(layout, *point, row) for point in points) + b"end!")
    size = struct.calcsize(layout)
    return PointCloud2(
        Header(frame_id="laser"), 3, 4, fields, big, size, 4 * size + 4, b"".join(rows), False
    )


def without_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", None)  # so that importing it fails


@pytest.mark.parametrize("big", [False, True])
def test_same_with_numpy_and_without(monkeypatch: pytest.MonkeyPatch, big: bool) -> None:
    cloud = make_cloud(big=big)
    fast = transform_cloud(cloud, POSE, MOVE.header), do_transform_cloud(cloud, MOVE)
    without_numpy(monkeypatch)
    slow = transform_cloud(cloud, POSE, MOVE.header), do_transform_cloud(cloud, MOVE)
    assert fast == slow


def test_the_layout_stays() -> None:
    cloud = make_cloud(big=True)
    moved = transform_cloud(cloud, POSE, MOVE.header)
    assert (moved.height, moved.width, moved.point_step, moved.row_step) == (3, 4, 40, 164)
    assert moved.is_bigendian
    assert moved.header.frame_id == "map"
    for before, after in zip(_points(cloud), _points(moved), strict=True):
        assert before[:12] != after[:12]
        assert before[12:] == after[12:]  # normals are not rotated
    assert moved.data[160:164] == b"end!"


def _points(cloud: PointCloud2) -> list[bytes]:
    data = bytes(cloud.data)
    starts = (row * 164 + column * 40 for row in range(3) for column in range(4))
    return [data[start : start + 40] for start in starts]


def test_empty_clouds(monkeypatch: pytest.MonkeyPatch) -> None:
    cloud = PointCloud2(Header(), 1, 0, XYZ, False, 12, 0, b"", True)
    assert transform_cloud(cloud, POSE, MOVE.header).data == b""
    assert do_transform_cloud(cloud, MOVE).width == 0
    without_numpy(monkeypatch)
    assert transform_cloud(cloud, POSE, MOVE.header).data == b""


@pytest.mark.parametrize("numpy", [True, False])
@pytest.mark.parametrize(
    ("fields", "text"),
    [
        (XYZ[:2], "no coordinate 'z': expected one float, got none"),
        ([*XYZ[:2], F("z", 8, F.INT32, 1)], "got datatype 5, count 1"),
        ([*XYZ[:2], F("z", 38, F.FLOAT32, 1)], "'z' ends after point_step 40"),
    ],
)
def test_clouds_without_coordinates(
    monkeypatch: pytest.MonkeyPatch, numpy: bool, fields: list[F], text: str
) -> None:
    if not numpy:
        without_numpy(monkeypatch)
    with pytest.raises(UsageError, match=text):
        transform_cloud(make_cloud(fields=fields), POSE, MOVE.header)


@pytest.mark.parametrize("numpy", [True, False])
def test_damaged_clouds(monkeypatch: pytest.MonkeyPatch, numpy: bool) -> None:
    if not numpy:
        without_numpy(monkeypatch)
    cloud = make_cloud()
    cloud.data = bytes(cloud.data)[:400]
    with pytest.raises(UsageError, match="400 bytes of data; expected 488"):
        transform_cloud(cloud, POSE, MOVE.header)
    far = PointCloud2(Header(), 1, 1, XYZ, False, 12, 12, struct.pack("<3f", 3e38, 3e38, 3e38))
    with pytest.raises(OverflowError, match="too large"):
        transform_cloud(far, POSE, MOVE.header)


_SNIPPET = """
import struct
import tf2_sensor_msgs.tf2_sensor_msgs as clouds
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
move = TransformStamped()
move.header.frame_id = "map"
t, q = move.transform.translation, move.transform.rotation
t.x, t.y, t.z, q.x, q.y, q.z, q.w = 1.5, -0.25, 0.125, 0.5, 0.5, 0.5, 0.5
def field(name, offset, kind, count=1):
    return PointField(name, offset, kind, count)
xyz = [field("x", 0, 7), field("y", 4, 7), field("z", 8, 7)]
extra = [field("normal_x", 16, 7, 3), field("ring", 28, 4)]
doubles = [field("a", 0, 8), field("b", 8, 8), field("c", 16, 8)]
whole = [field("i", 0, 5), field("j", 4, 5), field("k", 8, 5)]
def made(fields, layout, big, values):
    layout = (">" if big else "<") + layout
    data = b"".join(struct.pack(layout, *v) + (b"..." if n % 2 else b"") for n, v in values)
    size = struct.calcsize(layout)
    count = len(values) // 2
    return PointCloud2(Header(), count, 2, fields, big, size, 2 * size + 3, data, True)
nan = float("nan")
values = [(1.0, 2.0, 3.0, 0.5, 0.25, 0.125, 7), (nan, 0.0, -1.0, 1.0, nan, 0.0, 65535),
    (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1), (-8.5, 64.25, 1e6, 0.0, 0.0, 0.0, 0)]
at = lambda width: list(enumerate([v[:width] for v in values]))
def shown(cloud):
    moved = clouds.do_transform_cloud(cloud, move)
    data = [repr(v) for v in struct.iter_unpack("<f", bytes(moved.data)) ] \\
        if len(moved.data) % 4 == 0 else list(bytes(moved.data))
    return [moved.height, moved.width, moved.point_step, moved.row_step, bool(moved.is_dense),
        bool(moved.is_bigendian), moved.header.frame_id, [f.name for f in moved.fields], data]
result = [shown(made(xyz + extra, "3f4x3fH10x", big, at(7))) for big in (False, True)]
result += [shown(made(doubles, "3d", False, at(3))), shown(made(xyz[:], "3f", False, at(3)))]
try:
    result.append(shown(made(whole, "3i", False, [(n, (1, 2, 3)) for n in range(2)])))
except Exception as error:
    result.append(type(error).__name__)
"""


@pytest.mark.ros1
def test_same_as_the_real_one(monkeypatch: pytest.MonkeyPatch) -> None:
    expected: Any = real(_SNIPPET, "tf2_sensor_msgs", "python3-tf2-sensor-msgs")
    assert ours(_SNIPPET) == expected
    without_numpy(monkeypatch)
    assert ours(_SNIPPET) == expected
