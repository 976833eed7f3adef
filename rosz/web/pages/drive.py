"""Driving by hand: keys, a pad or a gamepad, with pictures of a turtlesim or a robot."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui
from nicegui.events import GenericEventArguments, KeyEventArguments

from rosz.errors import RoszError
from rosz.introspect import list_topics
from rosz.turtlesim import fetch
from rosz.web.model import FloorPlan, System, VelocityPublisher, find_floor
from rosz.web.pages import layout

_LIST_PERIOD = 1.0
_PICTURE_PERIOD = 0.1
_FLOOR_PERIOD = 0.2
_TWIST = "geometry_msgs/Twist"
_KEYS = {
    "ArrowUp": (1, 0),
    "ArrowDown": (-1, 0),
    "ArrowLeft": (0, 1),
    "ArrowRight": (0, -1),
    "w": (1, 0),
    "s": (-1, 0),
    "a": (0, 1),
    "d": (0, -1),
}
_HEARTBEAT = Path(__file__).with_name("heartbeat.js")


class DrivePage:
    """The pad, the keys and the picture; the topic is the first with a listener if it is empty."""

    def __init__(self, system: System, topic: str = "") -> None:
        self._system = system
        frame = layout.Frame(system, "Drive", "/drive")
        self._graph = frame.use(system.graph)
        self._driver: layout.Opened[VelocityPublisher] = layout.Opened(frame)
        self._held: set[str] = set()
        self._picture = system.pictures.add(self._take)
        self._number = 0
        self._floor: layout.Opened[FloorPlan] = layout.Opened(frame)
        with frame.content:
            with ui.row().classes("rosz-card w-full items-center gap-4 px-3 py-2"):
                self._select = layout.add_select(
                    "Topic (Twist)",
                    topic,
                    self._choose,
                    with_input=True,
                    new_value_mode="add-unique",
                )
                self._select.classes("grow min-w-52")
                self._speed, self._rate = (
                    ui.number(unit, value=speed, min=0.01, step=0.1).classes("w-20")
                    for unit, speed in (("m/s", 1.0), ("rad/s", 1.5))
                )
            with ui.element("div").classes("w-full grid gap-4 grid-cols-1 lg:grid-cols-2"):
                self._add_pad()
                with layout.card("From above") as self._floor_card:
                    self._floor_text = ui.label("").classes("rosz-soft text-sm")
                    self._floor_picture = ui.html("", sanitize=False).classes("w-full")
                with layout.card("turtlesim") as self._card:
                    self._image = ui.interactive_image().classes("w-full")
        ui.keyboard(on_key=self._key, repeating=False)
        ui.on("rosz-alive", self._live)
        ui.on("rosz-release", self._release)
        ui.on("rosz-gamepad", self._tilt)
        ui.run_javascript(_HEARTBEAT.read_text())
        frame.keep(self)
        frame.every(_LIST_PERIOD, self._list)
        if topic:
            self._choose()
        ui.timer(_PICTURE_PERIOD, self._show_picture)
        frame.every(_FLOOR_PERIOD, self._show_floor)

    def _add_pad(self) -> None:
        with ui.column().classes("rosz-card p-4 gap-2 items-center min-w-0"):
            ui.label(
                "Pull the pad, hold the arrow keys or W, A, S, D, or tilt the stick of a gamepad."
            ).classes("rosz-soft text-center")
            ui.joystick(
                color="#2456c8",
                size=120,
                throttle=0.05,
                on_move=lambda event: self._go(float(event.y or 0), -float(event.x or 0)),
                on_end=self._release,
            ).classes("w-64 h-64 rounded-full").style("background-color: var(--rosz-line)")
            self._state = ui.label("It stands.").classes("rosz-number")
            self._fault = ui.label("").classes("text-negative")

    def close(self) -> None:
        """Remove the picture."""
        self._system.pictures.remove(self._picture)

    def _list(self) -> None:
        survey = self._graph.survey()
        topics = [
            entry.name
            for entry in list_topics(survey.view.tokens)
            if _TWIST in entry.types and entry.subscribers
        ]
        options = layout.offer_options(self._select, topics)
        if not self._select.value and options:
            self._select.set_value(options[0])
        turtles = any("turtlesim/srv/Spawn" in types for types in survey.view.services().values())
        self._card.set_visibility(turtles)
        self._open_floor(find_floor(survey, str(self._select.value or "/")))

    def _open_floor(self, topics: dict[str, str]) -> None:
        """Show the robot from above if it says where it is."""
        if "odom" not in topics:
            self._floor.close()
        elif self._floor.value is None or self._floor.value.topics != topics:
            self._floor.close()
            self._floor.set(FloorPlan(self._system.node, self._system.permission, topics))
            self._floor_text.set_text(f"by {' and '.join(sorted(topics.values()))}")
        self._floor_card.set_visibility(self._floor.value is not None)

    def _show_floor(self) -> None:
        floor = self._floor.value
        self._floor_picture.set_content("" if floor is None else floor.picture())

    def _choose(self) -> None:
        topic = str(self._select.value or "")
        self._driver.close()
        if not topic:
            return
        layout.address_of(layout.query_of("/drive", topic=topic))
        try:
            driver = VelocityPublisher(self._system.node, self._system.permission, topic)
            self._driver.set(driver)
            self._fault.set_text("")
        except RoszError as error:
            self._fault.set_text(str(error))

    def _live(self) -> None:
        if self._driver.value is not None:
            self._driver.value.alive()

    def _go(self, forward: float, turn: float) -> None:
        driver = self._driver.value
        if driver is None:
            return
        forward *= float(self._speed.value or 0)
        turn *= float(self._rate.value or 0)
        driver.drive(forward, turn)
        moving = forward or turn
        self._state.set_text(f"{forward:+.2f} m/s, {turn:+.2f} rad/s" if moving else "It stands.")

    def _tilt(self, event: GenericEventArguments) -> None:
        right, back = event.args
        self._go(-float(back), -float(right))

    def _release(self) -> None:
        self._held.clear()
        self._go(0, 0)

    def _key(self, event: KeyEventArguments) -> None:
        name = event.key.name if event.key.name in _KEYS else event.key.name.lower()
        if name not in _KEYS:
            return
        if event.action.keydown:
            self._held.add(name)
        else:
            self._held.discard(name)
        self._go(sum(_KEYS[key][0] for key in self._held), sum(_KEYS[key][1] for key in self._held))

    def _take(self) -> tuple[bytes, str]:
        context = self._system.node.context
        turtles = [
            token.node_name
            for name in self._graph.survey().view.services()
            if name.endswith("/spawn") or name == "/spawn"
            for token in self._graph.survey().view.servers(name)
        ]
        return fetch(
            context.session, context.domain, turtles[0] if turtles else ""
        ).png, "image/png"

    def _show_picture(self) -> None:
        if self._card.visible:
            self._number += 1
            self._image.set_source(f"/picture/{self._picture}?n={self._number}")
