"""Sliders, switches and choices for the settings of nodes, as rqt_reconfigure has them."""

from __future__ import annotations

import math
from typing import Any

from nicegui import ui
from nicegui.elements.mixins.value_element import ValueElement

from rosz.errors import RoszError
from rosz.reconfigure import Config, Description, Group, Setting, find_servers
from rosz.web.model import Reconfiguration, System
from rosz.web.pages import layout

_LIST_PERIOD = 1.0
_PERIOD = 0.1
_STEPS = 200
_WIDEST = 1e9


class ReconfigurePage:
    """The choice of a server, the first one if it is empty, and its settings."""

    def __init__(self, system: System, server: str = "") -> None:
        self._system = system
        self._frame = frame = layout.Frame(system, "Reconfigure", "/reconfigure")
        self._graph = frame.use(system.graph)
        self._open: layout.Opened[Reconfiguration] = layout.Opened(frame)
        self._shown: Description | None = None
        self._seen = 0
        self._widgets: dict[str, list[ValueElement[Any]]] = {}
        self._values: dict[str, Any] = {}
        self._pending: dict[str, Any] = {}
        self._busy = False
        with frame.content:
            with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-2"):
                self._select = layout.add_select(
                    "Node", server, lambda change: self._choose(change.value)
                )
                self._select.classes("grow")
            self._empty = layout.empty_state(
                "tune",
                "No node has settings",
                "Nodes with a server of dynamic_reconfigure appear here, such as:",
                "rosz run rosz_tutorials wave.py",
            )
            self._box = ui.column().classes("w-full gap-4")
        frame.every(_LIST_PERIOD, self._list)
        if server:
            self._choose(server)
        ui.timer(_PERIOD, self._refresh)

    def _list(self) -> None:
        servers = find_servers(self._graph.survey().view)
        options = layout.offer_options(self._select, servers)
        if not self._select.value and options:
            self._select.set_value(options[0])
        self._empty.set_visibility(not options and self._graph.complete)

    def _choose(self, name: str | None) -> None:
        if self._open.value is not None and self._open.value.name == name:
            return
        self._open.close()
        self._box.clear()
        self._shown, self._seen = None, 0
        self._pending.clear()
        if name:
            layout.address_of(layout.query_of("/reconfigure", server=name))
            try:
                self._open.set(Reconfiguration(self._system.node, self._system.permission, name))
            except RoszError as error:
                self._frame.show_fault(str(error))

    async def _refresh(self) -> None:
        opened = self._open.value
        state = None if opened is None else opened.state()
        if opened is None or state is None:
            return
        description, config = state
        if description is not self._shown:
            self._shown = description
            self._build(description, config)
        elif opened.version != self._seen:
            self._show(config)
        self._seen = opened.version
        if self._pending and not self._busy:
            changes, self._pending = self._pending, {}
            self._busy = True
            await self._frame.attempt(lambda: opened.update(changes))
            self._busy = False
            if (state := opened.state()) is not None and not self._pending:
                self._show(state[1])

    # The settings.

    def _build(self, description: Description, config: Config) -> None:
        self._box.clear()
        self._widgets = {}
        self._values = {name: config[name] for name in description.settings}
        with self._box:
            self._add_group(description.root, outer=True)

    def _add_group(self, group: Group, *, outer: bool = False) -> None:
        with ui.column().classes("rosz-card w-full p-4 gap-3 min-w-0"):
            if not outer:
                ui.label(group.name).classes("text-base font-semibold")
            for setting in group.settings:
                self._add_setting(setting)
            for inner in group.groups:
                self._add_group(inner)

    def _add_setting(self, setting: Setting) -> None:
        with ui.row().classes("w-full items-center gap-x-4 gap-y-0"):
            with ui.column().classes("gap-0 w-44"):
                ui.label(setting.name).classes("font-medium break-all")
                if setting.description:
                    ui.label(setting.description).classes("rosz-soft text-xs")
            self._widgets[setting.name] = self._editors(setting)

    def _editors(self, setting: Setting) -> list[ValueElement[Any]]:
        name, value = setting.name, self._values[setting.name]
        label = f'aria-label="{name}"'

        def change(event: Any) -> None:
            self._change(setting, event.value)

        if setting.choices:
            options = {choice.value: choice.name for choice in setting.choices}
            options.setdefault(value, str(value))
            select = ui.select(options, value=value, on_change=change).classes("grow min-w-40")
            return [select.props(label)]
        if setting.kind == "bool":
            return [ui.switch(value=bool(value), on_change=change).props(label, remove="dense")]
        if setting.kind == "str":
            text = ui.input(value=str(value), on_change=change).classes("grow min-w-40")
            return [text.props(f"debounce=400 {label}")]
        whole = setting.kind == "int"
        editors: list[ValueElement[Any]] = []
        low, high = float(setting.min or 0), float(setting.max or 0)
        if math.isfinite(low) and math.isfinite(high) and 0 < high - low < _WIDEST:
            step = 1 if whole else (high - low) / _STEPS
            editors.append(
                ui.slider(min=low, max=high, step=step, value=value, on_change=change)
                .props(label)
                .classes("px-2")
                .style("width: auto; flex: 1 1 8rem")
            )
        bounded = bool(editors)
        number = ui.number(
            value=value,
            min=low if bounded else None,
            max=high if bounded else None,
            on_change=change,
        )
        editors.append(number.props(f"debounce=400 {label}").classes("w-28"))
        return editors

    def _change(self, setting: Setting, value: Any) -> None:
        if value is None:
            return
        if setting.kind == "int" and not setting.choices:
            value = int(value)
        if value != self._values.get(setting.name):
            self._values[setting.name] = value
            self._pending[setting.name] = value

    def _show(self, config: Config) -> None:
        """Show values that came, but not in place of those that were just chosen here."""
        for name, widgets in self._widgets.items():
            if name in self._pending:
                continue
            self._values[name] = config[name]
            for widget in widgets:
                if widget.value != config[name]:
                    widget.set_value(config[name])
