"""The first page: nodes, topics with what flows on them, and what the doctor found."""

from __future__ import annotations

import time
from typing import Any
from urllib.parse import quote

from nicegui import ui

from rosz.introspect.nodes import list_nodes, machines
from rosz.introspect.survey import Survey
from rosz.introspect.topics import list_topics
from rosz.web.model import Findings, System, Traffic
from rosz.web.pages.layout import Frame, bandwidth_text, empty_state, rate_text

__all__ = ("show_overview",)

_PERIOD = 1.0
_ROWS = 15
_LINK_CELL = """<q-td :props="props"><a :href="props.row.address">{{ props.value }}</a></q-td>"""
_HOUR, _MINUTE = 3600, 60


def show_overview(system: System) -> None:
    """Build the page."""
    frame = Frame(system, "Overview", "/")
    graph, traffic = frame.use(system.graph), frame.use(system.traffic)
    findings = frame.use(system.findings)
    with frame.content:
        tiles = _Tiles()
        doctor = _Doctor(findings)
        empty = empty_state(
            "rocket_launch",
            "No node runs on this network",
            "Start a launch file, a node or an example; it appears here at once:",
            "rosz run turtlesim turtlesim_node",
        )
        tables = _Tables(traffic)

    def refresh() -> None:
        survey = graph.survey()
        traffic.update(survey)
        own = system.node.name
        rows = tables.update(survey, own)
        empty.set_visibility(graph.complete and not rows)
        tiles.update(survey, own, findings)
        doctor.update()

    frame.every(_PERIOD, refresh)


class _Tiles:
    """Numbers at the top."""

    def __init__(self) -> None:
        self._labels: dict[str, ui.label] = {}
        with ui.row().classes("w-full gap-3 grid grid-cols-2 sm:grid-cols-4"):
            for name, icon in (
                ("Nodes", "hexagon"),
                ("Topics", "swap_horiz"),
                ("Machines", "dns"),
                ("Findings", "health_and_safety"),
            ):
                with ui.row().classes("rosz-card p-4 items-center gap-3 no-wrap"):
                    ui.icon(icon, size="28px").classes("text-primary")
                    with ui.column().classes("gap-0"):
                        self._labels[name] = ui.label("—").classes(
                            "text-2xl font-semibold rosz-number leading-tight"
                        )
                        ui.label(name).classes("rosz-soft text-sm")

    def update(self, survey: Survey, own: str, findings: Findings) -> None:
        nodes = [one for one in list_nodes(survey) if one.name != own]
        topics = list_topics(token for token in survey.view.tokens if token.node_name != own)
        found = findings.found
        for name, value in (
            ("Nodes", str(len(nodes))),
            ("Topics", str(len(topics))),
            ("Machines", str(len(machines(nodes)))),
            ("Findings", "…" if found is None else str(len(found))),
        ):
            if self._labels[name].text != value:
                self._labels[name].set_text(value)


class _Doctor:
    """The findings of the doctor."""

    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self._shown: object = ()
        self._box = ui.column().classes("w-full gap-2")

    def update(self) -> None:
        shown = (self._findings.found, self._findings.fault)
        if shown == self._shown:
            return
        self._shown = shown
        self._box.clear()
        found, fault = shown
        with self._box:
            if fault:
                ui.label(fault).classes("rosz-card w-full p-3 text-negative")
            for finding in found or ():
                color = "negative" if finding.level == "error" else "warning"
                icon = "error" if finding.level == "error" else "warning"
                with (
                    ui.expansion(finding.text, icon=icon)
                    .classes("rosz-card w-full")
                    .props(f'header-class="text-{color}" dense-toggle')
                ):
                    for line in finding.evidence:
                        ui.label(line).classes("rosz-mono break-all")
                    ui.label(f"What to do: {finding.remedy}").classes("pt-2")


