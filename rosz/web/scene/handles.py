"""Interactive markers: handles that one moves, turns and presses, and that report it (rviz's)."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from rosz.errors import RoszError, TransformError
from rosz.introspect.subscribe import find_class, find_token, topic_types
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Point, Quaternion, Vector3
from rosz.msgs.geometry_msgs.msg import Pose as PoseMessage
from rosz.msgs.std_msgs.msg import ColorRGBA, Header
from rosz.msgs.visualization_msgs.msg import (
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
    Marker,
    MenuEntry,
)
from rosz.names import short_type
from rosz.transforms import Pose, compose, invert
from rosz.web.model import Frames
from rosz.web.scene.drawing import MEDIA, Drawing, matrix_of
from rosz.web.scene.markers import draw_marker
from rosz.web.scene.meshes import Meshes
from rosz.web.scene.poses import pose_from, rotation_from
from rosz.web.scene.setup import Look

if TYPE_CHECKING:
    from rosz.introspect.survey import Survey
    from rosz.node import Node

__all__ = ("FEEDBACK", "HANDLE_TYPE", "HandleDisplay", "Held", "default_markers")

HANDLE_TYPE = "visualization_msgs/InteractiveMarkerUpdate"
_UPDATE, _FULL, FEEDBACK = "update", "update_full", "feedback"
"""The last parts of the names of the topics of a server."""
_QUEUE = 100
_Control = InteractiveMarkerControl
_Feedback = InteractiveMarkerFeedback
_EVENTS = {
    "down": _Feedback.MOUSE_DOWN,
    "move": _Feedback.POSE_UPDATE,
    "up": _Feedback.MOUSE_UP,
    "click": _Feedback.BUTTON_CLICK,
}
_TITLE_HEIGHT, _TITLE_PLACE = 0.15, 1.4
_RING = 36
_INNER, _OUTER = 0.5, 0.65
"""Radii of a ring, as parts of the scale of its marker."""


class Held(msgspec.Struct, frozen=True):
    """An event of a handle in the browser.

    Attributes:
        display: Name of the display.
        marker: Name of the interactive marker.
        control: Name of its control.
        event: ``down``, ``move``, ``up``, ``click`` or ``menu``.
        position: Position of the marker in the fixed frame.
        rotation: Rotation of the marker in the fixed frame.
        point: Where the pointer is in the fixed frame; None if that is not known.
    """

    display: str
    marker: str
    control: str
    event: str
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    point: tuple[float, float, float] | None = None


class _Handle:
    """An interactive marker, and where it is."""

    def __init__(self, marker: Any) -> None:
        self.marker = marker
        self.pose = pose_from(marker.pose)
        self.wanted: Pose | None = None
        self.frame: Pose | None = None

    def place(self, message: Any, *, held: bool) -> None:
        """Take a pose from the server; one that is held takes it when it is let go."""
        if held:
            self.wanted = pose_from(message)
        else:
            self.pose = pose_from(message)


class HandleDisplay:
    """The interactive markers of a server, by the topic of its updates.

    Args:
        node: The node that subscribes to it and reports what is done.
        survey: The running nodes.
        look: Its settings.
        frames: The frames.
        meshes: The meshes that markers name.
        objection: Reason why the page may not report; empty if it may.

    Raises:
        NotFoundError: The topic does not exist.
        DefinitionError: Its definition differs from the one here.
    """

    def __init__(
        self,
        node: Node,
        survey: Survey,
        look: Look,
        frames: Frames,
        meshes: Meshes,
        objection: str = "",
    ) -> None:
        token = find_token(survey.view, look.name, topic_types(survey.view)[look.name][0])
        find_class(node.context, token)
        self.look = look
        self.kind: str = short_type(token.type_name)
        self.status: str = ""
        self.fault: str = ""
        self._space = look.name.removesuffix(_UPDATE)
        self._node = node
        self._frames = frames
        self._meshes = meshes
        self._objection = objection
        self._lock = threading.Lock()
        self._handles: dict[str, _Handle] = {}
        self._held = ""
        self._sequence = "", 0
        self._version = 0
        self._refused = ""
        self._shown: tuple[Any, ...] = ()
        self._subscriptions: list[Any] = []
        self._publisher: Any = None
        if not objection:
            self._publisher = node.publisher(self._space + FEEDBACK, _Feedback, queue_size=_QUEUE)

    # Receiving messages.

    def _init(self, message: Any) -> None:
        with self._lock:
            server, newest = self._sequence
            if message.server_id == server and message.seq_num < newest:
                return  # of before an update that came first
            self._sequence = message.server_id, message.seq_num
            self._handles = {one.name: _Handle(one) for one in message.markers}
            self._version += 1

    def _update(self, message: Any) -> None:
        if message.type != InteractiveMarkerUpdate.UPDATE:
            return
        with self._lock:
            self._sequence = message.server_id, message.seq_num
            for one in message.markers:
                self._handles[one.name] = _Handle(one)
            for one in message.poses:
                if one.name in self._handles:
                    self._handles[one.name].marker.header = one.header
                    self._handles[one.name].place(one.pose, held=one.name == self._held)
            for name in message.erases:
                self._handles.pop(name, None)
            self._version += 1

    # Drawing.

    def refresh(self, fixed: str) -> bool:
        """Find where the markers are; return whether there is something new to draw."""
        if self.look.visible != bool(self._subscriptions):
            self._switch()
        faults: dict[str, int] = {}
        with self._lock:
            for one in self._handles.values():
                frame = one.marker.header.frame_id.removeprefix("/")
                stamp = one.marker.header.stamp.to_nsec()
                try:
                    place = self._frames.find(fixed, frame, stamp)
                except TransformError:
                    why = self._frames.why_not(fixed, frame, stamp)
                    faults[why] = faults.get(why, 0) + 1
                    place = None
                self._version += place != one.frame
                one.frame = place
            texts = [f"{count} not drawn: {why}" for why, count in faults.items()]
            said = (self._objection, self._refused)
            self.fault = "; ".join([*texts[:2], *(one for one in said if one)])
            return self._shown != (self._version, self.look)

    def _switch(self) -> None:
        """Subscribe when it is shown, and unsubscribe when it is hidden."""
        if self.look.visible:
            subscribe, space = self._node.subscription, self._space
            self._subscriptions = [
                subscribe(
                    space + _UPDATE, InteractiveMarkerUpdate, self._update, queue_size=_QUEUE
                ),
                subscribe(space + _FULL, InteractiveMarkerInit, self._init, queue_size=_QUEUE),
            ]
            return
        self._unsubscribe()
        with self._lock:
            self._handles.clear()
            self._sequence = "", 0
            self._version += 1

    def encoded(self) -> tuple[bytes, str]:
        """Return the drawing of all markers, with what one can do with their parts."""
        drawing = Drawing()
        faults: list[str] = []
        with self._lock:
            self._shown = self._version, self.look
            shown = [
                (one, one.frame)
                for one in self._handles.values()
                if one.frame is not None and self.look.visible
            ]
            for one, frame in shown:
                faults += self._draw(one, frame, drawing)
        self.status = ", ".join(one.marker.name for one, _ in shown) or "no markers"
        self._refused = faults[0] if faults else ""
        return drawing.encode(), MEDIA

    def _draw(self, one: _Handle, frame: Pose, drawing: Drawing) -> list[str]:
        """Draw a marker, and return what is not drawn."""
        marker = one.marker
        faults: list[str] = []
        pose, scale = compose(frame, one.pose), marker.scale or 1.0
        for control in marker.controls:
            base = pose
            if control.orientation_mode == _Control.FIXED:
                base = Pose(pose.translation, frame.rotation)
            drawing.handle = self._handle(marker, control, pose, base)
            for part in control.markers or default_markers(control, scale):
                try:
                    faults += draw_marker(part, base, self._meshes, drawing)
                except (RoszError, ValueError) as error:
                    faults.append(f"{marker.name}/{control.name}: {error}")
        drawing.handle = None
        if marker.description:
            x, y, z = pose.translation
            above = (x, y, z + _TITLE_PLACE * scale)
            drawing.text(marker.description, above, height=_TITLE_HEIGHT * scale)
        return faults

    def _handle(
        self, marker: Any, control: Any, pose: Pose, base: Pose
    ) -> dict[str, object] | None:
        """Return what the browser needs to move a marker by a control; None if it cannot."""
        if self._objection or control.interaction_mode == _Control.NONE:
            return None
        turned = Pose((0.0, 0.0, 0.0), rotation_from(control.orientation))
        axis = matrix_of(compose(Pose((0.0, 0.0, 0.0), base.rotation), turned))[:3, 0]
        return {
            "display": self.look.name,
            "marker": marker.name,
            "control": control.name,
            "mode": control.interaction_mode,
            "facing": control.orientation_mode == _Control.VIEW_FACING,
            "menu": bool(marker.menu_entries),
            "position": pose.translation,
            "rotation": pose.rotation,
            "axis": axis.tolist(),
        }

    # What one does in the browser.

    def menu(self, name: str) -> list[MenuEntry]:
        """Return the entries of the menu of a marker, all levels in one list."""
        with self._lock:
            one = self._handles.get(name)
            return [] if one is None else list(one.marker.menu_entries)

    def take(self, held: Held) -> None:
        """Move a marker, and report what happened to its server."""
        with self._lock:
            one = self._handles.get(held.marker)
            if one is None or one.frame is None or held.event not in _EVENTS:
                return
            if held.event in {"down", "move"}:
                self._held = held.marker
            if held.event == "move":
                one.pose = compose(invert(one.frame), Pose(held.position, held.rotation))
            report = _report(one, one.frame, held)
            if held.event == "up":
                self._held = ""
                one.pose, one.wanted = one.wanted or one.pose, None
            self._version += 1
        report.event_type = _EVENTS[held.event]
        self._send(report)

    def choose(self, held: Held, entry: int) -> None:
        """Report that an entry of the menu of a marker was chosen."""
        with self._lock:
            one = self._handles.get(held.marker)
            if one is None or one.frame is None:
                return
            report = _report(one, one.frame, held)
        report.event_type, report.menu_entry_id = _Feedback.MENU_SELECT, entry
        self._send(report)

    def _send(self, report: Any) -> None:
        if self._publisher is not None:
            report.client_id = f"{self._node.name}{self.look.name}"
            self._publisher.publish(report)

    def _unsubscribe(self) -> None:
        subscriptions, self._subscriptions = self._subscriptions, []
        for one in subscriptions:
            one.close()

    def close(self) -> None:
        """Unsubscribe, and withdraw the reports."""
        self._unsubscribe()
        if self._publisher is not None:
            self._publisher.close()


def _report(one: _Handle, frame: Pose, held: Held) -> Any:
    """Return what is reported of a marker, in the frame of its server."""
    header = one.marker.header
    report = _Feedback(
        header=Header(stamp=Time.from_nsec(header.stamp.to_nsec()), frame_id=header.frame_id),
        marker_name=held.marker,
        control_name=held.control,
        pose=PoseMessage(Point(*one.pose.translation), Quaternion(*one.pose.rotation)),
    )
    if held.point is not None:
        point = compose(invert(frame), Pose(held.point, (0.0, 0.0, 0.0, 1.0)))
        report.mouse_point, report.mouse_point_valid = Point(*point.translation), True
    return report


def default_markers(control: Any, scale: float) -> Iterable[Any]:
    """Return what a control looks like that says nothing of it, as in rviz.

    Args:
        control: The control.
        scale: Scale of its marker.
    """
    axis = np.abs(matrix_of(Pose((0.0, 0.0, 0.0), rotation_from(control.orientation)))[:3, 0])
    red, green, blue = (axis / axis.max()).tolist()
    color = ColorRGBA(red, green, blue, 0.5)
    pose = PoseMessage(Point(), Quaternion(*rotation_from(control.orientation)))
    mode = control.interaction_mode
    if mode == _Control.MOVE_AXIS:
        for side in (scale, -scale):
            yield Marker(
                type=Marker.ARROW,
                pose=pose,
                color=color,
                scale=Vector3(0.15 * scale, 0.25 * scale, 0.2 * scale),
                points=[Point(0.5 * side, 0, 0), Point(0.9 * side, 0, 0)],
            )
    elif mode in {_Control.MOVE_PLANE, _Control.ROTATE_AXIS, _Control.MOVE_ROTATE}:
        yield Marker(
            type=Marker.TRIANGLE_LIST,
            pose=pose,
            color=color,
            scale=Vector3(scale, scale, scale),
            points=_ring(),
        )
    elif mode == _Control.MENU:
        yield Marker(
            type=Marker.TEXT_VIEW_FACING,
            text=control.description or "menu",
            pose=PoseMessage(Point(0, 0, 1.2 * scale), Quaternion(0, 0, 0, 1)),
            color=ColorRGBA(0.5, 0.5, 0.5, 1.0),
            scale=Vector3(0, 0, _TITLE_HEIGHT * scale),
        )


def _ring() -> list[Point]:
    """Return the corners of the triangles of a ring around x."""
    turns = np.linspace(0, 2 * np.pi, _RING + 1)
    inner, outer = (
        [Point(0, r * float(np.cos(turn)), r * float(np.sin(turn))) for turn in turns]
        for r in (_INNER, _OUTER)
    )
    return [
        point
        for at in range(_RING)
        for point in (inner[at], outer[at], outer[at + 1], inner[at], outer[at + 1], inner[at + 1])
    ]
