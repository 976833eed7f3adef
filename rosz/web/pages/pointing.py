"""The tools of the view in space, and the row that says what to do with the one that is taken."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from nicegui import ui
from nicegui.elements.scene.scene_object3d import Object3D
from nicegui.events import GenericEventArguments

from rosz.errors import RoszError
from rosz.web.model import System
from rosz.web.scene import TOOLS, Tools

_MOVE = "move"


class _Pointer(Object3D, component=Path(__file__).with_name("pointer.js")):
    """Handles the pointer in the browser while a tool is selected."""

    def take(self, tool: str) -> None:
        """Let the pointer be a tool; empty for moving the view."""
        self.args[0] = tool
        self.run_method("arm", tool)


class Pointing:
    """The choice of a tool, and its publisher, which needs the fixed frame."""

    def __init__(self, system: System, fixed: Callable[[], str]) -> None:
        self._tools = Tools(system.node, system.permission)
        self._fixed = fixed
        self._pointer: _Pointer | None = None
        self._choice: ui.toggle
        self._row: ui.row

    def add_choice(self) -> None:
        """Add the choice of a tool."""
        titles = {_MOVE: "Move", **{name: tool.title for name, tool in TOOLS.items()}}
        self._choice = ui.toggle(titles, value=_MOVE, on_change=self._take)
        self._choice.props('dense no-caps flat aria-label="Tool"')

    def add_row(self) -> None:
        """Add the row of the tool that is taken."""
        with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-1") as self._row:
            self._hint = ui.label("").classes("rosz-soft text-sm")
            ui.space()
            self._numbers = [
                ui.number(name, value=0, step=0.1).classes("w-16")
                for name in ("x (m)", "y (m)", "yaw (°)")
            ]
            ui.button("Send", on_click=self._send_numbers).props("flat dense")
        self._row.set_visibility(False)
        ui.on("rosz-placed", self._placed)
        ui.keyboard(lambda event: event.key.escape and self._choice.set_value(_MOVE))

    def add_pointer(self, scene: ui.scene) -> None:
        """Add what follows the pointer in a view."""
        with scene:
            self._pointer = _Pointer("")

    def _take(self) -> None:
        name = str(self._choice.value)
        tool = TOOLS.get(name)
        if tool is not None:
            try:
                self._tools.take(name)
            except RoszError as error:
                ui.notify(str(error), type="negative")
                self._choice.set_value(_MOVE)
                return
            self._hint.set_text(f"{tool.hint} Publishes {tool.topic}.")
        self._row.set_visibility(tool is not None)
        if self._pointer is not None:
            self._pointer.take(name if tool is not None else "")

    def _placed(self, event: GenericEventArguments) -> None:
        given = event.args
        name = str(given.get("tool", ""))
        try:
            x, y, z, yaw = (float(given[key]) for key in ("x", "y", "z", "yaw"))
        except (KeyError, TypeError, ValueError):
            return
        if name in TOOLS and all(map(math.isfinite, (x, y, z, yaw))):
            self._send(name, (x, y, z), yaw)

    def _send_numbers(self) -> None:
        x, y, degrees = (float(number.value or 0) for number in self._numbers)
        self._send(str(self._choice.value), (x, y, 0.0), math.radians(degrees))

    def _send(self, name: str, point: tuple[float, float, float], yaw: float) -> None:
        frame = self._fixed()
        if not frame:
            ui.notify("no fixed frame is chosen: choose one", type="negative")
            return
        try:
            self._tools.send(name, frame, point, yaw)
        except RoszError as error:
            ui.notify(str(error), type="negative")
            return
        ui.notify(
            f"{TOOLS[name].topic}: x {point[0]:.2f}, y {point[1]:.2f} in '{frame}'",
            type="positive",
        )
        self._choice.set_value(_MOVE)

    def close(self) -> None:
        """Withdraw the published message."""
        self._tools.close()
