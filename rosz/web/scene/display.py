"""One display: what it receives while it is shown, and its newest drawing."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from rosz.errors import MessageError, RoszError, TransformError
from rosz.introspect.measure import read_stamp
from rosz.introspect.subscribe import find_class, find_token, topic_types
from rosz.names import short_type
from rosz.transforms import IDENTITY, Pose
from rosz.web.model import Frames, ImageWatch, read_frame
from rosz.web.scene import detections, poses, sensors, vectors
from rosz.web.scene.colors import color_bytes
from rosz.web.scene.drawing import MEDIA, Drawing
from rosz.web.scene.setup import Look
from rosz.web.scene.shapes import draw_axes

if TYPE_CHECKING:
    from rosz.introspect.survey import Survey
    from rosz.node import Node

__all__ = (
    "DRAWN_TYPES",
    "Display",
    "FrameDisplay",
    "ImageDisplay",
    "TopicDisplay",
)

_QUEUE = 10
_MOST_BYTES = 32 << 20

_Draw = Callable[[Any, Pose, Look, Drawing], str]
_DRAW: dict[str, _Draw] = {
    "geometry_msgs/AccelStamped": vectors.draw_accel,
    "geometry_msgs/Point": poses.draw_point,
    "geometry_msgs/PointStamped": poses.draw_point,
    "geometry_msgs/Polygon": poses.draw_polygon,
    "geometry_msgs/PolygonStamped": poses.draw_polygon,
    "geometry_msgs/Pose": poses.draw_pose,
    "geometry_msgs/PoseArray": poses.draw_poses,
    "geometry_msgs/PoseStamped": poses.draw_stamped_pose,
    "geometry_msgs/PoseWithCovarianceStamped": poses.draw_stamped_pose,
    "geometry_msgs/TwistStamped": vectors.draw_twist,
    "geometry_msgs/WrenchStamped": vectors.draw_wrench,
    "jsk_recognition_msgs/BoundingBox": detections.draw_box,
    "jsk_recognition_msgs/BoundingBoxArray": detections.draw_boxes,
    "jsk_recognition_msgs/PolygonArray": detections.draw_polygons,
    "nav_msgs/GridCells": poses.draw_cells,
    "nav_msgs/Odometry": poses.draw_stamped_pose,
    "nav_msgs/Path": poses.draw_path,
    "sensor_msgs/CameraInfo": sensors.draw_camera,
    "sensor_msgs/Imu": vectors.draw_imu,
    "sensor_msgs/LaserScan": sensors.draw_scan,
    "sensor_msgs/PointCloud": sensors.draw_old_cloud,
    "sensor_msgs/PointCloud2": sensors.draw_cloud,
    "sensor_msgs/Range": sensors.draw_range,
}
DRAWN_TYPES = frozenset(_DRAW)


class Display(Protocol):
    """A part of the view that draws one topic, the grid, the frames or the robot.

    Attributes:
        look: Its settings.
        kind: Type of its messages, or ``Grid``, ``Frames`` or ``Robot``.
        status: Description of its present drawing.
        fault: Reason why it draws nothing; empty if it draws.
    """

    look: Look
    kind: str
    status: str
    fault: str

    def refresh(self, fixed: str) -> bool:
        """Return whether there is something new to draw in a fixed frame."""

    def encoded(self) -> tuple[bytes, str]:
        """Return the newest drawing and its media type."""

    def close(self) -> None:
        """Unsubscribe."""


class FrameDisplay:
    """The axes, names and ages of all frames.

    Args:
        look: Its settings; the size is the length of an axis in metres.
        frames: The frames.
    """

    kind = "Frames"
    _OLD = 1.0

    def __init__(self, look: Look, frames: Frames) -> None:
        self.look = look
        self.status = ""
        self.fault = ""
        self._frames = frames
        self._fixed = ""
        self._shown: tuple[Look, str, int] | None = None

    def refresh(self, fixed: str) -> bool:
        """Return whether a frame moved."""
        self._fixed = fixed
        return self._shown != (self.look, fixed, self._frames.version)

    def encoded(self) -> tuple[bytes, str]:
        """Return the axes of all frames."""
        look, fixed = self.look, self._fixed
        self._shown = look, fixed, self._frames.version
        drawing = Drawing()
        if look.visible:
            self._draw(look, fixed, drawing)
        return drawing.encode(), MEDIA

    def _draw(self, look: Look, fixed: str, drawing: Drawing) -> None:
        found: list[Pose] = []
        missing: list[str] = []
        length = look.size or 0.3
        ends: list[tuple[float, float, float]] = []
        histories = self._frames.buffer.histories()
        places: dict[str, Pose] = {}
        for name in self._frames.names():
            try:
                places[name] = self._frames.find(fixed, name)
            except TransformError:
                missing.append(name)
        for name, pose in places.items():
            found.append(pose)
            age = self._frames.age(name)
            old = age is not None and age > self._OLD
            text = f"{name} ({age:.0f} s old)" if old else name
            drawing.text(text, pose.translation, "#d0762a" if old else "")
            parent = histories[name].newest.parent if name in histories else ""
            if parent in places:
                ends += [pose.translation, places[parent].translation]
        draw_axes(drawing, found, length)
        if ends:
            drawing.lines(np.array(ends), color_bytes("#c9a227"))
        self.status = f"{len(found)} frames"
        some = ", ".join(missing[:3]) + (" …" if len(missing) > 3 else "")  # noqa: PLR2004
        self.fault = f"not connected with '{fixed}': {some}" if missing else ""
        if not found and not missing:
            self.fault = (
                "no frame is known: start a node that sends transforms, such as"
                " robot_state_publisher or static_transform_publisher"
            )

    def close(self) -> None:
        """Do nothing; the frames belong to all pages."""


class ImageDisplay:
    """The newest image of a topic, beside the view.

    Args:
        node: The node that subscribes to it.
        survey: The running nodes.
        look: Its settings.

    Raises:
        NotFoundError: The topic does not exist.
        UsageError: A library is not installed.
    """

    def __init__(self, node: Node, survey: Survey, look: Look) -> None:
        self.look = look
        self.status = ""
        self.fault = ""
        self._open: Callable[[], ImageWatch] = lambda: ImageWatch(node, survey, look.name)
        self._watch: ImageWatch | None = self._open()
        self.kind: str = short_type(self._watch.type_name)
        self._shown = 0
        if not look.visible:
            self._switch()

    def _switch(self) -> None:
        """Subscribe when it is shown again, and unsubscribe when it is hidden."""
        watch, self._watch = self._watch, None
        if watch is None:
            self._watch, self._shown = self._open(), 0
        else:
            self.status = ""
            watch.close()

    def refresh(self, fixed: str) -> bool:
        """Return whether there is a new image."""
        del fixed
        if self.look.visible != (self._watch is not None):
            self._switch()
        watch = self._watch
        if watch is None or watch.received == self._shown:
            return False
        self._shown, self.status = watch.received, watch.description()
        return True

    def encoded(self) -> tuple[bytes, str]:
        """Return the newest image as a file.

        Raises:
            MessageError: The message is not an image, or none has come.
        """
        watch = self._watch
        if watch is None:
            raise MessageError(f"'{self.look.name}' is not shown")
        try:
            found = watch.encoded()
        except MessageError as error:
            self.fault = str(error)
            raise
        self.fault = ""
        return found

    def close(self) -> None:
        """Unsubscribe."""
        watch, self._watch = self._watch, None
        if watch is not None:
            watch.close()


class _Kept(NamedTuple):
    """A message that has come, as bytes."""

    payload: bytes
    frame: str
    stamp: int
    number: int


class TopicDisplay:
    """The newest message of a topic whose transform is known.

    A transform may come later than the message that needs it, so that some messages are kept.

    Args:
        node: The node that subscribes to it.
        survey: The running nodes.
        look: Its settings.
        frames: The frames.
        topic: Full name of the topic; that of the display by default.
        draw: Function that draws a message; the one for its type by default.

    Raises:
        NotFoundError: The topic does not exist.
        TypeNotFound: Its type is not known here.
        DefinitionError: Its definition differs from the one here.
    """

    def __init__(
        self,
        node: Node,
        survey: Survey,
        look: Look,
        frames: Frames,
        topic: str = "",
        draw: _Draw | None = None,
    ) -> None:
        self._topic = topic = topic or look.name
        token = find_token(survey.view, topic, topic_types(survey.view).get(topic, ("",))[0])
        cls = find_class(node.context, token)
        self.look = look
        self.kind: str = short_type(token.type_name)
        self.status: str = ""
        self.fault: str = ""
        self.received: int = 0
        self._draw = draw or _DRAW[self.kind]
        self._trail = poses.Trail() if self.kind == "nav_msgs/Odometry" else None
        self._frames = frames
        self._stamped: bool = cls._has_header
        self._decode = node.context.decoder(cls)
        self._lock = threading.Lock()
        self._kept: deque[_Kept] = deque(maxlen=_QUEUE)
        self._bytes = 0
        self._chosen: tuple[_Kept, Pose] | None = None
        self._wanted: tuple[Any, ...] = ()
        self._shown: tuple[Any, ...] = ()
        self._node = node
        self._cls = cls
        self._subscription: Any = None
        if look.visible:
            self._subscribe()

    def _subscribe(self) -> None:
        self._subscription = self._node.subscription(
            self._topic, self._cls, self._receive, queue_size=_QUEUE, raw=True
        )

    def _receive(self, payload: bytes) -> None:
        frame, stamp = "", 0
        if self._stamped:
            frame, stamp = read_frame(payload, self.kind), read_stamp(payload, self.kind)
        with self._lock:
            self.received += 1
            self._kept.append(_Kept(payload, frame, stamp, self.received))
            while len(self._kept) > 1 and sum(len(one.payload) for one in self._kept) > _MOST_BYTES:
                self._kept.popleft()
            if self._trail is not None:
                self._trail.add(self._decode(payload), self.look.keep)

    def refresh(self, fixed: str) -> bool:
        """Choose the newest message whose transform is known; return whether to draw it."""
        if self.look.visible != (self._subscription is not None):
            self._switch()
        with self._lock:
            kept = list(self._kept)
        for number in range(len(kept) - 1, -1, -1):
            one = kept[number]
            if not self._stamped:
                return self._choose(fixed, one, IDENTITY)
            try:
                pose = self._frames.find(fixed, one.frame, one.stamp)
            except TransformError:
                continue
            with self._lock:
                while self._kept and self._kept[0] is not one:
                    self._kept.popleft()
            return self._choose(fixed, one, pose)
        if kept:
            self.fault = self._frames.why_not(fixed, kept[-1].frame, kept[-1].stamp)
        return self._wanted != self._shown

    def _choose(self, fixed: str, one: _Kept, pose: Pose) -> bool:
        self._chosen = one, pose
        self._wanted = self.look, fixed, one.number, pose
        return self._wanted != self._shown

    def _switch(self) -> None:
        """Subscribe when it is shown again, and unsubscribe when it is hidden."""
        if self.look.visible:
            self._subscribe()
            return
        self._unsubscribe()
        with self._lock:
            self._kept.clear()
            if self._trail is not None:
                self._trail.clear()
        self._chosen, self.status, self.fault = None, "", ""
        self._wanted = (self.look,)

    def encoded(self) -> tuple[bytes, str]:
        """Return the drawing of the chosen message."""
        chosen, look = self._chosen, self.look
        self._shown = self._wanted
        drawing = Drawing()
        if chosen is not None and look.visible:
            one, pose = chosen
            try:
                self.status = self._draw(self._decode(one.payload), pose, look, drawing)
                if self._trail is not None:
                    with self._lock:
                        self.status += f", {self._trail.draw(pose, look, drawing)} kept"
                self.fault = ""
            except RoszError as error:
                self.fault = str(error)
        return drawing.encode(), MEDIA

    def _unsubscribe(self) -> None:
        subscription, self._subscription = self._subscription, None
        if subscription is not None:
            subscription.close()

    def close(self) -> None:
        """Unsubscribe."""
        self._unsubscribe()
