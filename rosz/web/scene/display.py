"""One display: the messages that it receives while it is shown, and its newest drawing."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from rosz.errors import MessageError, RoszError, TransformError
from rosz.introspect import Survey, find_class, find_token, read_stamp, topic_types
from rosz.lifecycle import Closable
from rosz.names import short_type
from rosz.node import Node
from rosz.queue import BoundedQueue
from rosz.transforms import IDENTITY, Pose
from rosz.web.model import Frames, ImageWatch, read_frame
from rosz.web.scene import poses, sensors
from rosz.web.scene.drawing import MEDIA, Drawing, color_bytes
from rosz.web.scene.meshes import Meshes
from rosz.web.scene.setup import Look
from rosz.web.scene.shapes import draw_axes

_QUEUE = 10
_MOST_BYTES = 32 << 20

_Draw = Callable[[Any, Pose, Look, Drawing], str]
_DRAW: dict[str, _Draw] = {
    "geometry_msgs/AccelStamped": partial(poses.draw_pair, ("accel", "linear", "angular")),
    "geometry_msgs/Point": poses.draw_point,
    "geometry_msgs/PointStamped": poses.draw_point,
    "geometry_msgs/Polygon": poses.draw_polygon,
    "geometry_msgs/PolygonStamped": poses.draw_polygon,
    "geometry_msgs/Pose": poses.draw_pose,
    "geometry_msgs/PoseArray": poses.draw_poses,
    "geometry_msgs/PoseStamped": poses.draw_stamped_pose,
    "geometry_msgs/PoseWithCovarianceStamped": poses.draw_stamped_pose,
    "geometry_msgs/TwistStamped": partial(poses.draw_pair, ("twist", "linear", "angular")),
    "geometry_msgs/WrenchStamped": partial(poses.draw_pair, ("wrench", "force", "torque")),
    "jsk_recognition_msgs/BoundingBox": poses.draw_boxes,
    "jsk_recognition_msgs/BoundingBoxArray": poses.draw_boxes,
    "jsk_recognition_msgs/PolygonArray": poses.draw_polygons,
    "nav_msgs/GridCells": poses.draw_cells,
    "nav_msgs/Odometry": poses.draw_stamped_pose,
    "nav_msgs/Path": poses.draw_path,
    "sensor_msgs/CameraInfo": sensors.draw_camera,
    "sensor_msgs/Imu": poses.draw_imu,
    "sensor_msgs/LaserScan": sensors.draw_scan,
    "sensor_msgs/PointCloud": sensors.draw_old_cloud,
    "sensor_msgs/PointCloud2": sensors.draw_cloud,
    "sensor_msgs/Range": sensors.draw_range,
}
DRAWN_TYPES = frozenset(_DRAW)


class SceneSources(NamedTuple):
    """Sources of the drawings of displays.

    Attributes:
        node: Node that subscribes to the topics.
        survey: The running nodes.
        frames: Frames between which positions are transformed.
        meshes: Meshes that drawings refer to.
    """

    node: Node
    survey: Survey
    frames: Frames
    meshes: Meshes


class Display:
    """A part of the view that draws one topic, the grid, the frames or the robot.

    Args:
        look: Its settings.
        kind: Type of its messages, or ``Grid``, ``Frames`` or ``Robot``.

    Attributes:
        look: As given, or as changed since.
        kind: As given.
        status: Description of its present drawing.
        fault: Reason why it draws nothing; empty if it draws.
    """

    def __init__(self, look: Look, kind: str) -> None:
        self.look = look
        self.kind = kind
        self.status: str = ""
        self.fault: str = ""
        self._lock = threading.Lock()
        self._version = 0
        self._shown: object = None
        self._subscriptions: Sequence[Closable] = ()

    def refresh(self, fixed: str) -> bool:
        """Return whether there is something new to draw in a fixed frame."""
        raise NotImplementedError

    def encoded(self) -> tuple[bytes, str]:
        """Return the newest drawing and its media type."""
        drawing = Drawing()
        with np.errstate(all="ignore"):  # sensors send infinite and absurd values
            self._draw_all(drawing)
        return drawing.encode(), MEDIA

    def _draw_all(self, drawing: Drawing) -> None:
        raise NotImplementedError

    def _subscribe(self) -> Sequence[Closable]:
        """Return the subscriptions that it has while it is shown."""
        return ()

    def _forget(self) -> None:
        """Forget all messages, with the lock."""

    def _switch(self) -> None:
        """Subscribe when it is shown, and unsubscribe when it is hidden."""
        if self.look.visible == bool(self._subscriptions):
            return
        if self.look.visible:
            self._subscriptions = self._subscribe()
            return
        self._unsubscribe()
        with self._lock:
            self._forget()
            self._version += 1

    def _unsubscribe(self) -> None:
        subscriptions, self._subscriptions = self._subscriptions, ()
        for subscription in subscriptions:
            subscription.close()

    def close(self) -> None:
        """Unsubscribe."""
        self._unsubscribe()


class FrameDisplay(Display):
    """The axes, names and ages of all frames.

    Args:
        look: Its settings; the size is the length of an axis in metres.
        frames: The frames.
    """

    _OLD = 1.0

    def __init__(self, look: Look, frames: Frames) -> None:
        super().__init__(look, "Frames")
        self._frames = frames
        self._fixed = ""

    def refresh(self, fixed: str) -> bool:
        """Return whether a frame moved."""
        self._fixed = fixed
        return self._shown != (self.look, fixed, self._frames.version)

    def _draw_all(self, drawing: Drawing) -> None:
        look, fixed = self.look, self._fixed
        self._shown = look, fixed, self._frames.version
        if not look.visible:
            return
        missing: list[str] = []
        length = look.size or 0.3
        ends: list[tuple[float, float, float]] = []
        histories = self._frames.buffer.histories()
        places: dict[str, Pose] = {}
        for name in self._frames.buffer.frames():
            try:
                places[name] = self._frames.find(fixed, name)
            except TransformError:
                missing.append(name)
        for name, pose in places.items():
            age = self._frames.age(name)
            old = age is not None and age > self._OLD
            text = f"{name} ({age:.0f} s old)" if old else name
            drawing.text(text, pose.translation, "#d0762a" if old else "")
            parent = histories[name].newest.parent if name in histories else ""
            if parent in places:
                ends += [pose.translation, places[parent].translation]
        draw_axes(drawing, list(places.values()), length)
        if ends:
            drawing.lines(np.array(ends), color_bytes("#c9a227"))
        self.status = f"{len(places)} frames"
        some = ", ".join(missing[:3]) + (" …" if len(missing) > 3 else "")  # noqa: PLR2004
        self.fault = f"not connected with '{fixed}': {some}" if missing else ""
        if not places and not missing:
            self.fault = (
                "no frame is known: start a node that sends transforms, such as"
                " robot_state_publisher or static_transform_publisher"
            )


class ImageDisplay(Display):
    """The newest image of a topic, beside the view.

    Raises:
        NotFoundError: The topic does not exist.
        UsageError: A library is not installed.
    """

    def __init__(self, sources: SceneSources, look: Look) -> None:
        node, survey = sources.node, sources.survey
        self._open: Callable[[], ImageWatch] = lambda: ImageWatch(node, survey, look.name)
        watch = self._open()
        super().__init__(look, short_type(watch.type_name))
        self._watch: ImageWatch | None = watch
        self._subscriptions = (watch,)
        self._shown = 0
        self._switch()

    def _subscribe(self) -> Sequence[Closable]:
        self._watch, self._shown = self._open(), 0
        return (self._watch,)

    def _forget(self) -> None:
        self._watch, self.status = None, ""

    def refresh(self, fixed: str) -> bool:
        """Return whether there is a new image."""
        del fixed
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
            picture = watch.encoded()
        except MessageError as error:
            self.fault = str(error)
            raise
        self.fault = ""
        return picture


class ReceivingDisplay(Display):
    """A display of the messages of one topic.

    Args:
        sources: The node that subscribes to it, and what it draws with.
        look: Its settings.
        topic: Full name of the topic; that of the display by default.

    Raises:
        NotFoundError: The topic does not exist.
        TypeNotFound: Its type is not known here.
        DefinitionError: Its definition differs from the one here.
    """

    def __init__(self, sources: SceneSources, look: Look, topic: str = "") -> None:
        self._node, survey, self._frames, self._meshes = sources
        self._topic = topic = topic or look.name
        token = find_token(survey.view, topic, topic_types(survey.view).get(topic, ("",))[0])
        super().__init__(look, short_type(token.type_name))
        self._cls: Any = find_class(self._node, token)

    def _find(
        self, fixed: str, header: Any, faults: Counter[str], *, latest: bool = False
    ) -> Pose | None:
        """Return the pose of the frame of a header; None, with the reason counted, if unknown."""
        stamp = 0 if latest else header.stamp.to_nsec()
        pose, why = self._frames.locate(fixed, header.frame_id, stamp)
        if pose is None:
            faults[why] += 1
        return pose

    def _report(self, faults: Counter[str], *reasons: str) -> None:
        """Show why parts are not drawn: two of the faults of frames, and other reasons."""
        texts = [f"{count} not drawn: {why}" for why, count in faults.items()]
        self.fault = "; ".join(filter(None, [*texts[:2], *reasons]))


class _Kept(NamedTuple):
    """A message that has come, as bytes."""

    payload: bytes
    frame: str
    stamp: int
    number: int


class TopicDisplay(ReceivingDisplay):
    """The newest message of a topic whose transform is known.

    A transform may come later than the message that needs it, so that some messages are kept.
    A function that draws a message may take the place of the one for its type.
    """

    def __init__(
        self, sources: SceneSources, look: Look, topic: str = "", draw: _Draw | None = None
    ) -> None:
        super().__init__(sources, look, topic)
        self.received: int = 0
        self._draw = draw or _DRAW[self.kind]
        self._trail = poses.Trail() if self.kind == "nav_msgs/Odometry" else None
        self._stamped: bool = self._cls._has_header
        self._decode = self._node.context.decoder(self._cls)
        self._kept: BoundedQueue[_Kept] = BoundedQueue(_QUEUE, _MOST_BYTES)
        self._chosen: tuple[_Kept, Pose] | None = None
        self._wanted: object = None
        self._switch()

    def _subscribe(self) -> Sequence[Closable]:
        return (
            self._node.subscription(
                self._topic, self._cls, self._receive, queue_size=_QUEUE, raw=True
            ),
        )

    def _receive(self, payload: bytes) -> None:
        frame, stamp = "", 0
        if self._stamped:
            frame, stamp = read_frame(payload, self.kind), read_stamp(payload, self.kind)
        with self._lock:
            self.received += 1
            self._kept.put(_Kept(payload, frame, stamp, self.received), len(payload))
            if self._trail is not None:
                self._trail.add(self._decode(payload), self.look.keep)

    def refresh(self, fixed: str) -> bool:
        """Choose the newest message whose transform is known; return whether to draw it."""
        self._switch()
        with self._lock:
            kept = list(self._kept)
        fault = ""
        for sample in reversed(kept):
            if not self._stamped:
                return self._choose(fixed, sample, IDENTITY)
            pose, why = self._frames.locate(fixed, sample.frame, sample.stamp)
            if pose is None:
                fault = fault or why
                continue
            with self._lock:
                while self._kept and self._kept.oldest is not sample:
                    self._kept.pop()
            return self._choose(fixed, sample, pose)
        if kept:
            self.fault = fault
        return self._wanted != self._shown

    def _choose(self, fixed: str, sample: _Kept, pose: Pose) -> bool:
        self._chosen = sample, pose
        self._wanted = self.look, fixed, sample.number, pose
        return self._wanted != self._shown

    def _forget(self) -> None:
        self._kept.clear()
        if self._trail is not None:
            self._trail.clear()
        self._chosen, self.status, self.fault = None, "", ""
        self._wanted = (self.look,)

    def _draw_all(self, drawing: Drawing) -> None:
        chosen, look = self._chosen, self.look
        self._shown = self._wanted
        if chosen is not None and look.visible:
            sample, pose = chosen
            try:
                self.status = self._draw(self._decode(sample.payload), pose, look, drawing)
                if self._trail is not None:
                    with self._lock:
                        self.status += f", {self._trail.draw(pose, look, drawing)} kept"
                self.fault = ""
            except RoszError as error:
                self.fault = str(error)
