"""Fields over time, as rqt_plot shows them."""

from __future__ import annotations

import base64
import time
from typing import Any

from nicegui import ui

from rosz.errors import RoszError
from rosz.web.model import Plot, System, split_fields
from rosz.web.pages.layout import Frame, address_of, empty_state, query_of, tool_button

_PERIOD = 0.2
_LIST_PERIOD = 2.0
_SLOWEST = 5.0
"""Seconds after which the next picture is sent to a browser that has not drawn the last one."""
_WINDOWS = {5: "5 s", 10: "10 s", 30: "30 s", 60: "1 min", 300: "5 min"}
_TIMES = {"arrival": "Arrival", "stamp": "Header stamp"}
_MOST, _FEWEST, _TOGETHER = 600, 120, 6000
"""Points that are drawn of one series, of one of many, and of all."""
_AXES = 4
_OFFSET = 52
_PICTURE_SECONDS = 10.0
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
_LEAF = """<span v-if="props.node.field" draggable="true" class="cursor-grab"
@dragstart="(event) => event.dataTransfer.setData('text/plain', props.node.field)">
{{ props.node.name }}</span><span v-else>{{ props.node.name }}</span>"""
_DROP = "(event) => { event.preventDefault(); emit(event.dataTransfer.getData('text/plain')); }"


