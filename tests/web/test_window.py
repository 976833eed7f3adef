"""ROS 1's windows as pages: rqt_graph, rqt_plot, rviz and others."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from network import TIMEOUT, Network

import rosz.environment
from rosz.environment import Environment, package_index
from rosz.errors import UsageError
from rosz.names import resolve
from rosz.web.rviz_file import read_rviz
from rosz.web.scene import Look, SceneSetup
from rosz.web.window import WINDOWS, page_of

LONG = 4 * TIMEOUT
RVIZ = """
Panels:
  - Class: rviz/Displays
Visualization Manager:
  Class: ""
  Displays:
    - {Class: rviz/Grid, Name: Grid, Enabled: true, Cell Size: 0.5, Color: 160; 160; 164}
    - {Class: rviz/RobotModel, Name: Robot, Enabled: true, Robot Description: robot_description}
    - {Class: rviz/TF, Name: TF, Enabled: false, Marker Scale: 1}
    - {Class: rviz/Axes, Name: Axes, Length: 0.5, Radius: 0.05, Reference Frame: base_link}
    - {Class: rviz/Axes, Name: Axes, Length: 1, Radius: 0.1, Reference Frame: <Fixed Frame>}
    - {Class: rviz/Grid, Name: Fine, Cell Size: 0.1, Plane Cell Count: 100, Reference Frame: map}
    - {Class: moveit_rviz_plugin/MotionPlanning, Name: Planning, Robot Description: arm}
    - {Class: jsk_rviz_plugin/PolygonArray, Name: Planes, Topic: /planes}
    - {Class: rviz/Image, Name: Nothing, Image Topic: ""}
    - Class: rviz/Group
      Name: Sensors
      Displays:
        - {Class: rviz/LaserScan, Name: Scan, Topic: /scan, Color: 255; 0; 0, Size (Pixels): 5,
           Color Transformer: FlatColor, Enabled: true}
        - {Class: rviz/PointCloud2, Name: Cloud, Topic: cloud, Color Transformer: AxisColor}
        - {Class: rviz/Camera, Name: Camera, Image Topic: /image, Color: 1; 2; 3}
        - {Class: rviz/InteractiveMarkers, Name: Handles, Update Topic: /handles/update}
        - {Class: rviz/DepthCloud, Name: Depth, Depth Map Topic: /camera/depth/image_raw,
           Color Image Topic: camera/rgb}
        - {Class: rviz/Odometry, Name: Odometry, Topic: /odom, Keep: 30}
        - {Class: rviz/Pose, Name: Bad, Topic: /a b}
        - {Class: rviz/RobotModel, Name: Second, Robot Description: two, TF Prefix: tb3_1}
    - {Class: rviz/MarkerArray, Name: Markers, Marker Topic: /markers}
    - {Class: rviz/Map, Name: Costs, Topic: /costmap, Color Scheme: costmap}
    - {Class: rviz_default_plugins/Path, Name: Path, Topic: {Value: /plan}, Color: 25; 255; 0}
  Global Options:
    Fixed Frame: odom
  Views:
    Current: {Class: rviz/TopDownOrtho}
