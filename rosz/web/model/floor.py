"""A robot on the floor from above: where its odometry says that it is, and what its laser sees."""

from __future__ import annotations

import math
import threading
from collections import deque
from typing import Any

from rosz.access import PagePolicy
from rosz.introspect import Survey
from rosz.names import namespace, short_type
from rosz.node import Node
from rosz.transforms import to_rpy

_CELL = 0.05
"""Size in metres of the squares in which one seen point is kept."""
_MOST_CELLS = 3000
_MOST_STEPS = 500
_LEAST_STEP = 0.02
_LEAST_SPAN = 3.0
_MARGIN = 0.4
_ROBOT = 0.105
"""Radius in metres of the circle that stands for the robot, which is that of a TurtleBot3."""
_TYPES = {"odom": "nav_msgs/Odometry", "scan": "sensor_msgs/LaserScan"}


class Surroundings:
    """The path of a robot and the points that its laser has seen; bounded in number.

    Attributes:
        pose: X and y in metres and heading in rad; None before the first one.
    """

    def __init__(self) -> None:
        self.pose: tuple[float, float, float] | None = None
        self.version: int = 0
        self.trail: deque[tuple[float, float]] = deque(maxlen=_MOST_STEPS)
        self.cells: dict[tuple[int, int], None] = {}
        self.beams: list[tuple[float, float]] = []

    def move(self, x: float, y: float, theta: float) -> None:
        """Note where the robot is."""
        if not all(map(math.isfinite, (x, y, theta))):
            return
        self.pose = (x, y, theta)
        self.version += 1
        if not self.trail or math.dist(self.trail[-1], (x, y)) > _LEAST_STEP:
            self.trail.append((x, y))

    def see(self, begin: float, step: float, ranges: Any, longest: float) -> None:
        """Add a scan; the laser is taken to be in the middle of the robot.

        Args:
            begin: Angle of the first beam in rad.
            step: Angle from one beam to the next in rad.
            ranges: Lengths of the beams in metres.
            longest: Length in metres beyond which a beam has met nothing.
        """
        if self.pose is None:
            return
        x, y, theta = self.pose
        self.beams = [
            (
                x + length * math.cos(theta + begin + number * step),
                y + length * math.sin(theta + begin + number * step),
            )
            for number, length in enumerate(ranges)
            if 0 < length < longest
        ]
        for right, up in self.beams:
            cell = (round(right / _CELL), round(up / _CELL))
            self.cells.pop(cell, None)
            self.cells[cell] = None
        for _ in range(len(self.cells) - _MOST_CELLS):
            del self.cells[next(iter(self.cells))]
        self.version += 1


def draw_floor(seen: Surroundings) -> str:
    """Return the floor plan as SVG; empty before the robot's place is known."""
    if seen.pose is None:
        return ""
    x, y, theta = seen.pose
    points = [(right * _CELL, up * _CELL) for right, up in seen.cells]
    xs = [x, *(right for right, _ in points), *(right for right, _ in seen.trail)]
    ys = [y, *(up for _, up in points), *(up for _, up in seen.trail)]
    left, right, bottom, top = min(xs), max(xs), min(ys), max(ys)
    span = max(right - left, top - bottom, _LEAST_SPAN) + 2 * _MARGIN
    middle_x, middle_y = (left + right) / 2, (bottom + top) / 2
    box = f"{middle_x - span / 2:.2f} {-middle_y - span / 2:.2f} {span:.2f} {span:.2f}"
    walls = "".join(f"M{px:.2f} {-py:.2f}h0" for px, py in points)
    beams = "".join(f"M{px:.2f} {-py:.2f}h0" for px, py in seen.beams)
    trail = " ".join(f"{px:.2f},{-py:.2f}" for px, py in seen.trail)
    nose_x, nose_y = x + _ROBOT * math.cos(theta), y + _ROBOT * math.sin(theta)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="robot from above"'
        f' viewBox="{box}" width="100%" style="max-height: 60vh">'
        '<g fill="none" stroke-linecap="round" stroke-linejoin="round">'
        f'<path d="{walls}" stroke="#8f9bb0" stroke-width="{_CELL:.2f}"/>'
        f'<path d="{beams}" stroke="#c8342b" stroke-width="0.04"/>'
        f'<polyline points="{trail}" stroke="#6b9bff" stroke-width="0.02"/></g>'
        f'<circle cx="{x:.3f}" cy="{-y:.3f}" r="{_ROBOT}" fill="#2456c8"/>'
        f'<path d="M{x:.3f} {-y:.3f}L{nose_x:.3f} {-nose_y:.3f}" stroke="#fff"'
        ' stroke-width="0.03" stroke-linecap="round"/></svg>'
    )


def find_floor(survey: Survey, topic: str) -> dict[str, str]:
    """Return the topics of odometry and laser beside a topic of velocities, by ``odom``, ``scan``.

    Args:
        survey: The running nodes.
        topic: Full name of the topic of velocities.
    """
    where = namespace(topic).rstrip("/")
    floors = {}
    for name, type_name in _TYPES.items():
        for token in survey.view.publishers(f"{where}/{name}"):
            if short_type(token.type_name) == type_name:
                floors[name] = f"{where}/{name}"
    return floors


class FloorPlan:
    """A picture of a robot's surroundings, made from its odometry and laser until it is closed.

    Args:
        node: The node that subscribes.
        permission: The rights of the page.
        topics: Topics of odometry and laser, by ``odom`` and ``scan``.

    Raises:
        UsageError: The page may not subscribe to one of them.
    """

    def __init__(self, node: Node, permission: PagePolicy, topics: dict[str, str]) -> None:
        for topic in topics.values():
            permission.check("subscribe", topic)
        self.topics = topics
        self._lock = threading.Lock()
        self._seen = Surroundings()
        self._drawn: tuple[int, str] = (0, "")
        receive = {"odom": self._move, "scan": self._see}
        self._entities = [
            node.subscription(
                topic, node.context.types.message(_TYPES[name]), receive[name], queue_size=1
            )
            for name, topic in topics.items()
        ]

    def _move(self, message: Any) -> None:
        place = message.pose.pose.position
        turn = message.pose.pose.orientation
        _, _, yaw = to_rpy((turn.x, turn.y, turn.z, turn.w))
        with self._lock:
            self._seen.move(place.x, place.y, yaw)

    def _see(self, message: Any) -> None:
        with self._lock:
            self._seen.see(
                message.angle_min, message.angle_increment, message.ranges, message.range_max
            )

    def picture(self) -> str:
        """Return the floor plan as SVG; empty before the robot's place is known."""
        with self._lock:
            if self._drawn[0] != self._seen.version:
                self._drawn = self._seen.version, draw_floor(self._seen)
            return self._drawn[1]

    def close(self) -> None:
        """Unsubscribe."""
        for entity in self._entities:
            entity.close()
