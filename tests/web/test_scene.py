"""What the view in space draws, without a browser."""

from __future__ import annotations

import json
import math
import struct
from typing import Any

import numpy as np
import pytest
from network import Network, eventually

from rosz.access import PagePolicy
from rosz.environment import Environment
from rosz.errors import UsageError
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import (
    Point,
    PointStamped,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from rosz.msgs.geometry_msgs.msg import Pose as PoseMessage
from rosz.msgs.map_msgs.msg import OccupancyGridUpdate
from rosz.msgs.nav_msgs.msg import MapMetaData, OccupancyGrid, Path
from rosz.msgs.sensor_msgs.msg import LaserScan, PointCloud2, PointField
from rosz.msgs.std_msgs.msg import Header
from rosz.transforms import IDENTITY, Pose, StaticTransformBroadcaster, TransformBroadcaster
from rosz.web.model import Frames, System
from rosz.web.scene import (
    TOOLS,
    Look,
    Meshes,
    SceneSetup,
    Tools,
    format_setup,
    open_display,
    read_setup,
)
from rosz.web.scene.display import SceneSources, TopicDisplay
from rosz.web.scene.drawing import Drawing
from rosz.web.scene.maps import draw_map, read_cells
from rosz.web.scene.poses import draw_path, draw_poses
from rosz.web.scene.sensors import draw_cloud, draw_scan
from rosz.web.scene.still import StillDisplay

ASIDE = Pose((10.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
"""Ten metres along x, and turned back."""


def parts(drawing: Drawing | bytes) -> list[dict[str, Any]]:
    """Return the parts of a drawing, with their numbers."""
    data = drawing if isinstance(drawing, bytes) else drawing.encode()
    (length,) = struct.unpack_from("<I", data)
    found: list[dict[str, Any]] = json.loads(data[4 : 4 + length])
    at = 4 + length

    def take(kind: str, count: int) -> Any:
        nonlocal at
        taken = np.frombuffer(data, kind, count, at)
        at += -(-taken.nbytes // 4) * 4
        return taken

    for one in found:
        if one["kind"] in {"points", "lines", "triangles"}:
            one["positions"] = take("<f4", 3 * one["count"]).reshape(-1, 3)
            one["colors"] = take("u1", 4 * one["count"]).reshape(-1, 4)
        elif one["kind"] == "shapes":
            one["matrices"] = take("<f4", 16 * one["count"]).reshape(-1, 4, 4).transpose(0, 2, 1)
            one["colors"] = take("u1", 4 * one["count"]).reshape(-1, 4)
        elif one["kind"] == "image":
            one["palette"] = take("u1", 1024).reshape(-1, 4)
            one["cells"] = take("u1", one["width"] * one["height"])
    assert at == len(data)
    return found


def cloud_of(rows: Any, names: str = "xyz", **changes: Any) -> PointCloud2:
    fields = [PointField(name, 4 * at, PointField.FLOAT32, 1) for at, name in enumerate(names)]
    data = np.asarray(rows, dtype="<f4")
    values = {"width": len(data), "point_step": 4 * len(names), "height": 1}
    values["row_step"] = values["width"] * values["point_step"]
    return PointCloud2(fields=fields, data=data.tobytes(), **{**values, **changes})


def test_an_address_holds_the_setup() -> None:
    setup = SceneSetup("map", (Look("tf"), Look("/scan", "#ff0000", 4, visible=False)), "top")
    address = format_setup(setup)
    assert address == "/3d?frame=map&show=tf,/scan;color=%23ff0000;size=4;hidden&view=top"
    assert read_setup("map", "tf,/scan;color=#ff0000;size=4;hidden", "top") == setup
    assert [one.name for one in read_setup("", "", "").looks] == ["grid", "tf"]
    axes = SceneSetup("map", (Look("axes", frame="a/b", radius=0.5), Look("grid", cells=20)))
    assert format_setup(axes) == "/3d?frame=map&show=axes;frame=a/b;radius=0.5,grid;cells=20"
    assert read_setup("map", "axes;frame=/a/b;radius=0.5,grid;cells=20", "") == axes
    assert read_setup("", "/a;size=much", "elsewhere") == SceneSetup("", (Look("/a"),), "orbit")
    assert read_setup("", "/a;size=nan", "").looks == (Look("/a"),)


def test_a_scan_is_points_in_the_fixed_frame() -> None:
    scan = LaserScan(
        angle_min=0.0,
        angle_increment=math.pi / 2,
        range_min=0.5,
        range_max=5.0,
        ranges=[1.0, 2.0, math.inf, 0.1],
    )
    drawing = Drawing()
    assert draw_scan(scan, ASIDE, Look("/scan", "#ff0000", 5), drawing) == "2 of 4 points"
    (points,) = parts(drawing)
    assert points["size"] == 5
    assert points["pixels"]
    assert np.allclose(points["positions"], [(9, 0, 0), (10, -2, 0)], atol=1e-5)
    assert points["colors"].tolist() == [[255, 0, 0, 255]] * 2


def test_clouds_of_all_layouts_are_points() -> None:
    rows = [(1, 2, 3), (math.nan, 0, 0), (4, 5, 6)]
    drawing = Drawing()
    assert draw_cloud(cloud_of(rows), IDENTITY, Look("/c"), drawing) == "2 points"
    assert parts(drawing)[0]["positions"].tolist() == [[1, 2, 3], [4, 5, 6]]

    padded = cloud_of([(1, 2, 3), (0, 0, 0), (4, 5, 6)], width=1, height=2, row_step=24)
    drawing = Drawing()
    draw_cloud(padded, IDENTITY, Look("/c"), drawing)
    assert parts(drawing)[0]["positions"].tolist() == [[1, 2, 3], [4, 5, 6]]

    big = cloud_of([(1, 2, 3)], is_bigendian=True)
    big.data = np.array([1, 2, 3], dtype=">f4").tobytes()
    drawing = Drawing()
    draw_cloud(big, IDENTITY, Look("/c"), drawing)
    assert parts(drawing)[0]["positions"].tolist() == [[1, 2, 3]]

    (red,) = struct.unpack("<f", bytes((0, 0, 255, 0)))
    colored = cloud_of([(0, 0, 0, red)], ["x", "y", "z", "rgb"])  # type: ignore[arg-type]
    drawing = Drawing()
    draw_cloud(colored, IDENTITY, Look("/c"), drawing)
    assert parts(drawing)[0]["colors"].tolist() == [[255, 0, 0, 255]]
    drawing = Drawing()
    high = cloud_of([(0, 0, 0), (0, 0, 1)])
    draw_cloud(high, IDENTITY, Look("/c", "height"), drawing)
    assert parts(drawing)[0]["colors"].tolist() == [[255, 0, 0, 255], [255, 0, 255, 255]]


def test_clouds_that_do_not_fit_are_named() -> None:
    with pytest.raises(UsageError, match="no x, y and z; its fields are a, b"):
        draw_cloud(cloud_of([(1, 2)], "ab"), IDENTITY, Look("/c"), Drawing())
    with pytest.raises(UsageError, match="12 bytes of data; expected 24"):
        draw_cloud(cloud_of([(1, 2, 3)], width=2), IDENTITY, Look("/c"), Drawing())
    assert draw_cloud(cloud_of([]), IDENTITY, Look("/c"), Drawing()) == "0 points"


def test_a_map_has_the_colors_of_rviz() -> None:
    origin = PoseMessage(Point(-1, -2, 0), Quaternion(0, 0, 0, 1))
    info = MapMetaData(resolution=0.5, width=3, height=1, origin=origin)
    drawing = Drawing()
    rows = read_cells([0, 100, -1], info.width, info.height, "map")
    assert draw_map(info, rows, IDENTITY, Look("/map"), drawing) == "3 x 1 cells of 0.5 m"
    (image,) = parts(drawing)
    assert image["cells"].tolist() == [0, 100, 255]
    assert image["palette"][[0, 100]].tolist() == [[255] * 4, [0, 0, 0, 255]]
    assert np.reshape(image["matrix"], (4, 4)).T[:2].tolist() == [[1.5, 0, 0, -1], [0, 0.5, 0, -2]]
    with pytest.raises(UsageError, match="2 cells; expected 3 x 1"):
        read_cells([0, 0], info.width, info.height, "map")


def test_updates_change_a_part_of_a_map(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    maps = robot.publisher("map", OccupancyGrid, latch=True)
    updates = robot.publisher("map_updates", OccupancyGridUpdate)
    system = System(page, PagePolicy())
    graph = system.graph.use().value
    eventually(lambda: graph.survey().view.publishers("/map"), "the map")
    frames = Frames(page)
    meshes = Meshes(Environment.read({}), lambda _: "")
    display = open_display(system, graph.survey(), frames, meshes, Look("/map"))
    header = Header(frame_id="map")
    info = MapMetaData(resolution=1.0, width=3, height=2)
    maps.publish(OccupancyGrid(header=header, info=info, data=[0] * 6))

    def cells() -> list[int]:
        display.refresh("map")
        return [cell for image in parts(display.encoded()[0]) for cell in image["cells"].tolist()]

    eventually(lambda: cells() == [0] * 6, "the map")
    eventually(updates.subscribers, "the subscription to updates")
    updates.publish(OccupancyGridUpdate(header, 1, 0, 2, 2, [100, -1, 50, 1]))
    eventually(lambda: cells() == [0, 100, 255, 0, 50, 1], "the update")
    assert display.status == "3 x 2 cells of 1 m, 1 updates"
    updates.publish(OccupancyGridUpdate(header, 2, 0, 2, 2, [0] * 4))
    eventually(lambda: display.refresh("map"), "the update that does not fit")
    assert "2 x 2 cells at (2, 0) is not within the map of 3 x 2 cells" in display.fault
    maps.publish(OccupancyGrid(header=header, info=info, data=[7] * 6))
    eventually(lambda: cells() == [7] * 6, "the next map")
    assert (display.fault, display.status) == ("", "3 x 2 cells of 1 m")
    display.look = Look("/map", visible=False)
    display.refresh("map")
    eventually(lambda: not (maps.subscribers() or updates.subscribers()), "no subscription")
    display.close()
    frames.close()


def test_a_grid_and_axes_are_at_a_frame(network: Network) -> None:
    page = network.node("page")
    StaticTransformBroadcaster(network.node("robot")).send(frame("map", "laser", 2.0, 1))
    frames = Frames(page)
    eventually(lambda: "laser" in frames.buffer.frames(), "the frame")
    axes = StillDisplay(Look("axes", frame="laser", size=2.0, radius=0.25), frames)
    assert axes.refresh("map")
    found = parts(axes.encoded()[0])
    assert np.allclose(found[0]["matrices"][0].diagonal(), (2.0, 0.5, 0.5, 1.0))
    assert np.allclose(found[0]["matrices"][0, :3, 3], (3.0, 0, 0))
    assert axes.status == "at 'laser'"
    assert not axes.refresh("map")
    axes.look = Look("axes", frame="none")
    assert axes.refresh("map")
    assert parts(axes.encoded()[0]) == []
    assert '"none" passed' in axes.fault
    grid = StillDisplay(Look("grid", size=0.5, cells=4, frame="laser"), frames)
    grid.refresh("map")
    (lines,) = parts(grid.encoded()[0])
    assert (lines["positions"].min(axis=0).tolist(), lines["positions"].max(axis=0).tolist()) == (
        [1.0, -1.0, 0.0],
        [3.0, 1.0, 0.0],
    )
    assert grid.status == "4 x 4 cells of 0.5 m"
    frames.close()


def test_paths_and_poses() -> None:
    poses = [PoseMessage(Point(x, 0, 0), Quaternion(0, 0, 0, 1)) for x in (0.0, 1.0, 2.0)]
    drawing = Drawing()
    path = Path(poses=[PoseStamped(pose=one) for one in poses])
    draw_path(path, ASIDE, Look("/path"), drawing)
    (line,) = parts(drawing)
    assert np.allclose(line["positions"][:, 0], [10, 9, 9, 8])
    drawing = Drawing()
    draw_path(path, IDENTITY, Look("/path", size=0.1), drawing)
    (bars,) = parts(drawing)
    assert np.allclose(bars["matrices"][:, 0, 3], [0.5, 1.5])
    drawing = Drawing()
    draw_poses(PoseArray(poses=poses), IDENTITY, Look("/poses"), drawing)
    shaft, tip = parts(drawing)
    assert (shaft["shape"], tip["shape"], shaft["count"]) == ("cylinder", "cone", 3)
    # An arrow points along x: the tip of its cone is at its length.
    assert np.allclose(tip["matrices"][1] @ (0, 0, 0.5, 1), (1.3, 0, 0, 1), atol=1e-6)


def frame(parent: str, child: str, x: float, stamp: int) -> TransformStamped:
    header = Header(stamp=Time.from_nsec(stamp), frame_id=parent)
    return TransformStamped(header, child, Transform(Vector3(x, 0, 0), Quaternion(0, 0, 0, 1)))


def test_a_display_waits_for_the_transform_and_names_it(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    publisher = robot.publisher("scan", LaserScan)
    graph = System(page, PagePolicy()).graph.use().value
    eventually(lambda: graph.survey().view.publishers("/scan"), "the publisher")
    frames = Frames(page)
    meshes = Meshes(page.context.environment, lambda _: "")
    sources = SceneSources(page, graph.survey(), frames, meshes)
    display = TopicDisplay(sources, Look("/scan", "#ff0000"))
    scan = LaserScan(
        header=Header(stamp=Time.from_nsec(5_000_000_000), frame_id="laser"),
        range_max=5.0,
        ranges=[1.0],
    )
    eventually(publisher.subscribers, "the subscription")
    publisher.publish(scan)
    eventually(lambda: display.received, "the scan")
    assert not display.refresh("map")
    assert (
        '"laser" passed to lookupTransform argument source_frame does not exist' in (display.fault)
        or '"map" passed' in display.fault
    )
    StaticTransformBroadcaster(robot).send(frame("base", "laser", 1.0, 1))
    broadcaster = TransformBroadcaster(robot)

    def moved() -> bool:
        broadcaster.send([frame("map", "base", 2.0, s * 10**9) for s in (4, 6)])
        return display.refresh("map")

    eventually(moved, "the transform")
    (points,) = parts(display.encoded()[0])
    assert points["positions"].tolist() == [[4, 0, 0]]
    assert display.fault == ""
    assert display.status == "1 of 1 points"
    assert not display.refresh("map")
    display.look = Look("/scan", visible=False)
    display.refresh("map")
    assert parts(display.encoded()[0]) == []
    eventually(lambda: not publisher.subscribers(), "no subscription while it is hidden")
    display.close()
    frames.close()


def test_tools_publish_what_rviz_publishes(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    got: dict[str, Any] = {}
    topics: dict[str, Any] = {
        "/initialpose": PoseWithCovarianceStamped,
        "/move_base_simple/goal": PoseStamped,
        "/clicked_point": PointStamped,
    }
    for topic, kind in topics.items():
        robot.subscription(topic, kind, lambda message, topic=topic: got.update({topic: message}))
    with pytest.raises(UsageError, match="read-only: it may not publish '/initialpose'"):
        Tools(page, PagePolicy(read_only=True)).take("estimate")
    tools = Tools(page, PagePolicy())
    with page.context.graph.follow_all() as followed:
        eventually(lambda: all(map(followed.view().subscriptions, topics)), "the subscriptions")
    for name, tool in TOOLS.items():
        tools.send(name, "map", (1.0, 2.0, 0.5), math.pi / 2)
        eventually(lambda topic=tool.topic: topic in got, tool.topic)  # type: ignore[misc]
    tools.close()
    assert {message.header.frame_id for message in got.values()} == {"map"}
    estimate = got["/initialpose"].pose
    assert estimate.covariance[0] == estimate.covariance[7] == 0.25
    assert estimate.covariance[35] == pytest.approx(0.06853892)
    assert sum(1 for one in estimate.covariance if one) == 3
    goal = got["/move_base_simple/goal"].pose
    assert (goal.position.x, goal.position.y) == (1.0, 2.0)
    assert (goal.orientation.z, goal.orientation.w) == pytest.approx((0.70710678, 0.70710678))
    assert got["/clicked_point"].point == Point(1.0, 2.0, 0.5)
