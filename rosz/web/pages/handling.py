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

__all__ = ("Handling",)


class _Handles(Object3D, component=Path(__file__).with_name("handles.js")):
    """Lets the pointer move what is drawn with a handle.

    Args:
        scene: Number of the element of the view.
    """

    def __init__(self, scene: int) -> None:
        super().__init__(scene)


class Handling:
    """Reports what one does with the handles in a view.

    Args:
        scene: The view.
        find: Function that returns the display with a name; None if there is none.
    """

    def __init__(self, scene: ui.scene, find: Callable[[str], HandleDisplay | None]) -> None:
        self._find = find
        with scene:
            _Handles(scene.id)
        self._menu = ui.dialog()
        ui.on("rosz-handled", self._handled)

    def _handled(self, event: GenericEventArguments) -> None:
        try:
            held = msgspec.convert(event.args, Held)
        except msgspec.ValidationError:
            return
        display = self._find(held.display)
        if display is None:
            return
        if held.event == "menu":
            self._open_menu(display, held)
        else:
            display.take(held)

    def _open_menu(self, display: HandleDisplay, held: Held) -> None:
        entries = display.menu(held.marker)
        self._menu.clear()
        with self._menu, ui.card().classes("gap-0 p-2"):
            ui.label(held.marker).classes("rosz-soft text-sm px-2")
            self._add_entries(display, held, entries, 0, 0)
        self._menu.open()

    def _add_entries(
        self, display: HandleDisplay, held: Held, entries: list[MenuEntry], parent: int, depth: int
    ) -> None:
        """Add the entries below another one, each with those below it."""
        for entry in entries:
            if entry.parent_id != parent or entry.id == parent:
                continue
            has_more = any(one.parent_id == entry.id for one in entries)
            button = ui.button(
                entry.title, on_click=lambda entry=entry: self._choose(display, held, entry)
            )
            button.props("flat dense no-caps align=left").classes("w-full")
            button.style(f"padding-left: {8 + 16 * depth}px")
            button.set_enabled(not has_more)
            if has_more:
                self._add_entries(display, held, entries, entry.id, depth + 1)

    def _choose(self, display: HandleDisplay, held: Held, entry: MenuEntry) -> None:
        self._menu.close()
        if entry.command_type != MenuEntry.FEEDBACK:
            ui.notify(f"'{entry.title}' starts a program, which pages do not", type="negative")
            return
        display.choose(held, entry.id)
