"""The log of all nodes, as rqt_console shows it, and the levels of loggers."""

from __future__ import annotations

import datetime as dt
import math
import time

import msgspec
from nicegui import ui

from rosz.errors import UsageError
from rosz.introspect import LogFilter, LogLine, find_nodes, format_line, get_levels, set_level
from rosz.web.model import System
from rosz.web.pages import layout

_PERIOD = 0.5
_MOST = 300
_MOST_SAVED = 10_000
_LEVELS = ["DEBUG", "INFO", "WARN", "ERROR", "FATAL"]
_LEVEL_CELL = """<q-td :props="props"><q-badge :class="'rosz-level-' + props.value"
:label="props.value" /></q-td>"""
_TEXT_CELL = """<q-td :props="props" style="white-space: pre-wrap; word-break: break-word">
{{ props.value }}<div class="rosz-soft rosz-narrow" style="font-size: .75rem">
{{ props.row.node }} {{ props.row.time }}</div></q-td>"""
_NODE_CELL = """<q-td :props="props"><a :href="props.row.address"
@click.exact.prevent>{{ props.value }}</a></q-td>"""
_PICK_NODE = """(event, row) => {
  if (event.target.closest('a') && event.defaultPrevented) emit(row.node);
}"""


class _Wanted(msgspec.Struct, frozen=True):
    """The lines that a page shows."""

    node: str = ""
    level: str = "DEBUG"
    pattern: str = ""
    begin: str = ""
    end: str = ""

    def times(self) -> tuple[float, float]:
        """Return both times in seconds since the Unix epoch.

        A text that is not a time sets no limit.
        """
        today = dt.datetime.now().astimezone()
        bounds = [0.0, math.inf]
        for number, text in enumerate((self.begin, self.end)):
            try:
                clock = dt.time.fromisoformat(text)
            except ValueError:
                continue
            bounds[number] = dt.datetime.combine(today, clock, today.tzinfo).timestamp()
        return bounds[0], bounds[1]


