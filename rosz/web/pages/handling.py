"""The handles of interactive markers in the view in space."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import msgspec
from nicegui import ui
from nicegui.elements.scene.scene_object3d import Object3D
from nicegui.events import GenericEventArguments

from rosz.msgs.visualization_msgs.msg import MenuEntry
from rosz.web.scene import HandleDisplay, Held


class _Handles(Object3D, component=Path(__file__).with_name("handles.js")):
    """Lets the pointer move parts that are drawn with a handle; made with the view's number."""


class Handling:
    """Reports the user's actions on the handles in a view to the display of a name."""

    def __init__(self, scene: ui.scene, find: Callable[[str], HandleDisplay | None]) -> None:
        self._find = find
        with scene:
            _Handles(scene.id)
        self._menu = ui.dialog()
        ui.on("rosz-handled", self._handled)

    def _handled(self, event: GenericEventArguments) -> None:
        try:
            drag = msgspec.convert(event.args, Held)
        except msgspec.ValidationError:
            return
        display = self._find(drag.display)
        if display is None:
            return
        if drag.event == "menu":
            self._open_menu(display, drag)
        else:
            display.take(drag)

    def _open_menu(self, display: HandleDisplay, drag: Held) -> None:
        entries = display.menu(drag.marker)
        self._menu.clear()
        with self._menu, ui.card().classes("gap-0 p-2"):
            ui.label(drag.marker).classes("rosz-soft text-sm px-2")
            self._add_entries(display, drag, entries, 0, 0)
        self._menu.open()

    def _add_entries(
        self, display: HandleDisplay, drag: Held, entries: list[MenuEntry], parent: int, depth: int
    ) -> None:
        """Add the entries below another one, each with those below it."""
        for entry in entries:
            if entry.parent_id != parent or entry.id == parent:
                continue
            has_more = any(child.parent_id == entry.id for child in entries)
            button = ui.button(
                entry.title, on_click=lambda entry=entry: self._choose(display, drag, entry)
            )
            button.props("flat dense align=left").classes("w-full")
            button.style(f"padding-left: {8 + 16 * depth}px")
            button.set_enabled(not has_more)
            if has_more:
                self._add_entries(display, drag, entries, entry.id, depth + 1)

    def _choose(self, display: HandleDisplay, drag: Held, entry: MenuEntry) -> None:
        self._menu.close()
        if entry.command_type != MenuEntry.FEEDBACK:
            ui.notify(f"'{entry.title}' starts a program, which pages do not", type="negative")
            return
        display.choose(drag, entry.id)
