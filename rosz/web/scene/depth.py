"""Depth images as points in space, by the calibration of their camera."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rosz.errors import RoszError, UsageError
from rosz.introspect import find_token, topic_types
from rosz.lifecycle import Closable
from rosz.transforms import Pose
from rosz.web.model import TopicWatch
from rosz.web.scene.display import SceneSources, TopicDisplay
from rosz.web.scene.drawing import Array, Drawing, moved
from rosz.web.scene.sensors import MOST_POINTS, draw_points
from rosz.web.scene.setup import DEPTH, Look

_METRES = {"32FC1": 1.0, "16UC1": 0.001, "mono16": 0.001}
_FORMATS = {"32FC1": "f4", "16UC1": "u2", "mono16": "u2"}


def info_of(topic: str) -> str:
    """Return the topic of the CameraInfo beside an image."""
    return f"{topic.rpartition('/')[0]}/camera_info"


class DepthDisplay(TopicDisplay):
    """The newest depth image of a topic as points, in the colors of another image.

    The name of the display is ``depth:`` and the topic.
    """

    def __init__(self, sources: SceneSources, look: Look) -> None:
        node, survey = sources.node, sources.survey
        topic = look.name.removeprefix(DEPTH + ":")
        self._info_topic = info_of(topic)
        for topic_name in filter(None, (self._info_topic, look.image)):
            find_token(survey.view, topic_name, topic_types(survey.view).get(topic_name, ("",))[0])
        self._open: Callable[[str], TopicWatch] = lambda name: TopicWatch(node, survey, name)
        self._watches: list[TopicWatch] = []
        super().__init__(sources, look, topic, self._draw_depth)
        self.kind = "DepthCloud"

    def _subscribe(self) -> Sequence[Closable]:
        try:
            for name in filter(None, (self._info_topic, self.look.image)):
                self._watches.append(self._open(name))
            return super()._subscribe()
        except RoszError:
            self._close_watches()
            raise

    def _unsubscribe(self) -> None:
        super()._unsubscribe()
        self._close_watches()

    def _draw_depth(self, message: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
        info, *images = [watch.message() for watch in self._watches] or [None]
        if info is None:
            raise UsageError(f"no calibration of the camera has come on '{self._info_topic}'")
        return draw_depth(message, info, images[0] if images else None, pose, look, drawing)

    def _close_watches(self) -> None:
        watches, self._watches = self._watches, []
        for watch in watches:
            watch.close()


def draw_depth(depth: Any, info: Any, image: Any, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw a depth image as points.

    Args:
        depth: An Image, in metres (32FC1) or millimetres (16UC1).
        info: The CameraInfo.
        image: An Image or CompressedImage with the colors; None for none.
        pose: Pose of the camera in the fixed frame.
        look: Settings of the display.
        drawing: The drawing.

    Raises:
        UsageError: The image is not one of depths, or the camera is not calibrated.
        MessageError: The image with the colors is none.
    """
    rows = _depths(depth)
    if not (info.k[0] and info.k[4] and info.width and info.height):
        raise UsageError("the camera is not calibrated: its k or its size is 0")
    step = int(np.ceil(np.sqrt(rows.size / MOST_POINTS))) or 1
    v, u = np.mgrid[0 : depth.height : step, 0 : depth.width : step]
    z = rows[::step, ::step]
    valid = np.isfinite(z) & (z > 0)
    u, v, z = u[valid], v[valid], z[valid]
    # An image of another size than that of the calibration is binned.
    across, down = depth.width / info.width, depth.height / info.height
    x = (u - info.k[2] * across) / (info.k[0] * across) * z
    y = (v - info.k[5] * down) / (info.k[4] * down) * z
    own = None if image is None else _colors(image, u / depth.width, v / depth.height)
    draw_points(moved(np.column_stack((x, y, z)), pose), None, own, look, drawing)
    part = f"every {step}th row and column, " if step > 1 else ""
    return f"{part}{len(z)} of {depth.width} x {depth.height} points"


def _depths(image: Any) -> Array:
    """Return the depths of an image in metres."""
    if image.encoding not in _FORMATS:
        raise UsageError(
            f"the encoding is '{image.encoding}'; expected a depth: {', '.join(_FORMATS)}"
        )
    kind = np.dtype((">" if image.is_bigendian else "<") + _FORMATS[image.encoding])
    needed = image.step * image.height
    if len(image.data) < needed or image.step < image.width * kind.itemsize:
        raise UsageError(f"the image has {len(image.data)} bytes of data; expected {needed}")
    lines = np.frombuffer(image.data, np.uint8, needed).reshape(image.height, image.step)
    packed = np.ascontiguousarray(lines[:, : image.width * kind.itemsize])
    depths: Array = packed.view(kind).astype(np.float32) * _METRES[image.encoding]
    return depths


def _colors(image: Any, across: Array, down: Array) -> Array:
    """Return the colors of an image at parts of its width and height."""
    try:
        from rosz.images import pixels
    except ImportError as error:
        raise UsageError("pictures need libraries: pip install 'rosz[vision]'") from error
    picture = pixels(image, deep=False)
    height, width = picture.shape[:2]
    at = (down * height).astype(int), (across * width).astype(int)
    colors = np.full((len(across), 4), 255, dtype=np.uint8)
    colors[:, :3] = picture[at][:, ::-1] if picture.ndim > 2 else picture[at][:, None]  # noqa: PLR2004
    return colors
