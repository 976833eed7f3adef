"""Maps, and the updates of parts of them that come beside (``/map`` and ``/map_updates``)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rosz.errors import UsageError
from rosz.lifecycle import Closable
from rosz.msgs.map_msgs.msg import OccupancyGridUpdate
from rosz.transforms import Pose, compose
from rosz.web.scene.display import ReceivingDisplay, SceneSources
from rosz.web.scene.drawing import Array, Drawing, placed
from rosz.web.scene.poses import pose_from
from rosz.web.scene.setup import Look

MAP_TYPE = "nav_msgs/OccupancyGrid"
UPDATES = "_updates"
"""Suffix that the topic of a map gets for the topic of its updates."""
_MOST_CELLS = 4096
_QUEUE = 10


class MapDisplay(ReceivingDisplay):
    """The newest map of a topic, with the updates since.

    It stays where its frame is now, not where it was when the map was made. ``unseen`` is the
    reason why the page may not receive updates; empty if it may.
    """

    def __init__(self, sources: SceneSources, look: Look, unseen: str = "") -> None:
        super().__init__(sources, look)
        self._unseen = unseen
        self._map: Any = None
        self._rows: Array = np.zeros((0, 0), np.uint8)
        self._updates = 0
        self._refused = unseen
        self._place: tuple[str, Pose] | None = None

    def _receive(self, message: Any) -> None:
        with self._lock:
            self._version += 1
            self._map, self._updates, self._refused = None, 0, self._unseen
            try:
                size = message.info.width, message.info.height
                self._rows = read_cells(message.data, *size, "map")
            except UsageError as error:
                self._refused = str(error)
                return
            self._map = message

    def _update(self, message: Any) -> None:
        with self._lock:
            if self._map is None:
                return
            self._version += 1
            try:
                update_cells(self._rows, message)
            except UsageError as error:
                self._refused = str(error)
                return
            self._updates += 1

    def refresh(self, fixed: str) -> bool:
        """Return whether the map changed or moved."""
        self._switch()
        with self._lock:
            grid, fault = self._map, self._refused
        if grid is not None:
            pose, why = self._frames.locate(fixed, grid.header.frame_id)
            if pose is not None:
                self._place = fixed, pose
            elif self._place is not None and self._place[0] != fixed:
                self._place = None
            fault = why or fault
        self.fault = fault
        return self._shown != (self.look, self._version, self._place)

    def _subscribe(self) -> Sequence[Closable]:
        subscribe, topic = self._node.subscription, self.look.name
        grids = subscribe(topic, self._cls, self._receive, queue_size=_QUEUE)
        if self._unseen:
            return (grids,)
        updates = subscribe(topic + UPDATES, OccupancyGridUpdate, self._update, queue_size=_QUEUE)
        return grids, updates

    def _forget(self) -> None:
        self._map, self._place, self.status = None, None, ""

    def _draw_all(self, drawing: Drawing) -> None:
        with self._lock:
            place = self._place
            self._shown = self.look, self._version, place
            grid, updates = self._map, self._updates
            rows = self._rows.copy() if grid is not None else self._rows
        if grid is not None and place is not None and self.look.visible:
            text = draw_map(grid.info, rows, place[1], self.look, drawing)
            self.status = f"{text}, {updates} updates" if updates else text


def update_cells(rows: Array, update: Any) -> None:
    """Write an update into the cells of a map.

    Raises:
        UsageError: It is not within the map, or the number of its cells is not that of its size.
    """
    part = read_cells(update.data, update.width, update.height, "update of the map")
    x, y = update.x, update.y
    height, width = rows.shape
    if x < 0 or y < 0 or x + update.width > width or y + update.height > height:
        raise UsageError(
            f"an update of {update.width} x {update.height} cells at ({x}, {y}) is not within the"
            f" map of {width} x {height} cells"
        )
    rows[y : y + update.height, x : x + update.width] = part


def read_cells(data: Any, width: int, height: int, what: str) -> Array:
    """Return the cells of a map as bytes, in rows along x.

    Raises:
        UsageError: The number of cells is not that of the size.
    """
    cells = np.frombuffer(_bytes_of(data), np.uint8)
    if len(cells) != width * height:
        raise UsageError(f"the {what} has {len(cells)} cells; expected {width} x {height}")
    return cells.reshape(height, width).copy()


def _bytes_of(data: Any) -> bytes:
    """Return a sequence of int8 as bytes."""
    if isinstance(data, bytes | bytearray | memoryview):
        return bytes(data)
    return np.asarray(data).astype(np.int8).tobytes()


def draw_map(info: Any, rows: Array, pose: Pose, look: Look, drawing: Drawing) -> str:
    """Draw the cells of an OccupancyGrid by its MapMetaData, with the colors of rviz."""
    if not rows.size:
        return "0 cells"
    step = -(-max(rows.shape) // _MOST_CELLS)
    place = compose(pose, pose_from(info.origin))
    width, height = info.width * info.resolution, info.height * info.resolution
    palette = (_COSTS if look.color == "costmap" else _PALETTE).copy()
    drawing.image(rows[::step, ::step], placed(place, width, height), palette)
    part = f", every {step}th is drawn" if step > 1 else ""
    return f"{info.width} x {info.height} cells of {info.resolution:g} m{part}"


def _map_palette() -> Array:
    palette = np.full((256, 4), 255, dtype=np.uint8)
    gray = 255 - np.arange(101) * 255 // 100
    palette[:101, :3] = gray[:, None]
    palette[101:128, :3] = (0, 255, 0)
    palette[128:255, 0] = 255
    palette[128:255, 1] = np.arange(127) * 255 // 126
    palette[128:255, 2] = 0
    palette[255] = (112, 137, 134, 255)
    return palette


def _cost_palette() -> Array:
    palette = _map_palette()
    palette[0] = (0, 0, 0, 0)
    part = np.arange(1, 99)
    palette[1:99, 0], palette[1:99, 1] = part * 255 // 100, 0
    palette[1:99, 2] = 255 - part * 255 // 100
    palette[99], palette[100] = (0, 255, 255, 255), (255, 0, 255, 255)
    return palette


_PALETTE, _COSTS = _map_palette(), _cost_palette()
