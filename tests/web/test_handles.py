"""Interactive markers: what is drawn of them, and what their server is told."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from network import TIMEOUT, Network, eventually

from rosz.access import PagePolicy
from rosz.environment import Environment
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import (
    Point,
    Pose,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
    Marker,
    MenuEntry,
)
from rosz.node import Node
from rosz.transforms import StaticTransformBroadcaster
from rosz.web.model import Frames, System
from rosz.web.scene import HandleDisplay, Held, Look, Meshes, open_display
from rosz.web.scene.handles import default_markers

from .test_scene import parts

Control = InteractiveMarkerControl
Feedback = InteractiveMarkerFeedback
FLAT = Quaternion(0, 0, 0, 1)
UP = Quaternion(0, math.sqrt(0.5), 0, math.sqrt(0.5))
"""The rotation that turns x against z."""


def marker(name: str, x: float, mode: int, *shapes: Marker) -> InteractiveMarker:
    control = Control(name="c", interaction_mode=mode, orientation=UP, markers=list(shapes))
    return InteractiveMarker(
        header=Header(frame_id="map"),
        pose=Pose(Point(x, 0, 0), FLAT),
        name=name,
        scale=2.0,
        controls=[control],
        menu_entries=[MenuEntry(id=1, title="Go")],
    )


def held(name: str, event: str, x: float = 0.0) -> Held:
    return Held("/h/update", name, "c", event, (x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (x, 1.0, 0.0))


def open_handles(page: Node, frames: Frames, permission: PagePolicy) -> HandleDisplay:
    """Return the display of the server in the namespace /h, once it is there."""
    system = System(page, permission)
    graph = system.graph.use().value
    eventually(lambda: graph.survey().view.publishers("/h/update"), "the server")
    meshes = Meshes(Environment.read({}), lambda _: "")
    display = open_display(system, graph.survey(), frames, meshes, Look("/h/update"))
    assert isinstance(display, HandleDisplay)
    return display


@pytest.mark.parametrize(
    ("mode", "kinds"),
    [
        (Control.MOVE_AXIS, [Marker.ARROW, Marker.ARROW]),
        (Control.ROTATE_AXIS, [Marker.TRIANGLE_LIST]),
        (Control.MOVE_PLANE, [Marker.TRIANGLE_LIST]),
        (Control.MENU, [Marker.TEXT_VIEW_FACING]),
        (Control.BUTTON, []),
    ],
)
def test_a_control_without_markers_has_those_of_rviz(mode: int, kinds: list[int]) -> None:
    control = Control(interaction_mode=mode, orientation=UP)
    found = list(default_markers(control, 2.0))
    assert [one.type for one in found] == kinds
    if found and mode != Control.MENU:
        assert np.allclose((found[0].color.r, found[0].color.g, found[0].color.b), (0, 0, 1))


def test_handles_are_drawn_and_moved(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    StaticTransformBroadcaster(robot).send(
        TransformStamped(
            Header(stamp=Time(1, 0), frame_id="odom"),
            "map",
            Transform(Vector3(10, 0, 0), FLAT),
        )
    )
    update = robot.publisher("h/update", InteractiveMarkerUpdate)
    full = robot.publisher("h/update_full", InteractiveMarkerInit, latch=True)
    got: list[Any] = []
    robot.subscription("h/feedback", Feedback, got.append)
    box = Marker(type=Marker.CUBE, scale=Vector3(1, 1, 1))
    full.publish(
        InteractiveMarkerInit("s", 1, [marker("a", 1.0, Control.MOVE_AXIS, box), marker("b", 2, 2)])
    )
    frames = Frames(page)
    display = open_handles(page, frames, PagePolicy())

    def cube() -> dict[str, Any] | None:
        display.refresh("odom")
        found = [one for one in parts(display.encoded()[0]) if one.get("shape") == "cube"]
        return found[0] if found else None

    def cube_at(x: float) -> bool:
        found = cube()
        return found is not None and bool(np.isclose(found["matrices"][0, 0, 3], x))

    eventually(lambda: cube_at(11.0), "the box")
    assert display.status == "a, b"
    handle = (cube() or {})["handle"]
    assert (handle["display"], handle["marker"], handle["control"]) == ("/h/update", "a", "c")
    assert (handle["mode"], handle["menu"], handle["position"]) == (3, True, [11.0, 0.0, 0.0])
    assert np.allclose(handle["axis"], (0, 0, -1), atol=1e-6)

    eventually(update.subscribers, "the subscription")
    page.context.graph.wait_for_subscribers("/h/feedback", 1, TIMEOUT)
    for one in (held("a", "down", 11.0), held("a", "move", 14.0)):
        display.take(one)
    assert cube_at(14.0)
    # The server says something else meanwhile: it holds when the handle is let go.
    place = InteractiveMarkerPose(Header(frame_id="map"), Pose(Point(5, 0, 0), FLAT), "a")
    update.publish(InteractiveMarkerUpdate("s", 2, InteractiveMarkerUpdate.UPDATE, [], [place]))
    eventually(lambda: display.refresh("odom"), "the update")
    assert cube_at(14.0)
    display.take(held("a", "up", 14.0))
    assert cube_at(15.0)
    display.take(held("b", "click", 12.0))
    display.choose(held("b", "menu", 12.0), 1)
    assert [one.title for one in display.menu("b")] == ["Go"]
    eventually(lambda: len(got) == 5, "the reports")
    assert [(one.marker_name, one.event_type, one.menu_entry_id) for one in got] == [
        ("a", Feedback.MOUSE_DOWN, 0),
        ("a", Feedback.POSE_UPDATE, 0),
        ("a", Feedback.MOUSE_UP, 0),
        ("b", Feedback.BUTTON_CLICK, 0),
        ("b", Feedback.MENU_SELECT, 1),
    ]
    assert [one.pose.position.x for one in got] == [1.0, 4.0, 4.0, 2.0, 2.0]
    assert (got[1].header.frame_id, got[1].mouse_point) == ("map", Point(4.0, 1.0, 0.0))

    update.publish(InteractiveMarkerUpdate("s", 3, InteractiveMarkerUpdate.UPDATE, erases=["a"]))
    eventually(lambda: cube() is None, "no box")
    # What a server sent before an update is old, and a server that is new begins afresh.
    display._init(InteractiveMarkerInit("s", 2, [marker("a", 1.0, 3, box)]))
    assert cube() is None
    display._init(InteractiveMarkerInit("t", 1, [marker("a", 1.0, 3, box)]))
    assert cube_at(11.0)
    display.look = Look("/h/update", visible=False)
    assert cube() is None
    eventually(lambda: not update.subscribers(), "no subscription while it is hidden")
    display.close()
    frames.close()


def test_a_page_that_may_not_publish_moves_nothing(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    full = robot.publisher("h/update_full", InteractiveMarkerInit, latch=True)
    robot.publisher("h/update", InteractiveMarkerUpdate)
    box = Marker(type=Marker.CUBE, scale=Vector3(1, 1, 1))
    full.publish(InteractiveMarkerInit("s", 1, [marker("a", 1.0, Control.MOVE_AXIS, box)]))
    frames = Frames(page)
    display = open_handles(page, frames, PagePolicy(read_only=True))

    def drawn() -> list[dict[str, Any]]:
        display.refresh("map")
        return parts(display.encoded()[0])

    eventually(drawn, "the box")
    assert "handle" not in drawn()[0]
    display.refresh("map")
    assert display.fault == "this page is read-only: it may not publish '/h/feedback'"
    display.close()
    frames.close()
