"""Displays of odometry, images, cells, wrenches and robots with a prefix, without a browser."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from network import Network, eventually

from rosz.access import PagePolicy
from rosz.environment import Environment
from rosz.errors import NotFoundError, UsageError
from rosz.introspect.subscribe import topic_types
from rosz.msgs.geometry_msgs.msg import (
    Accel,
    AccelStamped,
    Point,
    Point32,
    Polygon,
    PolygonStamped,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistStamped,
    Vector3,
    Wrench,
    WrenchStamped,
)
from rosz.msgs.nav_msgs.msg import GridCells, Odometry
from rosz.msgs.sensor_msgs.msg import (
    CameraInfo,
    ChannelFloat32,
    Image,
    Imu,
    LaserScan,
    PointCloud,
    PointCloud2,
    PointField,
    Range,
)
from rosz.msgs.std_msgs.msg import Header
from rosz.transforms import IDENTITY
from rosz.web.model import Frames, System
from rosz.web.scene import (
    Look,
    Meshes,
    SceneSetup,
    format_setup,
    list_displays,
    open_display,
    read_setup,
)
from rosz.web.scene.depth import draw_depth
from rosz.web.scene.display import FrameDisplay
from rosz.web.scene.drawing import Drawing
from rosz.web.scene.poses import (
    Trail,
    draw_boxes,
    draw_cells,
    draw_imu,
    draw_pair,
    draw_polygons,
)
from rosz.web.scene.robot import RobotDisplay
from rosz.web.scene.sensors import draw_camera, draw_old_cloud

from .test_scene import ASIDE, parts

FLAT = Quaternion(0, 0, 0, 1)
FORCES = ("wrench", "force", "torque")
PARTS = ("linear", "angular")
URDF = """<robot name="r"><link name="base"><visual><geometry><box size="1 1 1"/></geometry>
<material name="wood"><texture filename="package://r/wood.png"/></material></visual></link>
</robot>"""


def odometry(x: float, frame: str = "odom") -> Odometry:
    pose = PoseWithCovariance(pose=Pose(Point(x, 0, 0), FLAT))
    return Odometry(header=Header(frame_id=frame), child_frame_id="base", pose=pose)


def test_poses_of_an_odometry_stay_as_it_moves() -> None:
    trail, drawing = Trail(), Drawing()
    for x in (0.0, 0.05, 0.2, 0.3, 1.0, float("nan")):
        trail.add(odometry(x), 0)
    assert trail.draw(ASIDE, Look("/odom", size=0.5), drawing) == 3
    shaft, tip = parts(drawing)
    assert (shaft["shape"], tip["shape"]) == ("cylinder", "cone")
    assert np.allclose(tip["matrices"][:, 0, 3], [10 - x - 0.425 for x in (0.0, 0.2, 1.0)])
    for x in range(10):
        trail.add(odometry(x), 4)
    assert trail.draw(IDENTITY, Look("/odom"), Drawing()) == 4
    trail.add(odometry(0.0, "map"), 4)
    assert trail.draw(IDENTITY, Look("/odom"), Drawing()) == 1


def test_cells_and_wrenches_are_drawn() -> None:
    drawing = Drawing()
    cells = GridCells(cell_width=0.5, cell_height=0.25, cells=[Point(1, 2, 0), Point(2, 2, 0)])
    assert draw_cells(cells, IDENTITY, Look("/cells"), drawing) == "2 cells of 0.5 x 0.25 m"
    (cubes,) = parts(drawing)
    assert np.allclose(cubes["matrices"][1].diagonal()[:2], (0.5, 0.25))
    assert np.allclose(cubes["matrices"][:, :2, 3], [(1, 2), (2, 2)])
    drawing = Drawing()
    wrench = WrenchStamped(wrench=Wrench(force=Vector3(3, 4, 0), torque=Vector3(0, 0, 2)))
    assert draw_pair(FORCES, wrench, IDENTITY, Look("/w"), drawing) == "force 5.00, torque 2.00"
    force, torque = parts(drawing)
    assert np.allclose(force["matrices"][0, :3, 3], (1.5, 2, 0))
    assert np.allclose(torque["matrices"][0, :3, 3], (0, 0, 1))
    draw_pair(FORCES, WrenchStamped(), IDENTITY, Look("/w"), Drawing())


def test_speeds_accelerations_and_inertial_sensors_are_drawn() -> None:
    drawing = Drawing()
    twist = TwistStamped(twist=Twist(linear=Vector3(3, 4, 0), angular=Vector3(0, 0, 2)))
    assert (
        draw_pair(("twist", *PARTS), twist, IDENTITY, Look("/v"), drawing)
        == "linear 5.00, angular 2.00"
    )
    assert len(parts(drawing)) == 2
    accel = AccelStamped(accel=Accel(linear=Vector3(0, 1, 0)))
    assert (
        draw_pair(("accel", *PARTS), accel, IDENTITY, Look("/a"), Drawing())
        == "linear 1.00, angular 0.00"
    )
    drawing = Drawing()
    imu = Imu(orientation=FLAT, linear_acceleration=Vector3(0, 0, 9.8))
    assert draw_imu(imu, IDENTITY, Look("/imu"), drawing) == "acceleration 9.80"
    assert len(parts(drawing)) == 4
    drawing = Drawing()
    imu.orientation_covariance[0] = -1.0
    draw_imu(imu, IDENTITY, Look("/imu"), drawing)
    assert len(parts(drawing)) == 1


def test_what_a_camera_sees_is_a_pyramid() -> None:
    info = CameraInfo(height=100, width=200, k=[100.0, 0, 100, 0, 100.0, 50, 0, 0, 1])
    drawing = Drawing()
    assert draw_camera(info, ASIDE, Look("/info", size=2.0), drawing) == "200 x 100"
    (lines,) = parts(drawing)
    assert lines["count"] == 16
    assert np.allclose(lines["positions"][1], (12.0, 1.0, 2.0))
    with pytest.raises(UsageError, match="not calibrated"):
        draw_camera(CameraInfo(height=1, width=1), IDENTITY, Look("/info"), Drawing())


def test_recognised_things_are_drawn() -> None:
    half = Vector3(1, 2, 3)
    box = SimpleNamespace(pose=Pose(Point(1, 0, 0), FLAT), dimensions=half, label=1)
    drawing = Drawing()
    array = SimpleNamespace(boxes=[box, box])
    assert draw_boxes(array, IDENTITY, Look("/boxes"), drawing) == "2 boxes"
    lines, cube = parts(drawing)[:2]
    assert np.allclose(lines["positions"].max(axis=0), (1.5, 1, 1.5))
    assert np.allclose(cube["matrices"][0].diagonal(), (1, 2, 3, 1))
    drawing = Drawing()
    polygon = PolygonStamped(polygon=Polygon([Point32(0, 0, 0), Point32(1, 0, 0)]))
    planes = SimpleNamespace(polygons=[polygon, polygon], labels=[])
    assert draw_polygons(planes, IDENTITY, Look("/planes"), drawing) == "2 polygons"
    first, second = parts(drawing)
    assert first["colors"].tolist() != second["colors"].tolist()


def test_an_address_holds_what_stays_and_the_prefix() -> None:
    setup = SceneSetup("map", (Look("/odom", keep=7), Look("robot", prefix="tb3_0")))
    assert format_setup(setup) == "/3d?frame=map&show=/odom;keep=7,robot;prefix=tb3_0"
    assert read_setup("map", "/odom;keep=7,robot;prefix=tb3_0", "") == setup
    assert read_setup("", "/odom;keep=-1;prefix=", "").looks == (Look("/odom"),)


def test_images_and_trails_of_topics_are_displayed(network: Network) -> None:
    pytest.importorskip("cv2")
    robot, page = network.node("robot"), network.node("page")
    camera = robot.publisher("camera", Image, latch=True)
    odom = robot.publisher("odom", Odometry)
    system = System(page, PagePolicy())
    graph = system.graph.use().value
    eventually(lambda: graph.survey().view.publishers("/odom"), "the odometry")
    eventually(lambda: graph.survey().view.publishers("/camera"), "the camera")
    frames = Frames(page)
    meshes = Meshes(Environment.read({}), lambda _: "")
    look = Look("/camera")
    image = open_display(system, graph.survey(), frames, meshes, look)
    camera.publish(Image(height=2, width=2, encoding="mono8", step=2, data=bytes(4)))
    eventually(lambda: image.refresh("odom"), "the image")
    assert (image.kind, image.status) == ("sensor_msgs/Image", "2 x 2 mono8")
    assert image.encoded()[1] == "image/jpeg"
    assert not image.refresh("odom")
    image.look = Look("/camera", visible=False)
    assert not image.refresh("odom")
    eventually(lambda: not camera.subscribers(), "no subscription while it is hidden")
    display = open_display(system, graph.survey(), frames, meshes, Look("/odom"))
    eventually(odom.subscribers, "the subscription")
    for x in range(3):
        odom.publish(odometry(x))

    def all_drawn() -> bool:
        display.refresh("odom")
        display.encoded()
        return display.status == "x 2.00, y 0.00, z 0.00, 3 kept"

    eventually(all_drawn, "three poses")
    for one in (image, display, frames):
        one.close()


def test_infinite_and_absurd_values_warn_of_nothing(network: Network) -> None:
    """numpy would write to the terminal of ``rosz web``; in tests, a warning is an error."""
    robot, page = network.node("robot"), network.node("page")
    system = System(page, PagePolicy())
    frames = Frames(page)
    meshes = Meshes(Environment.read({}), lambda _: "")
    values = (math.inf, 1.0, math.nan, -math.inf, 1e38, -1e38)
    header = Header(frame_id="odom")
    channel = ChannelFloat32(name="intensity", values=list(values))
    fields = [PointField(name=name, offset=0, datatype=8, count=1) for name in "xyz"]
    sent = (
        LaserScan(header=header, range_max=math.inf, ranges=list(values), intensities=list(values)),
        PointCloud(header=header, points=[Point32(x=x) for x in values], channels=[channel]),
        PointCloud2(
            header=header,
            height=1,
            width=2,
            point_step=8,
            row_step=16,
            fields=fields,
            data=np.array([1e308, 1.0]).tobytes(),
        ),
        Range(header=header, range=1e38, field_of_view=math.pi),
    )
    graph = system.graph.use().value

    def show(topic: str, message: Any) -> None:
        robot.publisher(topic, type(message), latch=True).publish(message)
        eventually(lambda: graph.survey().view.publishers(topic), "the topic")
        display = open_display(system, graph.survey(), frames, meshes, Look(topic))
        eventually(lambda: display.refresh("odom"), "the message")
        display.encoded()
        assert display.status, topic
        display.close()

    for number, message in enumerate(sent):
        show(f"/t{number}", message)
    assert draw_old_cloud(sent[1], IDENTITY, Look("/c"), Drawing()) == "3 points"
    frames.close()


@pytest.mark.parametrize("encoding", ["32FC1", "64FC1"])
def test_infinite_pixels_warn_of_nothing(encoding: str) -> None:
    pytest.importorskip("cv2")
    from rosz.images import pixels

    kind = {"32FC1": np.float32, "64FC1": np.float64}[encoding]
    image = np.array([[math.inf, 1.0], [math.nan, -math.inf]], kind)
    message = Image(
        height=2, width=2, encoding=encoding, step=2 * image.itemsize, data=image.tobytes()
    )
    assert pixels(message, deep=False).shape == (2, 2)


def test_no_frame_says_what_to_start(network: Network) -> None:
    frames = Frames(network.node("page"))
    display = FrameDisplay(Look("tf"), frames)
    display.refresh("")
    assert parts(display.encoded()[0]) == []
    assert "start a node that sends transforms" in display.fault
    frames.close()


def test_a_robot_with_a_prefix_has_other_frames(network: Network) -> None:
    page = network.node("page")
    page.params.set("/robot_description", URDF)
    frames = Frames(page)
    meshes = Meshes(Environment.read({}), lambda _: "")
    display = RobotDisplay(page, Look("robot", prefix="tb3_0"), frames, meshes)
    display.refresh("tb3_0/base")
    (cube,) = parts(display.encoded()[0])
    assert cube["shape"] == "cube"
    assert display.fault.startswith("link 'base': without its texture: ")
    assert "package 'r'" in display.fault
    display.look = Look("robot")
    display.refresh("tb3_0/base")
    assert parts(display.encoded()[0]) == []
    assert "no transform to 'tb3_0/base'" in display.fault
    display.close()
    frames.close()


def test_a_depth_image_is_points() -> None:
    info = CameraInfo(height=2, width=2, k=[100.0, 0, 1, 0, 100.0, 0, 0, 0, 1])
    near = np.array([[1000, 0], [2000, 3000]], "<u2")
    depth = Image(height=2, width=2, encoding="16UC1", step=4, data=near.tobytes())
    drawing = Drawing()
    text = draw_depth(depth, info, None, ASIDE, Look("/d", "#ff0000"), drawing)
    assert text == "3 of 2 x 2 points"
    (points,) = parts(drawing)
    assert np.allclose(points["positions"], [(10.01, 0, 1), (10.02, -0.02, 2), (10, -0.03, 3)])
    far = np.array([[1, np.nan, 9], [np.inf, 0, 9]], ">f4")  # with an end of lines
    depth = Image(height=2, width=2, encoding="32FC1", step=12, data=far.tobytes(), is_bigendian=1)
    assert draw_depth(depth, info, None, IDENTITY, Look("/d"), Drawing()) == "1 of 2 x 2 points"
    for broken, why in (
        (Image(height=1, width=1, encoding="rgb8", step=3, data=bytes(3)), "expected a depth"),
        (Image(height=1, width=1, encoding="32FC1", step=4, data=bytes(3)), "expected 4"),
        (Image(height=1, width=1, encoding="32FC1", step=2, data=bytes(4)), "4 bytes of data"),
    ):
        with pytest.raises(UsageError, match=why):
            draw_depth(broken, info, None, IDENTITY, Look("/d"), Drawing())
    with pytest.raises(UsageError, match="not calibrated"):
        draw_depth(depth, CameraInfo(), None, IDENTITY, Look("/d"), Drawing())


def test_points_of_depths_have_the_colors_of_an_image(network: Network) -> None:
    pytest.importorskip("cv2")
    robot, page = network.node("robot"), network.node("page")
    depths = robot.publisher("camera/depth", Image, latch=True)
    infos = robot.publisher("camera/camera_info", CameraInfo, latch=True)
    colors = robot.publisher("rgb", Image, latch=True)
    k = [100.0, 0, 1, 0, 100.0, 0, 0, 0, 1]
    infos.publish(CameraInfo(height=1, width=2, k=k))
    one = np.ones(2, "<f4").tobytes()
    header = Header(frame_id="camera")
    depths.publish(Image(header, height=1, width=2, encoding="32FC1", step=8, data=one))
    picture = bytes((255, 0, 0, 0, 0, 255)) * 2
    colors.publish(Image(height=1, width=4, encoding="rgb8", step=12, data=picture))
    system = System(page, PagePolicy())
    graph = system.graph.use().value
    names = {"/camera/depth", "/camera/camera_info", "/rgb"}
    eventually(lambda: names <= set(topic_types(graph.survey().view)), "the camera")
    assert "depth:/camera/depth" in list_displays(graph.survey())
    frames = Frames(page)
    meshes = Meshes(Environment.read({}), lambda _: "")
    look = Look("depth:/camera/depth", image="/rgb")
    display = open_display(system, graph.survey(), frames, meshes, look)

    def drawn() -> list[list[int]]:
        display.look = Look("depth:/camera/depth", size=display.look.size + 1, image="/rgb")
        display.refresh("camera")
        found = parts(display.encoded()[0])
        paint: list[list[int]] = found[0]["colors"].tolist() if found else []
        return paint

    eventually(lambda: drawn() == [[255, 0, 0, 255]] * 2, "points in the colors of the image")
    assert (display.kind, display.status) == ("DepthCloud", "2 of 2 x 1 points")
    display.look = Look("depth:/camera/depth", visible=False, image="/rgb")
    display.refresh("camera")
    publishers = (depths, infos, colors)
    eventually(lambda: not any(one.subscribers() for one in publishers), "no subscription")
    look = Look("depth:/camera/depth", image="/none")
    with pytest.raises(NotFoundError, match="/none"):
        open_display(system, graph.survey(), frames, meshes, look)
    display.close()
    frames.close()