class PlotPage:
    """The chart and the fields in it.

    Args:
        system: The system.
        fields: Fields to plot, such as ``/turtle1/pose/x:y``; ``@2`` puts one on the second axis.
        window: Seconds that are shown.
        times: ``arrival``, or ``stamp`` for the time in headers.
    """

    def __init__(
        self, system: System, fields: str = "", window: int = 10, times: str = "arrival"
    ) -> None:
        self._frame = frame = Frame(system, "Plot", "/plot")
        self._graph = frame.use(system.graph)
        self._system = system
        self._times = times if times in _TIMES else "arrival"
        self._plot = Plot(system.node, stamped=times == "stamp")
        frame.keep(self)
        self._axes = _axes_of(fields)
        self._wanted = list(self._axes)
        self._window = window if window in _WINDOWS else 10
        self._paused = False
        self._end = time.time()
        self._is_drawn = True
        self._drew = 0.0
        self._offered: dict[str, list[str]] = {}
        with frame.content:
            self._add_choices()
            self._chips = ui.row().classes("w-full gap-2")
            with ui.row().classes("w-full gap-4 items-start"):
                self._add_tree()
                with (
                    ui.column()
                    .classes("grow min-w-0 gap-4")
                    .style("flex-basis: 20rem")
                    .on("dragover", js_handler="(event) => event.preventDefault()")
                    .on("drop", lambda event: self._want(str(event.args or "")), js_handler=_DROP)
                ):
                    self._empty = empty_state(
                        "show_chart",
                        "No field is plotted",
                        "Write a topic and a field of it above, such as this, or drag one here;"
                        " x:y stands for two fields:",
                        "/turtle1/pose/x:y",
                    )
                    with ui.column().classes("rosz-card w-full p-2") as self._card:
                        self._chart = ui.echart(_options()).classes("w-full")
                        self._chart.classes("rosz-chart")
                        self._chart.on("chart:datazoom", lambda: self._set_paused(paused=True), [])
                        self._chart.on("chart:finished", self._note_drawn, [])
        self._show_fields()
        frame.every(_LIST_PERIOD, self._offer)
        frame.every(_PERIOD, self._refresh)

    def _add_choices(self) -> None:
        with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-2"):
            self._input = (
                ui.input("Field", placeholder="/turtle1/pose/x:y", autocomplete=[])
                .classes("grow min-w-52")
                .on("keydown.enter", self._add)
            )
            tool_button("Add", "add", self._add)
            ui.select(
                _WINDOWS,
                value=self._window,
                label="Window",
                on_change=lambda change: self._choose_window(change.value),
            ).classes("w-20")
            ui.select(
                _TIMES,
                value=self._times,
                label="Time",
                on_change=lambda change: self._choose_times(change.value),
            ).classes("w-32")
            self._pause = tool_button(
                "Pause", "pause", lambda: self._set_paused(paused=not self._paused)
            )
            tool_button(
                "CSV", "download", lambda: ui.download.content(self._plot.table(), "plot.csv")
            )
            tool_button("PNG", "download", self._save_picture)

    def _add_tree(self) -> None:
        with ui.expansion("Fields", icon="account_tree", value=not self._axes).classes(
            "rosz-card w-full lg:w-72"
        ):
            ui.label("Drag a field into the chart, or choose it.").classes("rosz-soft text-sm")
            self._tree = (
                ui.tree([], node_key="id", label_key="name", on_select=self._select)
                .props("dense no-transition")
                .classes("rosz-mono w-full overflow-auto")
                .style("max-height: 55vh")
            )
            self._tree.add_slot("default-header", _LEAF)

    def _offer(self) -> None:
        """Offer the fields that there are now."""
        offered = self._plot.offered(self._graph.survey())
        if offered == self._offered:
            return
        self._offered = offered
        self._input.set_autocomplete(
            [f"{topic}/{field}" for topic, fields in offered.items() for field in fields]
        )
        self._tree.props["nodes"] = [
            {
                "id": topic,
                "name": topic,
                "children": [
                    {"id": f"{topic}/{field}", "name": field, "field": f"{topic}/{field}"}
                    for field in fields
                ],
            }
            for topic, fields in offered.items()
        ]
        self._tree.update()

    def _select(self, event: Any) -> None:
        name = str(event.value or "")
        topics = self._offered.items()
        if any(name == f"{topic}/{field}" for topic, fields in topics for field in fields):
            self._want(name)
        elif name:
            self._tree.expand([name])
        self._tree.deselect()

    def _add(self) -> None:
        self._want(self._input.value or "")
        self._input.set_value("")

    def _want(self, text: str) -> None:
        self._wanted += split_fields(text)
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
                axis = self._axes.setdefault(name, 1)
                with ui.chip(
                    name,
                    removable=True,
                    color="secondary",
                    text_color="white",
                    on_click=lambda name=name: self._change_axis(name),
                    on_value_change=lambda _, name=name: self._remove(name),
                ).props("dense"):
                    ui.badge(str(axis), color="primary").classes("ml-2")
                    ui.tooltip(f"On axis {axis}; click for the next one")
        self._empty.set_visibility(not fields)
        self._card.set_visibility(bool(fields))

    def _change_axis(self, name: str) -> None:
        self._axes[name] = self._axes[name] % _AXES + 1
        self._show_changes()

    def _remove(self, name: str) -> None:
        self._plot.remove(name)
        self._axes.pop(name, None)
        self._show_changes()

    def _show_changes(self) -> None:
        self._show_fields()
        self._show_address()
        self._draw()

    def _show_address(self) -> None:
        fields = [
            f"{name}@{axis}" if (axis := self._axes.get(name, 1)) > 1 else name
            for name in (*self._plot.fields, *self._wanted)
        ]
        times = self._times if self._times != "arrival" else ""
        window = str(self._window)
        address_of(query_of("/plot", fields=",".join(fields), window=window, times=times))

    def _choose_window(self, window: int) -> None:
        self._window = window
        self._show_address()
        self._draw()

    def _choose_times(self, times: str) -> None:
        """Begin again, since the points have other times."""
        fields = self._plot.fields
        self._plot.close()
        self._times = times
        self._plot = Plot(self._system.node, stamped=times == "stamp")
        self._wanted = [*fields, *self._wanted]
        self._open_wanted(final=False)
        self._show_address()

    def _set_paused(self, *, paused: bool) -> None:
        if paused == self._paused:
            return
        self._paused = paused
        self._pause.props(f"icon={'play_arrow' if paused else 'pause'}")
        self._pause.set_text("Go on" if paused else "Pause")
        if not paused:
            self._chart.run_chart_method(
                "dispatchAction", {"type": "dataZoom", "start": 0, "end": 100}
            )

    async def _save_picture(self) -> None:
        script = "return document.body.classList.contains('body--dark')"
        is_dark = await ui.run_javascript(script, timeout=_PICTURE_SECONDS)
        back = "#1a1f29" if is_dark else "#ffffff"
        wanted = {"type": "png", "pixelRatio": 2, "backgroundColor": back}
        try:
            address = await self._chart.run_chart_method(
                "getDataURL", wanted, timeout=_PICTURE_SECONDS
            )
        except TimeoutError:
            ui.notify("the browser did not give the picture", type="negative")
            return
        ui.download.content(base64.b64decode(str(address).partition(",")[2]), "plot.png")

    def _refresh(self) -> None:
        if self._wanted:
            self._open_wanted(final=False)
        if self._paused or not self._plot.fields:
            return
        # A browser that draws slowly gets the next picture when it has drawn the last one.
        if self._is_drawn or time.monotonic() - self._drew > _SLOWEST:
            self._draw()

    def _note_drawn(self) -> None:
        self._is_drawn = True

    def _draw(self) -> None:
        lines = self._plot.series()
        if not self._paused:
            newest = max((line.newest for line in lines), default=0.0)
            self._end = newest if self._times == "stamp" and newest else time.time()
        begin = self._end - self._window
        most = min(_MOST, max(_FEWEST, _TOGETHER // max(1, len(lines))))
        series = [
            {
                "name": line.name,
                "type": "line",
                "showSymbol": False,
                "animation": False,
                "color": _COLORS[number % len(_COLORS)],
                "yAxisIndex": self._axis(line.name) - 1,
                "data": [[round(t * 1000), v] for t, v in line.within(begin, self._end, most)],
            }
            for number, line in enumerate(lines)
        ]
        options = self._chart.options
        options["series"] = series
        options["xAxis"]["min"] = round(begin * 1000)
        options["xAxis"]["max"] = round(self._end * 1000)
        used = {line["yAxisIndex"] for line in series}
        for index, axis in enumerate(options["yAxis"]):
            axis["show"] = index in used or not (used or index)
        self._is_drawn = False
        self._drew = time.monotonic()
        self._chart.update()

    def _axis(self, name: str) -> int:
        """Return the axis of a series, which may be of an element of a field."""
        for field in self._plot.fields:
            if name == field or name.startswith(f"{field}["):
                return self._axes.get(field, 1)
        return self._axes.get(name, 1)

    def close(self) -> None:
        """Plot nothing any more."""
        self._plot.close()


def _axes_of(text: str) -> dict[str, int]:
    """Return the axis of each field that an address names."""
    axes: dict[str, int] = {}
    for word in text.replace(",", " ").split():
        fields, _, axis = word.partition("@")
        number = int(axis) if axis.isdecimal() else 1
        axes |= dict.fromkeys(split_fields(fields), min(_AXES, max(1, number)))
    return axes


def _options() -> dict[str, Any]:
    gray = "#8a94a6"
    line = {"color": "#8a94a633"}
    axis = {
        "axisLabel": {"color": gray, "hideOverlap": True},
        "splitLine": {"lineStyle": line},
    }
    return {
        "animation": False,
        "grid": {"left": 12, "right": 16, "top": 40, "bottom": 12, "containLabel": True},
        "legend": {"type": "scroll", "top": 4, "icon": "roundRect", "textStyle": {"color": gray}},
        "tooltip": {"trigger": "axis"},
        "dataZoom": [
            {"type": "inside", "xAxisIndex": 0},
            {"type": "inside", "yAxisIndex": [0, 1, 2, 3], "zoomOnMouseWheel": "shift"},
        ],
        "xAxis": {"type": "time", "axisLine": {"onZero": False}, **axis},
        "yAxis": [
            {
                "type": "value",
                "scale": True,
                "position": "left" if number % 2 else "right",
                "offset": _OFFSET * ((number - 1) // 2),
                "show": number == 1,
                **axis,
                "splitLine": {"lineStyle": line, "show": number == 1},
            }
            for number in range(1, _AXES + 1)
        ],
        "series": [],
    }
