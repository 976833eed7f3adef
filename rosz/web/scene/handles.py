"""Interactive markers: handles that one moves, turns and presses, and that report it (rviz's)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec
import numpy as np

from rosz.errors import RoszError
from rosz.lifecycle import Closable
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Point, Quaternion, Vector3
from rosz.msgs.geometry_msgs.msg import Pose as PoseMessage
from rosz.msgs.std_msgs.msg import ColorRGBA, Header
from rosz.msgs.visualization_msgs import msg
from rosz.transforms import Pose, compose, invert
from rosz.web.scene.display import ReceivingDisplay, SceneSources
from rosz.web.scene.drawing import Drawing, matrix_of
from rosz.web.scene.markers import draw_marker
from rosz.web.scene.poses import pose_from, rotation_from
from rosz.web.scene.setup import Look

HANDLE_TYPE = "visualization_msgs/InteractiveMarkerUpdate"
_UPDATE, _FULL, FEEDBACK = "update", "update_full", "feedback"
"""The last parts of the names of the topics of a server."""
_QUEUE = 100
_Control = msg.InteractiveMarkerControl
_Feedback = msg.InteractiveMarkerFeedback
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


class HandleDisplay(ReceivingDisplay):
    """The interactive markers of a server, by the topic of its updates.

    The node also reports the user's actions, unless there is an objection, which is shown.
    """

    def __init__(self, sources: SceneSources, look: Look, objection: str = "") -> None:
        super().__init__(sources, look)
        self._space = look.name.removesuffix(_UPDATE)
        self._objection = objection
        self._handles: dict[str, _Handle] = {}
        self._held = ""
        self._sequence = "", 0
        self._refused = ""
        self._publisher: Any = None
        if not objection:
            self._publisher = self._node.publisher(
                self._space + FEEDBACK, _Feedback, queue_size=_QUEUE
            )

    # Receiving messages.

    def _init(self, message: Any) -> None:
        with self._lock:
            server, newest = self._sequence
            if message.server_id == server and message.seq_num < newest:
                return  # of before an update that came first
            self._sequence = message.server_id, message.seq_num
            self._handles = {marker.name: _Handle(marker) for marker in message.markers}
            self._version += 1

    def _update(self, message: Any) -> None:
        if message.type != msg.InteractiveMarkerUpdate.UPDATE:
            return
        with self._lock:
            self._sequence = message.server_id, message.seq_num
            for change in message.markers:
                self._handles[change.name] = _Handle(change)
            for change in message.poses:
                if (handle := self._handles.get(change.name)) is not None:
                    handle.marker.header = change.header
                    if change.name == self._held:  # it takes the pose when it is let go
                        handle.wanted = pose_from(change.pose)
                    else:
                        handle.pose = pose_from(change.pose)
            for name in message.erases:
                self._handles.pop(name, None)
            self._version += 1

    # Drawing.

    def refresh(self, fixed: str) -> bool:
        """Find where the markers are; return whether there is something new to draw."""
        self._switch()
        faults: Counter[str] = Counter()
        with self._lock:
            for handle in self._handles.values():
                place = self._find(fixed, handle.marker.header, faults)
                self._version += place != handle.frame
                handle.frame = place
            self._report(faults, self._objection, self._refused)
            return self._shown != (self._version, self.look)

    def _subscribe(self) -> Sequence[Closable]:
        subscribe, space = self._node.subscription, self._space
        return (
            subscribe(
                space + _UPDATE, msg.InteractiveMarkerUpdate, self._update, queue_size=_QUEUE
            ),
            subscribe(space + _FULL, msg.InteractiveMarkerInit, self._init, queue_size=_QUEUE),
        )

    def _forget(self) -> None:
        self._handles.clear()
        self._sequence = "", 0

    def _draw_all(self, drawing: Drawing) -> None:
        """Draw all markers, with the actions that their parts allow."""
        faults: list[str] = []
        with self._lock:
            self._shown = self._version, self.look
            shown = [
                (handle, handle.frame)
                for handle in self._handles.values()
                if handle.frame is not None and self.look.visible
            ]
            for handle, frame in shown:
                faults += self._draw(handle, frame, drawing)
        self.status = ", ".join(handle.marker.name for handle, _ in shown) or "no markers"
        self._refused = faults[0] if faults else ""

    def _draw(self, handle: _Handle, frame: Pose, drawing: Drawing) -> list[str]:
        """Draw a marker, and return the reasons for the parts that are not drawn."""
        marker = handle.marker
        faults: list[str] = []
        pose, scale = compose(frame, handle.pose), marker.scale or 1.0
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
        """Return the data with which the browser moves a marker by a control; None if it cannot."""
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

    # The user's actions in the browser.

    def menu(self, name: str) -> list[msg.MenuEntry]:
        """Return the entries of the menu of a marker, all levels in one list."""
        with self._lock:
            handle = self._handles.get(name)
            return [] if handle is None else list(handle.marker.menu_entries)

    def take(self, drag: Held) -> None:
        """Move a marker, and report what happened to its server."""
        with self._lock:
            handle = self._handles.get(drag.marker)
            if handle is None or handle.frame is None or drag.event not in _EVENTS:
                return
            if drag.event in {"down", "move"}:
                self._held = drag.marker
            if drag.event == "move":
                handle.pose = compose(invert(handle.frame), Pose(drag.position, drag.rotation))
            report = _report(handle, handle.frame, drag)
            if drag.event == "up":
                self._held = ""
                handle.pose, handle.wanted = handle.wanted or handle.pose, None
            self._version += 1
        report.event_type = _EVENTS[drag.event]
        self._send(report)

    def choose(self, drag: Held, entry: int) -> None:
        """Report that an entry of the menu of a marker was chosen."""
        with self._lock:
            handle = self._handles.get(drag.marker)
            if handle is None or handle.frame is None:
                return
            report = _report(handle, handle.frame, drag)
        report.event_type, report.menu_entry_id = _Feedback.MENU_SELECT, entry
        self._send(report)

    def _send(self, report: Any) -> None:
        if self._publisher is not None:
            report.client_id = f"{self._node.name}{self.look.name}"
            self._publisher.publish(report)

    def close(self) -> None:
        """Unsubscribe, and withdraw the reports."""
        super().close()
        if self._publisher is not None:
            self._publisher.close()


def _report(handle: _Handle, frame: Pose, drag: Held) -> Any:
    """Return the feedback message of a marker, in the frame of its server."""
    header = handle.marker.header
    report = _Feedback(
        header=Header(stamp=Time.from_nsec(header.stamp.to_nsec()), frame_id=header.frame_id),
        marker_name=drag.marker,
        control_name=drag.control,
        pose=PoseMessage(Point(*handle.pose.translation), Quaternion(*handle.pose.rotation)),
    )
    if drag.point is not None:
        point = compose(invert(frame), Pose(drag.point, (0.0, 0.0, 0.0, 1.0)))
        report.mouse_point, report.mouse_point_valid = Point(*point.translation), True
    return report


def default_markers(control: Any, scale: float) -> Iterable[Any]:
    """Return the default appearance of a control without markers, as in rviz."""
    axis = np.abs(matrix_of(Pose((0.0, 0.0, 0.0), rotation_from(control.orientation)))[:3, 0])
    red, green, blue = (axis / axis.max()).tolist()
    color = ColorRGBA(red, green, blue, 0.5)
    pose = PoseMessage(Point(), Quaternion(*rotation_from(control.orientation)))
    mode = control.interaction_mode
    if mode == _Control.MOVE_AXIS:
        for side in (scale, -scale):
            yield msg.Marker(
                type=msg.Marker.ARROW,
                pose=pose,
                color=color,
                scale=Vector3(0.15 * scale, 0.25 * scale, 0.2 * scale),
                points=[Point(0.5 * side, 0, 0), Point(0.9 * side, 0, 0)],
            )
    elif mode in {_Control.MOVE_PLANE, _Control.ROTATE_AXIS, _Control.MOVE_ROTATE}:
        yield msg.Marker(
            type=msg.Marker.TRIANGLE_LIST,
            pose=pose,
            color=color,
            scale=Vector3(scale, scale, scale),
            points=_ring(),
        )
    elif mode == _Control.MENU:
        yield msg.Marker(
            type=msg.Marker.TEXT_VIEW_FACING,
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
