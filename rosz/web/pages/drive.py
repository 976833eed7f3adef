"""Driving by hand: keys, a pad, and the picture of a turtlesim."""

from __future__ import annotations

from urllib.parse import urlencode

from nicegui import ui
from nicegui.events import JoystickEventArguments, KeyEventArguments

from rosz.errors import RoszError
from rosz.introspect.topics import list_topics
from rosz.turtlesim import fetch
from rosz.web.model import Driver, System
from rosz.web.pages.layout import Frame, address_of

__all__ = ("show_drive",)

_LIST_PERIOD = 1.0
_PICTURE_PERIOD = 0.1
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
_HEARTBEAT = """
if (!window.roszDrives) {
  window.roszDrives = setInterval(() => emitEvent('rosz-alive'), 200);
  for (const name of ['blur', 'pagehide']) {
    window.addEventListener(name, () => emitEvent('rosz-release'));
  }
}"""


def show_drive(system: System, topic: str) -> None:
    """Build the page.

    Args:
        system: The system.
        topic: Topic of the velocities; empty for the first that somebody listens to.
    """
    _Drive(system, topic)


class _Drive:
    """The pad, the keys and the picture."""

    def __init__(self, system: System, topic: str) -> None:
        self._system = system
        self._frame = frame = Frame(system, "Drive", "/drive")
        self._graph = frame.use(system.graph)
        self._driver: Driver | None = None
        self._held: set[str] = set()
        self._picture = system.pictures.add(self._take)
        self._number = 0
        with frame.content:
            with ui.row().classes("rosz-card w-full items-center gap-4 px-3 py-2"):
                self._select = (
                    ui.select(
                        [topic] if topic else [],
                        value=topic or None,
                        label="Topic (Twist)",
                        with_input=True,
                        new_value_mode="add-unique",
                        on_change=self._choose,
                    )
                    .props("dense options-dense")
                    .classes("grow min-w-52")
                )
                self._speed = ui.number("m/s", value=1.0, min=0.01, step=0.1).props("dense")
                self._speed.classes("w-20")
                self._rate = ui.number("rad/s", value=1.5, min=0.01, step=0.1).props("dense")
                self._rate.classes("w-20")
            with ui.element("div").classes("w-full grid gap-4 grid-cols-1 lg:grid-cols-2"):
                self._add_pad()
                with ui.column().classes("rosz-card p-4 gap-2 min-w-0") as self._card:
                    ui.label("turtlesim").classes("text-base font-semibold")
                    self._image = ui.interactive_image().classes("w-full")
        ui.keyboard(on_key=self._key, repeating=False)
        ui.on("rosz-alive", self._live)
        ui.on("rosz-release", self._release)
        ui.run_javascript(_HEARTBEAT)
        frame.keep(self)
        frame.every(_LIST_PERIOD, self._list)
        if topic:
            self._choose()
        ui.timer(_PICTURE_PERIOD, self._show_picture)

    def _add_pad(self) -> None:
        with ui.column().classes("rosz-card p-4 gap-2 items-center min-w-0"):
            ui.label("Pull the pad, or hold the arrow keys or W, A, S, D.").classes("rosz-soft")
            ui.joystick(
                color="#2456c8",
                size=120,
                throttle=0.05,
                on_move=self._pull,
                on_end=self._release,
            ).classes("w-64 h-64 rounded-full").style("background-color: var(--rosz-line)")
            self._state = ui.label("It stands.").classes("rosz-number")
            self._fault = ui.label("").classes("text-negative")

    def close(self) -> None:
        """Stop driving."""
        self._system.pictures.remove(self._picture)
        driver, self._driver = self._driver, None
        if driver is not None:
            driver.close()

    def _list(self) -> None:
        survey = self._graph.survey()
        found = sorted(
            one.name
            for one in list_topics(survey.view.tokens)
            if _TWIST in one.types and one.subscribers
        )
        chosen = self._select.value
        options = sorted({*found, *((chosen,) if chosen else ())})
        if self._select.options != options:
            self._select.set_options(options, value=chosen)
        if not chosen and options:
            self._select.set_value(options[0])
        turtles = any("turtlesim/srv/Spawn" in types for types in survey.view.services().values())
        self._card.set_visibility(turtles)

    def _choose(self) -> None:
        topic = str(self._select.value or "")
        driver, self._driver = self._driver, None
        if driver is not None:
            driver.close()
        if not topic:
            return
        address_of(f"/drive?{urlencode({'topic': topic}, safe='/')}")
        try:
            self._driver = Driver(self._system.node, self._system.permission, topic)
            self._fault.set_text("")
        except RoszError as error:
            self._fault.set_text(str(error))

    def _live(self) -> None:
        if self._driver is not None:
            self._driver.alive()

    def _go(self, forward: float, turn: float) -> None:
        if self._driver is None:
            return
        forward *= float(self._speed.value or 0)
        turn *= float(self._rate.value or 0)
        self._driver.drive(forward, turn)
        moving = forward or turn
        self._state.set_text(f"{forward:+.2f} m/s, {turn:+.2f} rad/s" if moving else "It stands.")

    def _pull(self, event: JoystickEventArguments) -> None:
        self._go(float(event.y or 0), -float(event.x or 0))

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
        self._go(sum(_KEYS[one][0] for one in self._held), sum(_KEYS[one][1] for one in self._held))

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
