"""The files that rviz is started with (``-d``), as setups of the view in space."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import yaml

from rosz.errors import RoszError, UsageError
from rosz.web.scene import AXES, DEPTH, DESCRIPTION, GRID, ROBOT, TF, Look, SceneSetup

_TOPIC = "Topic"
_TOPICS = dict.fromkeys(
    (
        "AccelStamped",
        "BoundingBox",
        "BoundingBoxArray",
        "CameraInfo",
        "GridCells",
        "Imu",
        "LaserScan",
        "Map",
        "NormalDisplay",
        "Odometry",
        "Path",
        "PointCloud",
        "PointCloud2",
        "PointStamped",
        "Polygon",
        "PolygonArray",
        "Pose",
        "PoseArray",
        "PoseWithCovariance",
        "Range",
        "TwistStamped",
        "Wrench",
        "WrenchStamped",
    ),
    _TOPIC,
) | {
    "Camera": "Image Topic",
    "DepthCloud": "Depth Map Topic",
    "Image": "Image Topic",
    "InteractiveMarkers": "Update Topic",
    "Marker": "Marker Topic",
    "MarkerArray": "Marker Topic",
    "OverlayImage": _TOPIC,
}
"""The displays of rviz and its plugins that show one topic, and the key that names it."""
_PARTLY = {
    "Camera": "the image is beside the view, and things in space are not drawn over it",
    "MotionPlanning": "only the robot is shown",
    "NormalDisplay": "only the points are shown",
    "OverlayImage": "the image is beside the view",
    "PlanningScene": "only the robot is shown",
    "RobotState": "the robot is shown as its frames are",
    "Trajectory": "only the robot is shown",
}
_INSTEAD = {
    "Plotter2D": "see the page /plot",
    "OverlayText": "see the page /topics",
    "String": "see the page /topics",
    "Effort": "see the page /plot",
}
"""Hints for displays of rviz that are not shown."""
_COLORS = {"AxisColor": "height", "Intensity": "intensity", "RGB8": "rgb"}
_PICTURES = ("Camera", "Image", "OverlayImage")
_ROBOTS = ("MotionPlanning", "PlanningScene", "RobotModel", "RobotState", "Trajectory")
_CLOUDS = ("LaserScan", "NormalDisplay", "PointCloud", "PointCloud2")


def read_rviz(path: Path, resolve: Callable[[str], str]) -> tuple[SceneSetup, list[str]]:
    """Return the setup that a file of rviz describes, and the parts not shown, with reasons.

    Args:
        path: The file.
        resolve: Function that returns the full name of a topic, after remapping.

    Raises:
        UsageError: It cannot be read, or is not one of rviz.
    """
    try:
        content = yaml.safe_load(path.read_text())
        manager = content["Visualization Manager"]
        listed = list(_displays(manager.get("Displays") or []))
        options = manager.get("Global Options") or {}
        view = str(((manager.get("Views") or {}).get("Current") or {}).get("Class", ""))
    except (OSError, ValueError) as error:
        raise UsageError(f"cannot read '{path}': {error}") from error
    except (yaml.YAMLError, AttributeError, KeyError, TypeError) as error:
        raise UsageError(
            f"'{path}' is not a file of rviz: expected YAML with a 'Visualization Manager'"
        ) from error
    looks: list[Look] = []
    left_out: list[str] = []
    for display in listed:
        kind = str(display.get("Class", "")).rpartition("/")[2]
        try:
            look = _look(display, kind, resolve)
        except RoszError as error:
            left_out.append(f"{_title(display)}: {error}")
            continue
        why = _PARTLY.get(kind, "") if look is not None else _why_not(kind)
        if why:
            left_out.append(f"{_title(display)}: {why}")
        if look is not None and look not in looks:
            looks.append(look)
    frame = str(options.get("Fixed Frame", "")).removeprefix("/")
    above = "top" if view.endswith("TopDownOrtho") else "orbit"
    return SceneSetup("" if frame.startswith("<") else frame, tuple(looks), above), left_out


def _displays(listed: list[Any]) -> Iterator[dict[str, Any]]:
    for display in listed:
        if isinstance(display, dict):
            if str(display.get("Class", "")).endswith("/Group"):
                yield from _displays(display.get("Displays") or [])
            else:
                yield display


def _title(display: dict[str, Any]) -> str:
    return f"{display.get('Name', 'a display')} ({display.get('Class', 'no class')})"


def _why_not(kind: str) -> str:
    """Return why a display of rviz is not shown."""
    if kind in _TOPICS:
        return "it names no topic"
    return _INSTEAD.get(kind, "this page has no display of that class")


def _look(display: dict[str, Any], kind: str, resolve: Callable[[str], str]) -> Look | None:
    """Return the display of the view for one of rviz; None if there is none."""
    visible = bool(display.get("Enabled", True))
    if kind == "Grid":
        cells = int(_number(display.get("Plane Cell Count"), 0.0))
        size = _number(display.get("Cell Size"), 1.0)
        return Look(GRID, size=size, visible=visible, frame=_frame(display), cells=cells)
    if kind == "Axes":
        size, radius = _number(display.get("Length"), 0.0), _number(display.get("Radius"), 0.0)
        return Look(AXES, size=size, visible=visible, frame=_frame(display), radius=radius)
    if kind == "TF":
        return Look(TF, size=0.3 * _number(display.get("Marker Scale"), 0.0), visible=visible)
    if kind in _ROBOTS:
        name = resolve(str(display.get("Robot Description") or DESCRIPTION[1:]))
        prefix = str(display.get("TF Prefix") or "").strip("/")
        return Look(
            ROBOT if name == DESCRIPTION else f"{ROBOT}:{name}", visible=visible, prefix=prefix
        )
    topic = display.get(_TOPICS.get(kind, ""), display.get(_TOPIC, ""))
    if isinstance(topic, dict):  # a file of rviz2
        topic = topic.get("Value", "")
    if kind not in _TOPICS or not topic:
        return None
    image = str(display.get("Color Image Topic") or "")
    if kind == "DepthCloud" and image:
        image = resolve(image)
    return _look_at_topic(display, kind, resolve(str(topic)), image, visible=visible)


def _frame(display: dict[str, Any]) -> str:
    """Return the frame that a display is at; empty for the fixed one."""
    frame = str(display.get("Reference Frame") or "").removeprefix("/")
    return "" if frame.startswith("<") else frame


def _look_at_topic(
    display: dict[str, Any], kind: str, name: str, image: str, *, visible: bool
) -> Look:
    if kind == "DepthCloud":
        return Look(f"{DEPTH}:{name}", visible=visible, image=image)
    color, size = _color(display.get("Color")), 0.0
    if kind in _CLOUDS:
        color = _COLORS.get(str(display.get("Color Transformer", "")), color)
        size = _number(display.get("Size (Pixels)"), 0.0)
    elif kind == "Map":
        color = "costmap" if display.get("Color Scheme") == "costmap" else ""
    elif kind.startswith("Marker") or kind in _PICTURES:
        color = ""
    keep = int(_number(display.get("Keep"), 0.0)) if kind == "Odometry" else 0
    return Look(name, color, size, visible, keep=keep)


def _number(value: Any, default: float) -> float:
    return float(value) if isinstance(value, int | float) else default


def _color(value: Any) -> str:
    """Return ``255; 0; 0`` as ``#ff0000``; empty if it is not a color."""
    parts = str(value or "").split(";")
    try:
        numbers = [int(part) for part in parts]
        return f"#{bytes(numbers).hex()}" if len(numbers) == 3 else ""  # noqa: PLR2004
    except ValueError:
        return ""