class _Tables:
    """The tables of nodes and topics."""

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self._box = ui.column().classes("w-full gap-4")
        with self._box:
            self._add_topics()
            self._add_nodes()

    def _add_topics(self) -> None:
        with ui.column().classes("rosz-card w-full p-0 gap-0"):
            with ui.row().classes("w-full items-center px-4 pt-3 gap-3"):
                ui.label("Topics").classes("text-base font-semibold")
                ui.space()
                with ui.switch(
                    value=self._traffic.everything,
                    on_change=lambda change: setattr(self._traffic, "everything", change.value),
                ).props('dense aria-label="Measure all topics"'):
                    ui.tooltip(
                        "Measuring a topic means to receive it. Without this, images, clouds, maps"
                        " and topics of other machines are not measured."
                    )
                ui.label("measure all").classes("rosz-soft text-sm -ml-2")
                search = ui.input(placeholder="Filter").props("dense clearable").classes("w-40")
            self.topics = (
                ui.table(
                    rows=[],
                    columns=[
                        _column("name", "Topic"),
                        _column("type", "Type", "rosz-wide rosz-soft"),
                        _column("rate", "Rate", "rosz-number", align="right", sort="rate_value"),
                        _column(
                            "bandwidth",
                            "Bandwidth",
                            "rosz-number",
                            align="right",
                            sort="bandwidth_value",
                        ),
                        _column("publishers", "Pub", "rosz-number rosz-wide", align="right"),
                        _column("subscribers", "Sub", "rosz-number rosz-wide", align="right"),
                    ],
                    row_key="name",
                    pagination=_ROWS,
                )
                .classes("w-full")
                .props("flat dense")
            )
            self.topics.add_slot("body-cell-name", _LINK_CELL)
            search.on_value_change(
                lambda change: setattr(self.topics, "filter", change.value or "")
            )

    def _add_nodes(self) -> None:
        with ui.column().classes("rosz-card w-full p-0 gap-0"):
            ui.label("Nodes").classes("text-base font-semibold px-4 pt-3")
            self.nodes = (
                ui.table(
                    rows=[],
                    columns=[
                        _column("name", "Node"),
                        _column("host", "Machine"),
                        _column("pid", "Process", "rosz-number", align="right"),
                        _column("since", "Running for", "rosz-number rosz-wide", align="right"),
                    ],
                    row_key="key",
                    pagination=_ROWS,
                )
                .classes("w-full")
                .props("flat dense")
            )

    def update(self, survey: Survey, own: str) -> int:
        """Show what there is, and return the number of nodes."""
        topics = [
            self._topic_row(topic.name, topic.type_text, topic.publishers, topic.subscribers)
            for topic in list_topics(t for t in survey.view.tokens if t.node_name != own)
        ]
        nodes = [
            {
                "key": f"{one.name} {one.session} {one.pid}",
                "name": one.name,
                "host": one.host or "—",
                "pid": one.pid or "—",
                "since": _since(one.started),
            }
            for one in list_nodes(survey)
            if one.name != own
        ]
        for table, rows in ((self.topics, topics), (self.nodes, nodes)):
            if table.rows != rows:
                table.rows = rows
        self._box.set_visibility(bool(nodes))
        return len(nodes)

    def _topic_row(
        self, name: str, type_text: str, publishers: tuple[str, ...], subscribers: tuple[str, ...]
    ) -> dict[str, Any]:
        flow = self._traffic.flow(name)
        return {
            "name": name,
            "address": f"/topics?topic={quote(name, safe='/')}",
            "type": type_text,
            "rate": "—" if flow is None else rate_text(flow.rate),
            "rate_value": -1.0 if flow is None else round(flow.rate, 1),
            "bandwidth": "—" if flow is None else bandwidth_text(flow.bandwidth),
            "bandwidth_value": -1.0 if flow is None else round(flow.bandwidth),
            "publishers": len(publishers),
            "subscribers": len(subscribers),
        }


def _column(
    name: str, label: str, classes: str = "", *, align: str = "left", sort: str = ""
) -> dict[str, Any]:
    column: dict[str, Any] = {
        "name": name,
        "label": label,
        "field": name,
        "align": align,
        "sortable": True,
        "classes": classes,
        "headerClasses": classes.replace("rosz-soft", ""),
    }
    if sort:
        column[":sort"] = f"(a, b, one, other) => one.{sort} - other.{sort}"
    return column


def _since(started: int) -> str:
    """Return how long ago a time in nanoseconds since the Unix epoch was."""
    if not started:
        return "—"
    seconds = max(0, int(time.time() - started / 1e9))
    if seconds >= _HOUR:
        return f"{seconds // _HOUR} h {seconds % _HOUR // _MINUTE} min"
    if seconds >= _MINUTE:
        return f"{seconds // _MINUTE} min"
    return "under 1 min"
