"""The simulation as a node: topics, services and parameters of ROS 1's turtlesim (ROS wiki).

One lock protects the world. A thread runs 62.5 steps per second of wall time, even where time is
simulated, as in ROS 1.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Any

from rosz.errors import NotFoundError, RoszError, ServiceError, UsageError
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.std_srvs.srv import Empty, EmptyRequest
from rosz.msgs.turtlesim.msg import Color, Pose
from rosz.msgs.turtlesim.srv import (
    Kill,
    KillRequest,
    SetPen,
    SetPenRequest,
    Spawn,
    SpawnRequest,
    SpawnResponse,
    TeleportAbsolute,
    TeleportAbsoluteRequest,
    TeleportRelative,
    TeleportRelativeRequest,
)
from rosz.node import Clock, Node, Timer, TimerEvent
from rosz.turtlesim import snapshot
from rosz.turtlesim.picture import render
from rosz.turtlesim.snapshot import Snapshot
from rosz.turtlesim.world import BACKGROUND, FIRST, SIZE, START, STEP_SECONDS, Pen, Turtle, World

Work = Callable[[Turtle], None]

_CHANNELS = ("~background_r", "~background_g", "~background_b")


class _TurtleTopics:
    """The topics and services of a turtle; `change` changes a turtle under the lock."""

    def __init__(self, node: Node, name: str, change: Callable[[str, Work], None]) -> None:
        self._node = node
        self._name = name
        self._change = change
        self._pose = node.publisher(f"{name}/pose", Pose, queue_size=1)
        self._color = node.publisher(f"{name}/color_sensor", Color, queue_size=1)
        self._parts = (
            self._pose,
            self._color,
            node.subscription(f"{name}/cmd_vel", Twist, self._command, queue_size=1),
            node.service(f"{name}/set_pen", SetPen, self._set_pen),
            node.service(f"{name}/teleport_absolute", TeleportAbsolute, self._teleport_to),
            node.service(f"{name}/teleport_relative", TeleportRelative, self._teleport_by),
        )

    def publish(self, turtle: Turtle) -> None:
        self._pose.publish(Pose(turtle.x, turtle.y, turtle.theta, turtle.speed, turtle.turn))
        self._color.publish(Color(*turtle.sees))

    def close(self) -> None:
        for part in reversed(self._parts):
            part.close()

    def _command(self, twist: Twist) -> None:
        now = time.monotonic()
        try:
            self._change(
                self._name,
                lambda turtle: turtle.command(
                    now, forward=twist.linear.x, left=twist.linear.y, turn=twist.angular.z
                ),
            )
        except UsageError as error:
            self._node.log.warning("ignoring a command for [%s]: %s", self._name, error, throttle=1)

    def _set_pen(self, request: SetPenRequest) -> None:
        def change_pen(turtle: Turtle) -> None:
            if request.off:  # the color stays for later
                turtle.pen = Pen(turtle.pen.color, turtle.pen.width, on=False)
            else:
                turtle.pen = Pen((request.r, request.g, request.b), request.width or 1)

        self._change(self._name, change_pen)

    def _teleport_to(self, request: TeleportAbsoluteRequest) -> None:
        self._move(lambda turtle: turtle.teleport_to(request.x, request.y, request.theta))

    def _teleport_by(self, request: TeleportRelativeRequest) -> None:
        self._move(lambda turtle: turtle.teleport_by(request.linear, request.angular))

    def _move(self, work: Work) -> None:
        try:
            self._change(self._name, work)
        except UsageError as error:
            raise ServiceError(str(error)) from error


class Simulator:
    """A world of turtles as a node; it ends with the node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._topics: dict[str, _TurtleTopics] = {}
        self._ended = False
        missing = {
            name: value
            for name, value in zip(_CHANNELS, BACKGROUND, strict=True)
            if name not in node.params
        }
        if missing:
            node.params.update(missing)
        self._world = World(self._background())
        node.log.info("Starting turtlesim with node name %s", node.name)
        # Before the services: a client may call 'reset' as soon as it exists.
        self._add(START, START, 0.0, FIRST)
        node.service("clear", Empty, self._clear)
        node.service("reset", Empty, self._reset)
        node.service("spawn", Spawn, self._spawn)
        node.service("kill", Kill, self._kill)
        snapshot.serve(node, self.picture)
        node.on_shutdown(self._end)
        period = round(STEP_SECONDS * 1e9)
        node.keep(Timer(period, self._step, Clock(), on_error=node.log.report, name="turtlesim"))

    def picture(self) -> Snapshot:
        """Return a picture of the field and its turtles."""
        with self._lock:
            field, turtles = self._world.field.copy(), self._copies()
        # Without the lock: rendering takes longer than a step.
        return Snapshot(self._node.name, render(field, turtles))

    def view(self, version: int) -> tuple[bytes | None, int, tuple[Turtle, ...]]:
        """Return the state of the world for a window that has a version of the field.

        Returns:
            Pixels of the field, or None if they have not changed; version of the field; copies of
            the turtles, from the lowest to the uppermost.
        """
        with self._lock:
            field = self._world.field
            pixels = bytes(field.pixels) if field.version != version else None
            return pixels, field.version, self._copies()

    def _copies(self) -> tuple[Turtle, ...]:
        turtles = self._world.turtles.values()
        return tuple(Turtle(turtle.x, turtle.y, turtle.theta, turtle.kind) for turtle in turtles)

    def _step(self, _: TimerEvent) -> None:
        with self._lock:
            if self._ended:
                return
            for _name, (x, y) in self._world.step(time.monotonic()):
                # ROS 1 counts y from above here.
                self._node.log.warning(
                    "Oh no! I hit the wall! (Clamping from [x=%f, y=%f])", x, SIZE - y
                )
            for name, topics in self._topics.items():
                topics.publish(self._world.turtles[name])

    def _end(self, _: str) -> None:
        with self._lock:
            self._ended = True

    def _clear(self, _: EmptyRequest) -> None:
        self._node.log.info("Clearing turtlesim.")
        background = self._background()
        with self._lock:
            self._world.clear(background)

    def _reset(self, _: EmptyRequest) -> None:
        self._node.log.info("Resetting turtlesim.")
        background = self._background()
        with self._lock:
            self._world.reset(background)
            # The first turtle keeps its topics, so that others stay connected.
            gone = [self._topics.pop(name) for name in list(self._topics) if name != FIRST]
            kept = FIRST in self._topics
        for topics in gone:
            topics.close()
        if not kept:
            self._open_topics(FIRST)
        self._announce(FIRST, START, START, 0.0)

    def _spawn(self, request: SpawnRequest) -> SpawnResponse:
        try:
            name = self._add(request.x, request.y, request.theta, request.name)
        except RoszError as error:
            raise self._report(error) from error
        return SpawnResponse(name)

    def _kill(self, request: KillRequest) -> None:
        with self._lock:
            try:
                self._world.kill(request.name)
            except NotFoundError as error:
                raise self._report(error) from error
            topics = self._topics.pop(request.name, None)
        if topics is not None:
            topics.close()

    def _report(self, error: RoszError) -> ServiceError:
        text = str(error)
        self._node.log.error("%s%s", text[:1].upper(), text[1:])
        return ServiceError(text)

    def _add(self, x: float, y: float, theta: float, name: str) -> str:
        """Add a turtle with its topics and services, and return its name."""
        if name:
            self._node.resolve(f"{name}/pose")
        with self._lock:
            name = self._world.spawn(x, y, theta, name)
        self._open_topics(name)
        self._announce(name, x, y, theta)
        return name

    def _announce(self, name: str, x: float, y: float, theta: float) -> None:
        self._node.log.info("Spawning turtle [%s] at x=[%f], y=[%f], theta=[%f]", name, x, y, theta)

    def _open_topics(self, name: str) -> None:
        topics = _TurtleTopics(self._node, name, self._change)
        with self._lock:
            if name in self._world.turtles and name not in self._topics:
                self._topics[name] = topics
                return
        topics.close()

    def _change(self, name: str, work: Callable[[Turtle], None]) -> None:
        """Change a turtle under the lock, unless it was removed meanwhile."""
        with self._lock:
            turtle = self._world.turtles.get(name)
            if turtle is not None:
                work(turtle)

    def _background(self) -> tuple[int, int, int]:
        red, green, blue = map(self._channel, _CHANNELS, BACKGROUND)
        return red, green, blue

    def _channel(self, name: str, default: int) -> int:
        value: Any = self._node.params.get(name, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
            self._node.log.warning(
                "parameter '%s' is '%s': expected a number from 0 to 255; %d is used",
                self._node.resolve(name),
                value,
                default,
            )
            return default
        return round(min(max(value, 0), 255))
