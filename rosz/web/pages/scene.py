"""The system in space, as rviz shows it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import msgspec
from nicegui import ui
from nicegui.elements.scene.scene_object3d import Object3D

from rosz.errors import RoszError
from rosz.web.model import IMAGE_TYPES, Frames, System
from rosz.web.pages import layout
from rosz.web.pages.handling import Handling
from rosz.web.pages.pointing import Pointing
from rosz.web.scene import (
    AXES,
    GRID,
    HANDLE_TYPE,
    MOST_DISPLAYS,
    Display,
    HandleDisplay,
    Look,
    Meshes,
    SceneSetup,
    format_setup,
    list_displays,
    open_display,
    read_setup,
)

_PERIOD = 0.1
_LIST_PERIOD = 1.0
_COLORS = ("#e0483e", "#2f6fed", "#1f9d61", "#e0a21a", "#8a4fd0", "#0f9bb0", "#c13c8b")
_CLOUDS = {"height": "by height", "intensity": "by intensity", "rgb": "their own"}
_CHOICES = {
    "DepthCloud": _CLOUDS,
    "nav_msgs/OccupancyGrid": {"costmap": "of a costmap"},
    "sensor_msgs/LaserScan": _CLOUDS,
    "sensor_msgs/PointCloud": _CLOUDS,
    "sensor_msgs/PointCloud2": _CLOUDS,
}
"""The meanings that the color of a display can have, by its type."""
_MARKERS = ("Robot", "visualization_msgs/Marker", "visualization_msgs/MarkerArray", HANDLE_TYPE)
_OWN_COLORS = frozenset({"Axes", "Frames", "nav_msgs/OccupancyGrid", *_MARKERS, *IMAGE_TYPES})
_OWN_SIZES = _OWN_COLORS - {"Axes", "Frames"} | {"nav_msgs/GridCells", "sensor_msgs/Range"}
_NEED_COLOR = frozenset(
    {
        "geometry_msgs/PolygonStamped",
        "geometry_msgs/PoseArray",
        "geometry_msgs/PoseStamped",
        "geometry_msgs/PoseWithCovarianceStamped",
        "nav_msgs/Odometry",
        "nav_msgs/Path",
        "sensor_msgs/LaserScan",
        "sensor_msgs/Range",
    }
)
"""Types that get a color of their own when they are added."""
_TEXTS = {
    "Axes": ("frame", "At the frame"),
    "Grid": ("frame", "At the frame"),
    "Robot": ("prefix", "Prefix of its frames"),
}
_Number: TypeAlias = tuple[str, str, type[float]]
_NUMBERS: dict[str, list[_Number]] = {
    "Axes": [("radius", "Radius (m)", float)],
    "Grid": [("cells", "Cells", int)],
    "nav_msgs/Odometry": [("keep", "Keep", int)],
}
"""More settings of displays, by their types."""
_UNITS = dict.fromkeys(_CHOICES, "Pixels")
_BACKGROUND = "getComputedStyle(document.body).getPropertyValue('--rosz-scene').trim()"
"""JavaScript that returns the color of the page, for the first drawing."""
_VIEWS = {"orbit": "From the side", "top": "From above"}


class _Backdrop(Object3D, component=Path(__file__).with_name("backdrop.js")):
    """Gives the view the color of the page, and draws it only while it changes."""


class _Drawn(Object3D, component=Path(__file__).with_name("drawing.js")):
    """The drawing of one display; made with the address of the newest one."""

    def renew(self, address: str) -> None:
        """Let the browser show a newer one when it has time."""
        self.args[0] = address
        self.run_method("update", address)


class ScenePage:
    """The view, and the displays in it.

    Args:
        system: The system.
        frame: The fixed frame; empty to choose one.
        show: The displays, as the address holds them.
        view: ``orbit`` or ``top``.
    """

    def __init__(self, system: System, frame: str, show: str, view: str) -> None:
        self._system = system
        setup = read_setup(frame, show, view)
        page = layout.Frame(system, "3D", "/3d")
        self._graph = page.use(system.graph)
        self._frames: Frames = page.use(system.frames)
        self._shown: list[_ShownDisplay] = []
        self._keys: list[str] = []
        self._meshes = Meshes(system.node.context.environment, self._publish)
        self._chosen = bool(setup.frame)
        self._pointing = Pointing(system, lambda: str(self._fixed.value or ""))
        with page.content:
            self._add_controls(setup)
            self._pointing.add_row()
            with ui.element("div").classes(
                "w-full grid gap-4 grid-cols-1 lg:grid-cols-[minmax(0,1fr)_19rem]"
            ):
                self._scene = (
                    ui.scene(grid=False, fps=30)
                    .props(remove="background-color")
                    .props(f':background-color="{_BACKGROUND}"')
                    .classes("rosz-card w-full overflow-hidden rosz-scene")
                )
                with self._scene:
                    _Backdrop(self._scene.id)
                self._list = ui.column().classes("w-full gap-2 min-w-0")
        self._pointing.add_pointer(self._scene)
        Handling(self._scene, self._handles)
        page.keep(self)
        page.keep(self._pointing)
        for look in setup.looks[: MOST_DISPLAYS + 1]:  # one too many says so
            self._show(look)
        self._look_from(None)
        page.show_fault(self._frames.fault)
        page.every(_LIST_PERIOD, self._refresh_lists)
        page.every(_PERIOD, self._refresh)

    def _add_controls(self, setup: SceneSetup) -> None:
        with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-2"):
            self._fixed = layout.add_select(
                "Fixed frame", setup.frame, self._choose_frame, with_input=True
            ).classes("w-44")
            self._view = (
                ui.toggle(_VIEWS, value=setup.view, on_change=self._look_from)
                .props("dense no-caps flat")
                .classes("rosz-view")
            )
            self._pointing.add_choice()
            ui.space()
            self._add = ui.select({}, label="Add a display", on_change=self._add_chosen)
            self._add.classes("w-60")

    def close(self) -> None:
        """Close all displays."""
        for shown in self._shown:
            shown.close()
        self._shown.clear()
        for key in self._keys:
            self._system.pictures.remove(key)

    def _publish(self, source: Callable[[], tuple[bytes, str]]) -> str:
        """Give the contents of a file an address until the page is closed."""
        self._keys.append(self._system.pictures.add(source))
        return f"/picture/{self._keys[-1]}"

    # Displays.

    def _show(self, look: Look) -> None:
        if len(self._shown) >= MOST_DISPLAYS:
            ui.notify(f"a page shows {MOST_DISPLAYS} displays, which is the limit", type="negative")
            return
        with self._list:
            shown = _ShownDisplay(self._system, self._scene, look, self._changed, self._remove)
        self._shown.append(shown)

    def _remove(self, shown: _ShownDisplay) -> None:
        self._shown.remove(shown)
        self._changed()
        shown.remove()

    def _add_chosen(self) -> None:
        name = self._add.value
        if not name:
            return
        self._add.set_value(None)
        color = _COLORS[len(self._shown) % len(_COLORS)]
        kind = list_displays(self._graph.survey()).get(name, "")
        self._show(Look(name, color if kind in _NEED_COLOR else ""))
        self._changed()

    def _handles(self, name: str) -> HandleDisplay | None:
        """Return the display of interactive markers with a name; None if there is none."""
        displays = (entry.display for entry in self._shown if entry.look.name == name)
        return next((view for view in displays if isinstance(view, HandleDisplay)), None)

    # The address of the page.

    def _changed(self) -> None:
        looks = tuple(shown.look for shown in self._shown)
        fixed = str(self._fixed.value or "") if self._chosen else ""
        layout.address_of(format_setup(SceneSetup(fixed, looks, str(self._view.value))))

    def _choose_frame(self) -> None:
        self._chosen = True
        self._changed()

    def _look_from(self, _: object) -> None:
        if self._view.value == "top":
            self._scene.move_camera(0.0, -0.01, 12.0, 0.0, 0.0, 0.0)
        else:
            self._scene.move_camera(-5.0, -5.0, 4.5, 0.0, 0.0, 0.0)
        self._changed()

    # Lists and states.

    def _refresh_lists(self) -> None:
        shown = {entry.look.name for entry in self._shown} - {AXES, GRID}
        options = {
            name: f"{name} ({kind})"
            for name, kind in list_displays(self._graph.survey()).items()
            if name not in shown
        }
        if self._add.options != options:
            self._add.set_options(options)
        names = self._frames.buffer.frames()
        if not self._chosen and (best := self._frames.best()) and best != self._fixed.value:
            self._fixed.set_options(names, value=best)
            self._chosen = False
        layout.offer_options(self._fixed, names)

    def _refresh(self) -> None:
        fixed = str(self._fixed.value or "")
        for shown in self._shown:
            if shown.display is None:
                self._open_shown(shown)
            shown.refresh(fixed)

    def _open_shown(self, shown: _ShownDisplay) -> None:
        try:
            display = open_display(
                self._system, self._graph.survey(), self._frames, self._meshes, shown.look
            )
            shown.open(display)
        except RoszError as error:
            shown.wait(str(error) if self._graph.complete else "")


class _ShownDisplay:
    """One display: its settings, and its drawing in the view."""

    def __init__(
        self,
        system: System,
        scene: ui.scene,
        look: Look,
        changed: Callable[[], None],
        remove: Callable[[_ShownDisplay], None],
    ) -> None:
        self.look = look
        self.display: Display | None = None
        self._system = system
        self._scene = scene
        self._changed = changed
        self._key = ""
        self._number = 0
        self._drawn: _Drawn | ui.interactive_image | None = None
        with ui.column().classes("rosz-card w-full pl-3 pr-1 py-1 gap-0") as self._card:
            with ui.row().classes("w-full items-center gap-1 no-wrap"):
                ui.checkbox(
                    value=look.visible, on_change=lambda event: self._set(visible=bool(event.value))
                ).props(f'dense size=sm aria-label="Show {look.name}"')
                ui.label(look.name).classes("font-semibold break-all grow min-w-0 pl-1")
                self._tune = ui.button(icon="tune", on_click=self._toggle).props(
                    f'flat dense round size=sm aria-label="Settings of {look.name}"'
                )
                ui.button(icon="close", on_click=lambda: remove(self)).props(
                    f'flat dense round size=sm aria-label="Remove {look.name}"'
                )
            self._status = ui.label("").classes("rosz-soft rosz-number text-xs")
            self._fault = ui.label("").classes("rosz-state-bad text-xs")
            self._settings = ui.row().classes("w-full items-center gap-2 pr-2")
        self._settings.set_visibility(False)
        self._fault.set_visibility(False)

    def _toggle(self) -> None:
        self._settings.set_visibility(not self._settings.visible)

    def _add_settings(self, kind: str) -> None:
        choices = _CHOICES.get(kind, {})
        self._tune.set_visibility(
            kind not in _OWN_COLORS & _OWN_SIZES or bool(choices) or kind in _TEXTS
        )
        with self._settings:
            if choices:
                ui.select(
                    {"": "by default", **choices},
                    value=self.look.color if self.look.color in choices else "",
                    label="Colors",
                    on_change=lambda e: self._set(color=str(e.value or "")),
                ).classes("grow min-w-0")
            if kind not in _OWN_COLORS:
                shown = self.look.color if self.look.color.startswith("#") else ""
                ui.color_input(
                    "Color", value=shown, on_change=lambda e: self._color(e.value or "")
                ).props("dense").classes("grow min-w-0")
            self._add_numbers(kind)
            if kind in _TEXTS:
                field, label = _TEXTS[kind]
                ui.input(
                    label,
                    value=getattr(self.look, field),
                    on_change=lambda e: self._set(**{field: str(e.value or "").strip("/")}),
                ).props("debounce=400").classes("grow min-w-0")

    def _add_numbers(self, kind: str) -> None:
        size: _Number = ("size", _UNITS.get(kind, "Size (m)"), float)
        numbers = [] if kind in _OWN_SIZES else [size]
        for key, title, form in (*numbers, *_NUMBERS.get(kind, ())):
            ui.number(
                title,
                value=getattr(self.look, key) or None,
                min=0,
                step=0.1 if key == "size" else None,
                precision=0 if form is int else None,
                on_change=lambda e, key=key, form=form: self._set(**{key: form(e.value or 0)}),
            ).classes("w-20")

    def _set(self, **changes: Any) -> None:
        self.look = msgspec.structs.replace(self.look, **changes)
        if self.display is not None:
            self.display.look = self.look
        self._changed()

    def _color(self, value: str) -> None:
        if value.startswith("#") or (not value and self.look.color.startswith("#")):
            self._set(color=value)

    def open(self, display: Display) -> None:
        """Show the drawing of a display."""
        self.display = display
        self._key = self._system.pictures.add(display.encoded)
        if display.kind in IMAGE_TYPES:
            with self._card:
                self._drawn = ui.interactive_image().classes("w-full pr-2 pb-1")
        else:
            with self._scene:
                self._drawn = _Drawn("")
        self._add_settings(display.kind)

    def wait(self, fault: str) -> None:
        """Say why there is nothing to show yet."""
        layout.show_text(self._fault, fault)

    def refresh(self, fixed: str) -> None:
        """Send new drawings to the browser."""
        if self.display is None or self._drawn is None:
            return
        if self.display.refresh(fixed):
            self._number += 1
            address = f"/picture/{self._key}?n={self._number}"
            if isinstance(self._drawn, _Drawn):
                self._drawn.renew(address)
            else:
                self._drawn.set_source(address)
        if not isinstance(self._drawn, _Drawn):
            self._drawn.set_visibility(self.look.visible)
        kind, status = self.display.kind, self.display.status
        layout.show_text(self._status, f"{kind}: {status}" if status else kind)
        layout.show_text(self._fault, self.display.fault)

    def remove(self) -> None:
        """Take it off the page."""
        self.close()
        if isinstance(self._drawn, _Drawn):
            self._drawn.delete()
        self._card.delete()

    def close(self) -> None:
        """Unsubscribe."""
        self._system.pictures.remove(self._key)
        if self.display is not None:
            self.display.close()