class ConsolePage:
    """The table of lines with its filter.

    Args:
        system: The system.
        node: Node or namespace; empty for all.
        level: The lowest level.
        pattern: Pattern in the text.
        begin: Time of today from which on, such as ``14:05`` or ``14:05:30``; empty for all.
        end: Time of today up to which.
    """

    def __init__(
        self,
        system: System,
        node: str = "",
        level: str = "DEBUG",
        pattern: str = "",
        begin: str = "",
        end: str = "",
    ) -> None:
        self._system = system
        self._frame = frame = layout.Frame(system, "Console", "/console")
        if objection := system.permission.objection("subscribe", "/rosout"):
            frame.show_fault(objection)
            return
        self._graph, self._book = frame.use(system.graph), frame.use(system.console)
        lowest = level if level in _LEVELS else "DEBUG"
        self._choice = _Wanted(node, lowest, pattern, begin, end)
        self._wanted = self._make_filter()
        self._until: int | None = None
        self._shown: object = None
        with frame.content:
            self._add_filter()
            self._table = self._add_table()
            self._empty = layout.empty_state(
                "subject",
                "No line yet",
                "Lines appear as nodes log them. A node that logs:",
                "rosz run rosz_tutorials publisher.py",
            )
        frame.every(_PERIOD, self._refresh)

    def _add_filter(self) -> None:
        choice = self._choice
        self._inputs: dict[str, ui.input] = {}
        with ui.row().classes("rosz-card w-full items-center gap-2 px-3 py-2"):
            ui.select(
                _LEVELS,
                value=choice.level,
                label="Lowest level",
                on_change=lambda change: self._filter(level=change.value),
            ).classes("w-24")
            for field, label, props in (
                ("node", "Node", "clearable"),
                ("pattern", "Text", "clearable"),
                ("begin", "From", "type=time step=1 stack-label"),
                ("end", "To", "type=time step=1 stack-label"),
            ):
                self._inputs[field] = ui.input(
                    label,
                    value=getattr(choice, field),
                    on_change=lambda change, field=field: self._filter(
                        **{field: change.value or ""}
                    ),
                )
                self._inputs[field].props(f"debounce=300 {props}").classes("w-28")
            ui.space()
            self._pause = layout.tool_button("Pause", "pause", self._toggle)
            layout.tool_button("Clear", "delete_sweep", self._clear)
            layout.tool_button("Save", "download", self._save)
            layout.tool_button("Levels", "tune", self._show_levels)

    def _add_table(self) -> ui.table:
        columns = [
            layout.column("level", "Level"),
            layout.column("text", "Message"),
            layout.column("node", "Node", "rosz-wide"),
            layout.column("time", "Time", "rosz-wide rosz-number"),
            layout.column("place", "Place", "rosz-wide rosz-soft"),
        ]
        table = ui.table(rows=[], columns=columns, row_key="id").classes("rosz-card w-full")
        table.props('flat dense virtual-scroll :rows-per-page-options="[0]"')
        table.style("max-height: calc(100vh - 220px)")
        table.add_slot("body-cell-level", _LEVEL_CELL)
        table.add_slot("body-cell-text", _TEXT_CELL)
        table.add_slot("body-cell-node", _NODE_CELL)
        table.on(
            "row-click",
            lambda event: self._inputs["node"].set_value(str(event.args)),
            js_handler=_PICK_NODE,
        )
        return table

    def _filter(self, **changes: str) -> None:
        self._choice = msgspec.structs.replace(self._choice, **changes)
        self._wanted = self._make_filter()
        given = {
            name: value
            for name, value in msgspec.structs.asdict(self._choice).items()
            if value != getattr(_Wanted(), name)
        }
        layout.address_of(layout.query_of("/console", **given))
        self._shown = None
        self._refresh()

    def _make_filter(self) -> LogFilter:
        """Return a filter; one without the pattern if that is not a regular expression."""
        choice = self._choice
        name = choice.node.strip()
        nodes = (name if name.startswith("/") else f"/{name}",) if name else ()
        try:
            log_filter = LogFilter(nodes, choice.level, choice.pattern)
        except UsageError as error:
            self._frame.show_fault(str(error))
            return LogFilter(nodes, choice.level)
        self._frame.show_fault("")
        return log_filter

    def _toggle(self) -> None:
        self._until = self._book.received if self._until is None else None
        paused = self._until is not None
        self._pause.props(f"icon={'play_arrow' if paused else 'pause'}")
        self._pause.set_text("Go on" if paused else "Pause")

    def _clear(self) -> None:
        self._book.clear()
        self._shown = None

    def _newest(self, most: int) -> list[tuple[int, LogLine]]:
        nodes = self._graph.survey().view.nodes()
        return self._book.newest(self._wanted, nodes, most, self._until, self._choice.times())

    def _refresh(self) -> None:
        state = (self._until or self._book.received, self._wanted)
        if state == self._shown:
            return
        self._shown = state
        rows = [
            {
                "id": number,
                "level": line.level,
                "text": line.text,
                "node": line.node,
                "address": layout.query_of("/console", node=line.node),
                "time": time.strftime("%H:%M:%S", time.localtime(line.stamp))
                + f".{line.stamp % 1 * 1000:03.0f}"[:4],
                "place": f"{line.file.rpartition('/')[2]}:{line.line}",
            }
            for number, line in self._newest(_MOST)
        ]
        self._table.rows = rows
        self._table.set_visibility(bool(rows))
        self._empty.set_visibility(not rows)

    def _save(self) -> None:
        lines = [format_line(line) for _, line in reversed(self._newest(_MOST_SAVED))]
        ui.download.content("\n".join([*lines, ""]), "console.txt")

    def _show_levels(self) -> None:
        processes = self._graph.survey().processes.values()
        nodes = sorted({process.node for process in processes} - {self._system.node.name})
        with ui.dialog(value=True), ui.card().classes("rosz-card w-96"):
            ui.label("Levels of loggers").classes("text-base font-semibold")
            if not nodes:
                ui.label("No node of rosz runs here; nodes of ROS 2 have their own tools.")
                return
            select = ui.select(nodes, label="Node", value=None).classes("w-full")
            box = ui.column().classes("w-full gap-1")

        async def load() -> None:
            name = str(select.value)
            levels = await self._frame.attempt(lambda: self._levels(name))
            box.clear()
            with box:
                for logger, level in (levels or {}).items():
                    ui.select(
                        _LEVELS,
                        label=logger,
                        value=level if level in _LEVELS else None,
                        on_change=lambda change, logger=logger: self._set_level(
                            name, logger, change.value
                        ),
                    ).classes("w-full")

        select.on_value_change(load)

    def _levels(self, name: str) -> dict[str, str]:
        (node, *_) = find_nodes(self._graph.survey(), name)
        return get_levels(self._system.node.context.session, node)

    async def _set_level(self, name: str, logger: str, level: str) -> None:
        def act() -> None:
            self._system.permission.check_control(f"control '{name}'")
            for node in find_nodes(self._graph.survey(), name):
                set_level(self._system.node.context.session, node, logger, level)

        await self._frame.attempt(act, f"{logger} of {name} is {level}")