"""


def full(name: str) -> str:
    """Return the name in the namespace /ns, where a scan and images have other names."""
    remaps = {
        resolve(one, "/ns/window", {}): resolve(other, "/ns/window", {})
        for one, other in (("image", "/camera/image_raw"), ("/scan", "/base_scan"))
    }
    return resolve(name, "/ns/window", remaps)


def plain(name: str) -> str:
    return resolve(name, "/window", {})


@pytest.mark.parametrize(
    ("line", "page"),
    [
        ("rqt_graph", "/graph"),
        ("rqt_plot", "/plot"),
        ("rqt_plot /turtle1/pose/x:y /turtle2/pose/x", "/plot?fields=/turtle1/pose/x:y,"),
        ("rqt_plot turtle1/pose/x", "/plot?fields=/turtle1/pose/x"),
        ("rqt_plot -e --clear-config /a/data[0]", "/plot?fields=/a/data[0]"),
        ("rqt_image_view /camera/image_raw", "/images?topics=/camera/image_raw"),
        ("rqt_reconfigure", "/reconfigure"),
        ("rqt_gui -s rqt_graph", "/graph"),
        ("rqt_gui --standalone=rqt_plot/Plot --args /a/b", "/plot?fields=/a/b"),
        ("rqt_tf_tree", "/3d?show=grid,tf"),
        ("rviz", "/3d"),
        ("rviz -f base_link", "/3d?frame=base_link"),
        ("rviz -l --opengl 210", "/3d"),
        ("rqt -t -f -s rqt_rviz/RViz", "/3d"),
        ("rqt --standalone rqt_image_view /camera/depth", "/images?topics=/camera/depth"),
        ("rqt_reconfigure hsv_color_filter", "/reconfigure?server=/hsv_color_filter"),
        ("rqt_robot_steering /base/cmd_vel", "/drive?topic=/base/cmd_vel"),
        ("image_view", "/images?topics=/image"),
    ],
)
def test_what_is_written_leads_to_the_page(line: str, page: str) -> None:
    name, *words = line.split()
    found, notes = page_of(name, words, plain)
    assert found.startswith(page)
    assert notes == []


def test_names_are_resolved_and_remapped() -> None:
    for line, page in (
        ("image_view", "/images?topics=/camera/image_raw"),
        ("rqt_image_view", "/images?topics=/camera/image_raw"),
        ("rqt_image_view depth", "/images?topics=/ns/depth,/camera/image_raw"),
        ("rqt_plot pose/x:y", "/plot?fields=/ns/pose/x:y"),
    ):
        name, *words = line.split()
        assert page_of(name, words, full) == (page, [])


PERSPECTIVE = """{"keys": {}, "groups": {"mainwindow": {}, "pluginmanager": {
  "keys": {"running-plugins": {"type": "repr", "repr":
    "{u'rqt_image_view/ImageView': [1, 2], u'rqt_plot/Plot': [1], 'rqt_shell/Shell': [1]}"}},
  "groups": {
    "plugin__rqt_image_view__ImageView__1": {"groups": {"plugin": {"keys":
      {"topic": {"type": "repr", "repr": "u'/left/image'"}}}}},
    "plugin__rqt_image_view__ImageView__2": {"groups": {"plugin": {"keys":
      {"topic": {"type": "repr", "repr": "'/right/image'"}}}}},
    "plugin__rqt_plot__Plot__1": {"groups": {"plugin": {"keys":
      {"topics": {"type": "repr", "repr": "['/a/data', '/b/data[0]']"}}}}}
  }}}}"""


def test_a_perspective_of_rqt_is_its_plugins(tmp_path: Path) -> None:
    file = tmp_path / "images.perspective"
    file.write_text(PERSPECTIVE)
    assert page_of("rqt_gui", ["--perspective-file", str(file)], plain) == (
        "/images?topics=/left/image,/right/image",
        ["and at /plot?fields=/a/data,/b/data[0]", "not shown: rqt_shell/Shell"],
    )
    assert page_of("rqt", ["-s", "rqt_shell"], plain) == ("/", ["not shown: rqt_shell"])
    for text in ("{}", "[]", "[General]", '{"groups": {"pluginmanager": 1}}'):
        file.write_text(text)
        with pytest.raises(UsageError, match="is not a perspective of rqt"):
            page_of("rqt", [f"--perspective-file={file}"], plain)


def test_a_file_of_rviz_is_a_setup(tmp_path: Path) -> None:
    file = tmp_path / "robot.rviz"
    file.write_text(RVIZ)
    setup, left_out = read_rviz(file, plain)
    assert setup == SceneSetup(
        "odom",
        (
            Look("grid", size=0.5),
            Look("robot"),
            Look("tf", size=0.3, visible=False),
            Look("axes", size=0.5, frame="base_link", radius=0.05),
            Look("axes", size=1.0, radius=0.1),
            Look("grid", size=0.1, frame="map", cells=100),
            Look("robot:/arm"),
            Look("/planes"),
            Look("/scan", "#ff0000", 5),
            Look("/cloud", "height"),
            Look("/image"),
            Look("/handles/update"),
            Look("depth:/camera/depth/image_raw", image="/camera/rgb"),
            Look("/odom", keep=30),
            Look("robot:/two", prefix="tb3_1"),
            Look("/markers"),
            Look("/costmap", "costmap"),
            Look("/plan", "#19ff00"),
        ),
        "top",
    )
    assert left_out[:3] == [
        "Planning (moveit_rviz_plugin/MotionPlanning): only the robot is shown",
        "Nothing (rviz/Image): it names no topic",
        "Camera (rviz/Camera): the image is beside the view, and things in space are not drawn"
        " over it",
    ]
    assert left_out[3].startswith("Bad (rviz/Pose): ")
    looks = {one.name for one in read_rviz(file, full)[0].looks}
    assert {"/base_scan", "/ns/cloud", "robot:/ns/robot_description", "/image"} <= looks
    page, notes = page_of("rviz", ["-d", str(file), "-f", "map"], plain)
    assert page.startswith("/3d?frame=map&show=grid;size=0.5,robot,")
    assert notes == [f"not shown: {'; '.join(left_out)}"]


@pytest.mark.parametrize("text", ["[General]\nx=1", "a: [", "Panels: []", "- 1", "\x00"])
def test_a_file_that_is_none_of_rviz_is_named(tmp_path: Path, text: str) -> None:
    file = tmp_path / "robot.vcg"
    file.write_text(text)
    with pytest.raises(UsageError, match=re.escape(str(file))):
        page_of("rviz", ["-d", str(file)], plain)
    with pytest.raises(UsageError, match="No such file"):
        page_of("rviz", ["-d", str(tmp_path / "none.rviz")], plain)


def test_every_window_is_a_program_of_a_package() -> None:
    share = Path(__file__).parents[2] / "rosz" / "web" / "windows"
    for name in set(WINDOWS) - {"rqt"}:
        program = share / name / name
        assert os.access(program, os.X_OK)
        assert f'main("{name}")' in program.read_text()
        assert f"<name>{name}</name>" in (share / name / "package.xml").read_text()


@pytest.mark.system
def test_windows_open_where_a_page_is_served(network: Network) -> None:
    alone = network.run(
        "-m", "rosz", "run", "rqt_graph", "rqt_graph", DISPLAY="", WAYLAND_DISPLAY=""
    )
    found = re.search(r"the page is at (http://\S+:\d+)/graph", alone.wait_for("/graph", LONG))
    assert found is not None
    alone.wait_for("press Ctrl-C", LONG)
    second = network.run(
        "-m", "rosz", "run", "rqt_plot", "rqt_plot", "/a/data", DISPLAY="", WAYLAND_DISPLAY=""
    )
    assert second.exit_code(LONG) == 0
    assert second.output == f"the page is at {found[1]}/plot?fields=/a/data"
    file = network.folder / "my.launch"
    (network.folder / "my.rviz").write_text(RVIZ)
    file.write_text(
        '<launch><node pkg="rviz" type="rviz" name="rviz" required="true" output="screen"'
        ' args="-d $(dirname)/my.rviz"><remap from="scan" to="base_scan"/></node></launch>'
    )
    launch = network.run("-m", "rosz", "launch", str(file), DISPLAY="", WAYLAND_DISPLAY="")
    launch.wait_for(f"{found[1]}/3d?frame=odom&show=grid", LONG)
    assert "/base_scan;color=" in launch.output
    launch.wait_for("not shown: Planning (moveit_rviz_plugin/MotionPlanning): only", LONG)
    launch.wait_for("press Ctrl-C", LONG)


def test_an_installed_rviz_goes_first_where_there_is_a_screen(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "rviz").mkdir()
    (tmp_path / "rviz" / "package.xml").write_text("<package><name>rviz</name></package>")
    monkeypatch.setattr(rosz.environment, "SYSTEM", tmp_path)
    environment = Environment.read({"HOME": str(tmp_path)})
    for display, folder in (("", "windows"), (":0", tmp_path.name)):
        monkeypatch.setenv("DISPLAY", display)
        monkeypatch.setenv("WAYLAND_DISPLAY", "")
        packages = package_index(environment)
        assert packages.find("rviz").path.parent.name == folder
        assert packages.find("rqt_graph").path.parent.name == "windows"
        assert "rviz" not in packages.names()
