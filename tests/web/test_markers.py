"""Markers and robots in space, without a browser."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from network import Network, eventually

from rosz.access import PagePolicy
from rosz.environment import Environment
from rosz.errors import UsageError
from rosz.msgs.builtin_interfaces.msg import Duration
from rosz.msgs.geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from rosz.msgs.std_msgs.msg import ColorRGBA, Header
from rosz.msgs.visualization_msgs.msg import Marker, MarkerArray
from rosz.transforms import IDENTITY
from rosz.transforms import Pose as Place
from rosz.web.model import Frames, System
from rosz.web.scene import Look, Meshes
from rosz.web.scene.display import SceneSources
from rosz.web.scene.drawing import Drawing
from rosz.web.scene.markers import MarkerDisplay, draw_marker
from rosz.web.scene.robot import RobotDisplay, draw_visual, read_visuals

from .test_scene import parts

RED = ColorRGBA(1.0, 0.0, 0.0, 1.0)
BLUE = ColorRGBA(0.0, 0.0, 1.0, 1.0)
POINTS = [Point(0, 0, 0), Point(1, 0, 0), Point(1, 1, 0), Point(0, 1, 0)]


def marker(kind: int, **changes: Any) -> Marker:
    values: dict[str, Any] = {
        "header": Header(frame_id="map"),
        "type": kind,
        "pose": Pose(Point(1, 2, 3), Quaternion(0, 0, 0, 1)),
        "scale": Vector3(1, 2, 3),
        "color": RED,
    }
    return Marker(**{**values, **changes})


@pytest.fixture
def meshes(tmp_path: Path) -> Meshes:
    folder = tmp_path / "src" / "robot"
    (folder / "meshes").mkdir(parents=True)
    (folder / "package.xml").write_text(
        "<package format='2'><name>robot</name><version>0.0.0</version><description>d</description>"
        "<maintainer email='a@b.c'>m</maintainer><license>MIT</license></package>"
    )
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (folder / "meshes" / "part.obj").write_text("mtllib ../../../secret.mtl\n" + corners)
    triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    (folder / "meshes" / "part.STL").write_bytes(bytes(80) + struct.pack("<I", 1) + triangle)
    (folder / "meshes" / "part.dae").write_text(DAE)
    (folder / "meshes" / "broken.dae").write_text("<COLLADA")
    (tmp_path / "secret.stl").write_text("secret")
    environment = Environment.read({"ROSZ_PACKAGE_PATH": str(tmp_path / "src")})
    return Meshes(environment, Sources())


class Sources:
    """Gives sources the addresses 0, 1 and so on."""

    def __init__(self) -> None:
        self.all: list[Any] = []

    def __call__(self, source: Any) -> str:
        self.all.append(source)
        return str(len(self.all) - 1)


DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">0 0 0 100 0 0 0 100 0</float_array>
<technique_common><accessor source="#pa" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


@pytest.mark.parametrize(
    ("kind", "drawn"),
    [
        (Marker.ARROW, [("cylinder", 1), ("cone", 1)]),
        (Marker.CUBE, [("cube", 1)]),
        (Marker.SPHERE, [("sphere", 1)]),
        (Marker.CYLINDER, [("cylinder", 1)]),
        (Marker.LINE_STRIP, [("cube", 3)]),
        (Marker.LINE_LIST, [("cube", 2)]),
        (Marker.CUBE_LIST, [("cube", 4)]),
        (Marker.SPHERE_LIST, [("sphere", 4)]),
        (Marker.POINTS, [("points", 4)]),
        (Marker.ARROW_STRIP, [("cylinder", 1), ("cone", 1)] * 3),
    ],
)
def test_every_type_of_marker_is_drawn(
    kind: int, drawn: list[tuple[str, int]], meshes: Meshes
) -> None:
    points = [] if kind == Marker.ARROW else POINTS
    drawing = Drawing()
    draw_marker(marker(kind, points=points), IDENTITY, meshes, drawing)
    found = parts(drawing)
    assert [(one.get("shape", one["kind"]), one["count"]) for one in found] == drawn
    assert all(one["colors"][0].tolist() == [255, 0, 0, 255] for one in found)


def test_markers_are_where_they_should_be(meshes: Meshes) -> None:
    drawing = Drawing()
    draw_marker(marker(Marker.CUBE), Place((10, 0, 0), (0, 0, 0, 1)), meshes, drawing)
    draw_marker(marker(Marker.CUBE_LIST, points=POINTS), IDENTITY, meshes, drawing)
    draw_marker(
        marker(Marker.POINTS, points=POINTS, colors=[RED, BLUE, RED, BLUE]),
        IDENTITY,
        meshes,
        drawing,
    )
    cube, cubes, points = parts(drawing)
    assert cube["matrices"][0].tolist() == [[1, 0, 0, 11], [0, 2, 0, 2], [0, 0, 3, 3], [0, 0, 0, 1]]
    assert cubes["matrices"][2][:3, 3].tolist() == [2, 3, 3]
    assert points["colors"][1].tolist() == [0, 0, 255, 255]
    assert points["size"] == 1


def test_arrows_go_from_point_to_point(meshes: Meshes) -> None:
    arrow = marker(
        Marker.ARROW,
        pose=Pose(orientation=Quaternion(0, 0, 0, 1)),
        points=[Point(0, 0, 0), Point(0, 2, 0)],
        scale=Vector3(0.1, 0.2, 0.5),
    )
    drawing = Drawing()
    draw_marker(arrow, IDENTITY, meshes, drawing)
    rod, tip = parts(drawing)
    assert np.allclose(rod["matrices"][0] @ (0, 0, -0.5, 1), (0, 0, 0, 1), atol=1e-6)
    assert np.allclose(tip["matrices"][0] @ (0, 0, -0.5, 1), (0, 1.5, 0, 1), atol=1e-6)
    assert np.allclose(tip["matrices"][0] @ (0, 0, 0.5, 1), (0, 2, 0, 1), atol=1e-6)


def test_texts_and_triangles(meshes: Meshes) -> None:
    drawing = Drawing()
    draw_marker(marker(Marker.TEXT_VIEW_FACING, text="<b>hi</b>"), IDENTITY, meshes, drawing)
    draw_marker(marker(Marker.TRIANGLE_LIST, points=POINTS[:3]), IDENTITY, meshes, drawing)
    text, triangles = parts(drawing)
    assert (text["text"], text["height"], text["at"]) == ("<b>hi</b>", 3, [1, 2, 3])
    assert triangles["positions"].tolist() == [[1, 2, 3], [2, 2, 3], [2, 4, 3]]
    with pytest.raises(ValueError, match="three for each triangle"):
        draw_marker(marker(Marker.TRIANGLE_LIST, points=POINTS), IDENTITY, meshes, Drawing())
    with pytest.raises(ValueError, match="its type is 77"):
        draw_marker(marker(77), IDENTITY, meshes, Drawing())


def test_meshes_come_from_packages(meshes: Meshes, tmp_path: Path) -> None:
    part = meshes.find("package://robot/meshes/part.STL")
    assert (part.form, part.colored) == ("stl", False)
    assert meshes.find("package://robot/meshes/part.STL") is part
    assert meshes.find(f"file://{tmp_path}/src/robot/meshes/part.STL").form == "stl"
    for uri in ("package://robot/meshes/part.obj", "package://robot/meshes/part.dae"):
        mesh = meshes.find(uri)
        content, media = meshes._add.all[int(mesh.address)]()  # type: ignore[attr-defined]
        assert content.startswith(b"glTF")
        assert media == "model/gltf-binary"
    # The unit of the Collada file is a centimetre.
    assert _reach(content) == pytest.approx(1.0)
    for uri, why in (
        ("package://robot/../../secret.stl", "leave it out|leads out"),
        ("package://robot/meshes/none.stl", "has no file 'meshes/none.stl'"),
        ("package://nowhere/part.stl", "nowhere"),
        (f"file://{tmp_path}/secret.stl", "is in no package"),
        (f"file://{tmp_path}/src/robot/../../secret.stl", "is in no package"),
        ("package://robot/meshes/broken.dae", "is not a mesh that can be read"),
        ("package://robot/meshes/part.fbx", "cannot be shown; expected one of .stl"),
    ):
        with pytest.raises(UsageError, match=why):
            meshes.find(uri)


def _reach(glb: bytes) -> float:
    import io

    import trimesh

    scene: Any = trimesh.load_scene(io.BytesIO(glb), file_type="glb")
    return float(scene.bounds[1][0])


URDF = """<robot name="r">
  <material name="blue"><color rgba="0 0 1 0.5"/></material>
  <link name="base"><visual><origin xyz="0 0 1" rpy="0 0 1.5707963267948966"/>
    <geometry><box size="1 2 3"/></geometry><material name="blue"/></visual></link>
  <link name="wheel"><visual><geometry><cylinder radius="0.5" length="0.1"/></geometry></visual>
    <visual><geometry><mesh filename="package://robot/meshes/part.STL" scale="2 2 2"/></geometry>
    <material name="red"><color rgba="1 0 0 1"/></material></visual>
    <visual><geometry><mesh filename="package://robot/none.stl"/></geometry></visual></link>
  <link name="empty"/>
