"""The first page: nodes, topics with their traffic, and the doctor's findings."""

from __future__ import annotations

import time
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from rosz import introspect
from rosz.errors import NotFoundError
from rosz.web.model import Findings, System, Traffic
from rosz.web.pages import layout
from rosz.web.pages.launches import LaunchCards, confirm
from rosz.wire import Kind

_PERIOD = 1.0
_ROWS = 15
_KILL_CELL = """<q-td :props="props"><q-btn flat dense round size="sm" icon="close"
:aria-label="'End ' + props.row.name" @click="() => $parent.$emit('kill', props.row)">
<q-tooltip>End this node</q-tooltip></q-btn></q-td>"""
_LINK_CELL = """<q-td :props="props"><a :href="props.row.address">{{ props.value }}</a></q-td>"""


def show_overview(system: System) -> None:
    """Build the page."""
    frame = layout.Frame(system, "Overview", "/")
    graph, traffic = frame.use(system.graph), frame.use(system.traffic)
    findings = frame.use(system.findings)
    with frame.content:
        tiles = _Tiles()
        doctor = _Doctor(findings)
        empty = layout.empty_state(
            "rocket_launch",
            "No node runs on this network",
            "Start a launch file, a node or an example; it appears here at once:",
            "rosz run turtlesim turtlesim_node",
        )
        seen = system.permission.sees_launches
        launches = LaunchCards(frame, frame.use(system.launches)) if seen else None
        tables = _Tables(frame, traffic)

    def refresh() -> None:
        survey = graph.survey()
        traffic.update(survey)
        own = system.node.name
        rows = tables.update(survey, own)
        empty.set_visibility(graph.complete and not rows)
        if launches is not None:
            launches.update()
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

    def update(self, survey: introspect.Survey, own: str, findings: Findings) -> None:
        nodes = [node for node in introspect.list_nodes(survey) if node.name != own]
        topics = introspect.list_topics(
            token for token in survey.view.tokens if token.node_name != own
        )
        shown = findings.found
        for name, value in (
            ("Nodes", str(len(nodes))),
            ("Topics", str(len(topics))),
            ("Machines", str(len(introspect.machines(nodes)))),
            ("Findings", "…" if shown is None else str(len(shown))),
        ):
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
        shown_findings, fault = shown
        with self._box:
            if fault:
                ui.label(fault).classes("rosz-card w-full p-3 text-negative")
            for finding in shown_findings or ():
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

    def __init__(self, frame: layout.Frame, traffic: Traffic) -> None:
        self._frame = frame
        self._traffic = traffic
        self._survey: introspect.Survey
        self._box = ui.column().classes("w-full gap-4")
        with self._box:
            self._add_topics()
            self._add_nodes()
            self._add_machines()

    def _add_topics(self) -> None:
        with ui.column().classes("rosz-card w-full p-0 gap-0"):
            with ui.row().classes("w-full items-center px-4 pt-3 gap-3"):
                ui.label("Topics").classes("text-base font-semibold")
                ui.space()
                with ui.switch(
                    value=self._traffic.everything,
                    on_change=lambda change: setattr(self._traffic, "everything", change.value),
                ).props('aria-label="Measure all topics"'):
                    ui.tooltip(
                        "Measuring a topic means to receive it. Without this, images, clouds, maps"
                        " and topics of other machines are not measured."
                    )
                ui.label("measure all").classes("rosz-soft text-sm -ml-2")
                search = ui.input(placeholder="Filter").props("clearable").classes("w-40")
            columns = [
                layout.column("name", "Topic"),
                layout.column("type", "Type", "rosz-wide rosz-soft"),
                layout.number_column("rate", "Rate", sort="rate_value"),
                layout.number_column("bandwidth", "Bandwidth", sort="bandwidth_value"),
                layout.number_column("latency", "Latency", "rosz-wide", sort="latency_value"),
                layout.number_column("publishers", "Pub", "rosz-wide"),
                layout.number_column("subscribers", "Sub", "rosz-wide"),
            ]
            self.topics = layout.add_table(columns, most=_ROWS)
            self.topics.add_slot("body-cell-name", _LINK_CELL)
            search.on_value_change(
                lambda change: setattr(self.topics, "filter", change.value or "")
            )

    def _add_nodes(self) -> None:
        with ui.column().classes("rosz-card w-full p-0 gap-0"):
            ui.label("Nodes").classes("text-base font-semibold px-4 pt-3")
            columns = [
                layout.column("name", "Node"),
                layout.column("buttons", ""),
                layout.column("host", "Machine"),
                layout.number_column("pid", "Process"),
                layout.number_column("since", "Running for", "rosz-wide"),
            ]
            self.nodes = layout.add_table(columns, "key", _ROWS)
        self.nodes.add_slot("body-cell-name", _LINK_CELL)
        self.nodes.add_slot("body-cell-buttons", _KILL_CELL)
        self.nodes.on("kill", self._kill)

    def _add_machines(self) -> None:
        with ui.column().classes("rosz-card w-full p-0 gap-0"):
            ui.label("Machines").classes("text-base font-semibold px-4 pt-3")
            columns = [
                layout.column("name", "Machine"),
                layout.number_column("nodes", "Nodes"),
                layout.number_column("processes", "Processes"),
                layout.number_column("topics", "Topics published"),
            ]
            self.machines = layout.add_table(columns, most=_ROWS)

    async def _kill(self, event: GenericEventArguments) -> None:
        name, key = event.args["name"], event.args["key"]
        system = self._frame.system
        session = system.node.context.session

        def act() -> None:
            system.permission.check_control(f"control '{name}'")
            tokens = introspect.find_nodes(self._survey, name)
            running = [token for token in tokens if key.startswith(f"{name} {token.zid} ")]
            if not running:
                raise NotFoundError(f"this process of node '{name}' has ended already")
            for token in running:
                introspect.kill(session, token, "ended from a page")

        with self._box:
            text = "It is asked to shut down, as by rosnode kill. A launch may start it again."
            if await confirm(f"End {name}?", text, "end"):
                await self._frame.attempt(act, f"{name} has ended")

    def update(self, survey: introspect.Survey, own: str) -> int:
        """Show what there is, and return the number of nodes."""
        self._survey = survey
        topics = [
            self._topic_row(topic)
            for topic in introspect.list_topics(t for t in survey.view.tokens if t.node_name != own)
        ]
        entries = [entry for entry in introspect.list_nodes(survey) if entry.name != own]
        now = time.time()
        nodes = [
            {
                "key": f"{entry.name} {entry.session} {entry.pid}",
                "name": entry.name,
                "address": layout.query_of(
                    "/graph", content="all", nodes=entry.name, pick=f"node:{entry.name}"
                ),
                "host": entry.host or "—",
                "pid": entry.pid or "—",
                "since": layout.duration_text(now - entry.started / 1e9) if entry.started else "—",
            }
            for entry in entries
        ]
        layout.show_rows(self.topics, topics)
        layout.show_rows(self.nodes, nodes)
        layout.show_rows(self.machines, _machine_rows(survey, entries))
        self._box.set_visibility(bool(nodes))
        return len(nodes)

    def _topic_row(self, topic: introspect.Topic) -> dict[str, Any]:
        flow = self._traffic.flow(topic.name)
        latency = None if flow is None else flow.latency
        return {
            "name": topic.name,
            "address": layout.query_of("/topics", topic=topic.name),
            "type": topic.type_text,
            "rate": "—" if flow is None else layout.rate_text(flow.rate),
            "rate_value": -1.0 if flow is None else round(flow.rate, 1),
            "bandwidth": "—" if flow is None else layout.bandwidth_text(flow.bandwidth),
            "bandwidth_value": -1.0 if flow is None else round(flow.bandwidth),
            "latency": "—" if latency is None else f"{latency * 1e3:.1f} ms",
            "latency_value": -1.0 if latency is None else round(latency, 4),
            "publishers": len(topic.publishers),
            "subscribers": len(topic.subscribers),
        }


def _machine_rows(
    survey: introspect.Survey, nodes: list[introspect.NodeEntry]
) -> list[dict[str, Any]]:
    published: dict[str, set[str]] = {}
    for token in survey.view.entities(Kind.PUBLISHER):
        published.setdefault(survey.host(token), set()).add(token.name)
    return [
        {
            "name": host,
            "nodes": sum(node.host == host for node in nodes),
            "processes": len({node.pid for node in nodes if node.host == host}),
            "topics": len(published.get(host, ())),
        }
        for host in introspect.machines(nodes)
    ]
