"""Fields over time, as rqt_plot shows them."""

from __future__ import annotations

import time
from typing import Any
from urllib.parse import urlencode

from nicegui import ui

from rosz.errors import RoszError
from rosz.web.model import Plot, System, split_fields
from rosz.web.pages.layout import Frame, address_of, empty_state

__all__ = ("show_plot",)

_PERIOD = 0.2
_WINDOWS = {5: "5 s", 10: "10 s", 30: "30 s", 60: "1 min", 300: "5 min"}
_MOST = 600
_COLORS = [
    "#2f6fed",
    "#e07b1a",
    "#1f9d61",
    "#c8342b",
    "#8a4fd0",
    "#0f9bb0",
    "#c13c8b",
    "#7a8a1c",
    "#5b6b85",
    "#a0612d",
]


def show_plot(system: System, fields: str, window: int) -> None:
    """Build the page.

    Args:
        system: The system.
        fields: Fields to plot, such as ``/turtle1/pose/x:y``.
        window: Seconds that are shown.
    """
    _PlotPage(system, split_fields(fields), window if window in _WINDOWS else 10)


class _PlotPage:
    """The chart and the fields in it."""

    def __init__(self, system: System, fields: list[str], window: int) -> None:
        self._frame = frame = Frame(system, "Plot", "/plot")
        self._graph = frame.use(system.graph)
        self._system = system
        self._plot = Plot(system.node)
        frame.keep(self._plot)
        self._wanted = fields
        self._window = window
        self._paused = False
        self._end = time.time()
        with frame.content:
            with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-2"):
                self._input = ui.input("Field", placeholder="/turtle1/pose/x:y").props("dense")
                self._input.classes("grow min-w-52").on("keydown.enter", self._add)
                ui.button("Add", icon="add", on_click=self._add).props("flat dense no-caps")
                ui.select(
                    _WINDOWS,
                    value=window,
                    label="Window",
                    on_change=lambda change: self._choose(change.value),
                ).props("dense options-dense").classes("w-24")
                self._pause = ui.button("Pause", icon="pause", on_click=self._toggle).props(
                    "flat dense no-caps"
                )
                ui.button(
                    "CSV",
                    icon="download",
                    on_click=lambda: ui.download.content(self._plot.table(), "plot.csv"),
                ).props("flat dense no-caps")
            self._chips = ui.row().classes("w-full gap-2")
            self._empty = empty_state(
                "show_chart",
                "No field is plotted",
                "Write a topic and a field of it above, such as this; x:y stands for two fields:",
                "/turtle1/pose/x:y",
            )
            with ui.column().classes("rosz-card w-full p-2") as self._card:
                self._chart = ui.echart(_options()).classes("w-full").style("height: 60vh")
        self._show_fields()
        frame.every(_PERIOD, self._refresh)

    def _add(self) -> None:
        self._wanted += split_fields(self._input.value or "")
        self._input.set_value("")
        self._open_wanted(final=True)

    def _open_wanted(self, *, final: bool) -> None:
        """Plot the fields that are wanted; those that are not there yet stay wanted."""
        waiting: list[str] = []
        faults: list[str] = []
        for name in self._wanted:
            try:
                self._system.permission.check("subscribe", name)
                self._plot.add(self._graph.survey(), name)
            except RoszError as error:
                faults.append(str(error))
                waiting.append(name)
        opened = len(waiting) < len(self._wanted)
        self._wanted = [] if final else waiting
        if final:
            for fault in faults:
                ui.notify(fault, type="negative")
        elif self._graph.complete:
            self._frame.show_fault("; ".join(faults))
        if opened:
            self._show_fields()
            self._show_address()

    def _show_fields(self) -> None:
        self._chips.clear()
        fields = self._plot.fields
        with self._chips:
            for name in fields:
                ui.chip(
                    name,
                    removable=True,
                    color="secondary",
                    text_color="white",
                    on_value_change=lambda _, name=name: self._remove(name),
                ).props("dense")
        self._empty.set_visibility(not fields)
        self._card.set_visibility(bool(fields))

    def _remove(self, name: str) -> None:
        self._plot.remove(name)
        self._show_fields()
        self._show_address()

    def _show_address(self) -> None:
        query = urlencode(
            {"fields": ",".join(self._plot.fields), "window": self._window}, safe="/,[]"
        )
        address_of(f"/plot?{query}")

    def _choose(self, window: int) -> None:
        self._window = window
        self._show_address()
        self._draw()

    def _toggle(self) -> None:
        self._paused = not self._paused
        self._end = time.time()
        self._pause.props(f"icon={'play_arrow' if self._paused else 'pause'}")
        self._pause.set_text("Go on" if self._paused else "Pause")

    def _refresh(self) -> None:
        if self._wanted:
            self._open_wanted(final=False)
        if not self._paused and self._plot.fields:
            self._end = time.time()
            self._draw()

    def _draw(self) -> None:
        begin = self._end - self._window
        series = [
            {
                "name": one.name,
                "type": "line",
                "showSymbol": False,
                "animation": False,
                "color": _COLORS[number % len(_COLORS)],
                "data": [[round(t * 1000), v] for t, v in one.since(begin, _MOST)],
            }
            for number, one in enumerate(self._plot.series())
        ]
        options = self._chart.options
        options["series"] = series
        options["xAxis"]["min"] = round(begin * 1000)
        options["xAxis"]["max"] = round(self._end * 1000)


def _options() -> dict[str, Any]:
    gray = "#8a94a6"
    axis = {
        "axisLabel": {"color": gray, "hideOverlap": True},
        "splitLine": {"lineStyle": {"color": "#8a94a633"}},
    }
    return {
        "animation": False,
        "grid": {"left": 12, "right": 16, "top": 40, "bottom": 12, "containLabel": True},
        "legend": {"type": "scroll", "top": 4, "textStyle": {"color": gray}},
        "tooltip": {"trigger": "axis"},
        "dataZoom": [{"type": "inside"}],
        "xAxis": {"type": "time", **axis},
        "yAxis": {"type": "value", "scale": True, **axis},
        "series": [],
    }
