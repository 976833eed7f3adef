"""The simulation as a node: topics, services and parameters of ROS 1's turtlesim (ROS wiki).

One lock guards the world. A thread moves it on at 62.5 steps a second of wall time, as the original
does even where time is simulated.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import msgspec

from rosz.errors import NotFoundError, RoszError, ServiceError
from rosz.msgs.std_srvs.srv import Empty, EmptyRequest
from rosz.msgs.turtlesim.srv import Kill, KillRequest, Spawn, SpawnRequest, SpawnResponse
from rosz.node.clock import Clock
from rosz.node.timer import Timer, TimerEvent
from rosz.turtlesim import picture
from rosz.turtlesim.ports import Ports
from rosz.turtlesim.snapshot import Picture, offer
from rosz.turtlesim.turtle import SIZE, STEP_SECONDS, Turtle
from rosz.turtlesim.world import BACKGROUND, FIRST, START, World

if TYPE_CHECKING:
    from rosz.node import Node

__all__ = ("Simulator", "View")

_CHANNELS = ("~background_r", "~background_g", "~background_b")


class View(msgspec.Struct, frozen=True):
    """What a window needs to show the world at one moment.

    Attributes:
        pixels: Of the field; None if it is what it was.
        version: Of the field.
        turtles: Copies, from the lowest to the uppermost.
    """

    pixels: bytes | None
    version: int
    turtles: tuple[Turtle, ...]


class Simulator:
    """A world of turtles that a node runs; it ends with the node.

    Args:
        node: Whose topics, services and parameters they are.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._ports: dict[str, Ports] = {}
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
        node.service("clear", Empty, self._clear)
        node.service("reset", Empty, self._reset)
        node.service("spawn", Spawn, self._spawn)
        node.service("kill", Kill, self._kill)
        offer(node, self.picture)
        self._add(START, START, 0.0, FIRST)
        node.on_shutdown(self._end)
        period = round(STEP_SECONDS * 1e9)
        node.keep(Timer(period, self._step, Clock(), on_error=node.log.report, name="turtlesim"))

    def picture(self) -> Picture:
        """Return a picture of the field and its turtles."""
        with self._lock:
            field, turtles = self._world.field.copy(), self._copies()
        # Painting takes longer than a step: the turtles do not wait for it.
        return Picture(self._node.name, picture.take(field, turtles))

    def view(self, known: int) -> View:
        """Return what there is to see.

        Args:
            known: Version of the field that the caller has.
        """
        with self._lock:
            field = self._world.field
            pixels = bytes(field.pixels) if field.version != known else None
            return View(pixels, field.version, self._copies())

    def _copies(self) -> tuple[Turtle, ...]:
        turtles = self._world.turtles.values()
        return tuple(Turtle(one.x, one.y, one.theta, one.kind) for one in turtles)

    def _step(self, _: TimerEvent) -> None:
        with self._lock:
            if self._ended:
                return
            for bump in self._world.step(time.monotonic()):
                x, y = bump.wish
                # The original counts y from above here.
                self._node.log.warning(
                    "Oh no! I hit the wall! (Clamping from [x=%f, y=%f])", x, SIZE - y
                )
            for name, ports in self._ports.items():
                ports.publish(self._world.turtles[name])

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
            # The first turtle keeps its topics, so that nobody has to connect to them anew.
            gone = [self._ports.pop(name) for name in list(self._ports) if name != FIRST]
            kept = FIRST in self._ports
        for ports in gone:
            ports.close()
        if not kept:
            self._open_ports(FIRST)
        self._announce(FIRST, START, START, 0.0)

    def _spawn(self, request: SpawnRequest) -> SpawnResponse:
        try:
            name = self._add(request.x, request.y, request.theta, request.name)
        except RoszError as error:
            raise self._refusal(error) from error
        return SpawnResponse(name)

    def _kill(self, request: KillRequest) -> None:
        with self._lock:
            try:
                self._world.kill(request.name)
            except NotFoundError as error:
                raise self._refusal(error) from error
            ports = self._ports.pop(request.name, None)
        if ports is not None:
            ports.close()

    def _refusal(self, error: RoszError) -> ServiceError:
        text = str(error)
        self._node.log.error("%s%s", text[:1].upper(), text[1:])
        return ServiceError(text)

    def _add(self, x: float, y: float, theta: float, name: str) -> str:
        """Put a turtle on the field, with its topics and services; returns its name.

        Raises:
            UsageError: The name is taken, or a number is no place.
            InvalidName: The name is none that a topic may have.
        """
        if name:
            self._node.resolve(f"{name}/pose")
        with self._lock:
            name = self._world.spawn(x, y, theta, name)
        self._open_ports(name)
        self._announce(name, x, y, theta)
        return name

    def _announce(self, name: str, x: float, y: float, theta: float) -> None:
        self._node.log.info("Spawning turtle [%s] at x=[%f], y=[%f], theta=[%f]", name, x, y, theta)

    def _open_ports(self, name: str) -> None:
        ports = Ports(self._node, name, self._with)
        with self._lock:
            if name in self._world.turtles and name not in self._ports:
                self._ports[name] = ports
                return
        ports.close()

    def _with(self, name: str, work: Callable[[Turtle], None]) -> None:
        """Do something to a turtle, unless it has been taken away meanwhile."""
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