</robot>"""


def test_the_links_of_a_robot_are_drawn(meshes: Meshes) -> None:
    box, cylinder, mesh, missing = read_visuals(URDF)
    drawing = Drawing()
    draw_visual(box, Place((1, 0, 0), (0, 0, 0, 1)), meshes, drawing)
    draw_visual(cylinder, IDENTITY, meshes, drawing)
    draw_visual(mesh, IDENTITY, meshes, drawing)
    cube, wheel, model = parts(drawing)
    assert cube["opacity"] == pytest.approx(0.5, abs=0.01)
    assert np.allclose(cube["matrices"][0][:3], [[0, -2, 0, 1], [1, 0, 0, 0], [0, 0, 3, 1]])
    assert wheel["matrices"][0].diagonal().tolist() == pytest.approx([1, 1, 0.1, 1])
    assert (model["form"], model["color"], model["matrix"][0]) == ("stl", [255, 0, 0, 255], 2)
    with pytest.raises(UsageError, match=r"has no file 'none\.stl'"):
        draw_visual(missing, IDENTITY, meshes, drawing)
    for text, why in (
        ("<robot>", "not XML"),
        ("<sdf/>", "expected <robot>"),
        (URDF.replace("1 2 3", "1 2"), "link 'base'"),
        (URDF.replace("0 0 1 0.5", "0 0 1"), "has 3 numbers"),
    ):
        with pytest.raises(UsageError, match=why):
            read_visuals(text)


def test_markers_come_and_go(network: Network, meshes: Meshes) -> None:
    robot, page = network.node("robot"), network.node("page")
    publisher = robot.publisher("markers", MarkerArray)
    graph = System(page, PagePolicy()).graph.use().value
    eventually(lambda: graph.survey().view.publishers("/markers"), "the publisher")
    frames = Frames(page)
    sources = SceneSources(page, graph.survey(), frames, meshes)
    display = MarkerDisplay(sources, Look("/markers"))
    display.refresh("map")
    publisher.wait_for_subscribers(1)

    def publish(*markers: Marker) -> None:
        publisher.publish(MarkerArray(list(markers)))

    def shows(*kinds: str) -> bool:
        display.refresh("map")
        found = [one.get("shape", one["kind"]) for one in parts(display.encoded()[0])]
        return sorted(found) == sorted(kinds)

    publish(
        marker(Marker.CUBE, ns="a", id=1),
        marker(Marker.SPHERE, ns="a", id=2),
        marker(Marker.SPHERE, ns="b", id=2, header=Header(frame_id="nowhere")),
    )
    eventually(lambda: shows("cube", "sphere"), "two markers, and one without a transform")
    assert "1 not drawn" in display.fault
    publish(marker(Marker.CYLINDER, ns="a", id=1))
    eventually(lambda: shows("cylinder", "sphere"), "another shape in place of the first")
    publish(marker(0, ns="a", id=2, action=Marker.DELETE))
    eventually(lambda: shows("cylinder"), "one marker less")
    publish(marker(Marker.CUBE, ns="c", lifetime=Duration(0, 200_000_000)))
    eventually(lambda: shows("cylinder"), "a marker that lives shortly is gone")
    publish(marker(0, action=Marker.DELETEALL))
    eventually(shows, "no marker")
    assert display.fault == ""
    display.close()
    frames.close()


def test_a_robot_is_shown_when_its_description_is_set(network: Network, meshes: Meshes) -> None:
    robot, page = network.node("robot"), network.node("page")
    frames = Frames(page)
    display = RobotDisplay(page, Look("robot"), frames, meshes)
    display.refresh("base")
    assert parts(display.encoded()[0]) == []
    assert display.fault == "no parameter '/robot_description' holds the URDF of a robot"
    robot.params.set("/robot_description", URDF)

    def drawn() -> bool:
        return display.refresh("base") and len(parts(display.encoded()[0])) == 1

    eventually(drawn, "the base, whose frame is the fixed one")
    assert "no transform to 'base' of 1 links (wheel)" in display.fault
    display.close()
    frames.close()
