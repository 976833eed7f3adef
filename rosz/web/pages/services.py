"""All services, and a form that calls one."""

from __future__ import annotations

from nicegui import ui

from rosz.introspect import find_server, list_services
from rosz.node.ros2 import request_type
from rosz.web.model import System, call_service
from rosz.web.pages import layout
from rosz.web.pages.form import MessageForm

_PERIOD = 1.0
_HIDDEN = ("/get_loggers", "/set_logger_level")


class ServicesPage:
    """The list of services, and the form for one that the address may name."""

    def __init__(self, system: System, service: str = "") -> None:
        self._system = system
        self._frame = frame = layout.Frame(system, "Services", "/services")
        self._graph = frame.use(system.graph)
        self._types: dict[str, str] = {}
        self._wanted = service
        with frame.content:
            self._empty = layout.empty_state(
                "build",
                "No service",
                "Nodes that offer services appear here, such as:",
                "rosz run rosz_tutorials add_two_ints_server.py",
            )
            with ui.element("div").classes("w-full grid gap-4 grid-cols-1 lg:grid-cols-2"):
                with ui.column().classes("rosz-card p-4 gap-2 min-w-0"):
                    with ui.row().classes("w-full items-center"):
                        ui.label("Services").classes("text-base font-semibold")
                        ui.space()
                        search = ui.input(placeholder="Filter").props("clearable").classes("w-40")
                    self._table = self._add_table(search)
                    self._all = ui.switch("Services of loggers too", on_change=self._refresh)
                self._add_form()
        frame.every(_PERIOD, self._refresh)

    def _add_table(self, search: ui.input) -> ui.table:
        columns = [
            layout.column("name", "Service"),
            layout.column("type", "Type", "rosz-soft rosz-wide"),
            layout.column("nodes", "Node", "rosz-wide"),
        ]
        table = layout.add_table(columns).props("wrap-cells")
        layout.offer_choice(table, self._choose)
        search.on_value_change(lambda change: setattr(table, "filter", change.value or ""))
        return table

    def _add_form(self) -> None:
        with ui.column().classes("rosz-card p-4 gap-2 min-w-0"):
            self._name = ui.label("Choose a service.").classes("text-base font-semibold break-all")
            self._type = ui.label("").classes("rosz-soft")
            self._form = MessageForm(
                self._system.node, "Request in YAML; fields left out have their default value"
            )
            self._button = ui.button("Call", icon="send", on_click=self._call)
            self._button.disable()
            self._answer = ui.label("").classes("rosz-mono whitespace-pre-wrap break-all w-full")

    def _refresh(self) -> None:
        own = self._system.node.name
        entries = [
            entry
            for entry in list_services(self._graph.survey().view)
            if entry.nodes != (own,) and (self._all.value or not entry.name.endswith(_HIDDEN))
        ]
        self._types = {entry.name: entry.types[0] for entry in entries}
        rows = [
            {
                "name": entry.name,
                "address": layout.query_of("/services", service=entry.name),
                "type": ", ".join(entry.types),
                "nodes": ", ".join(entry.nodes),
            }
            for entry in entries
        ]
        layout.show_rows(self._table, rows)
        if self._wanted in self._types:
            wanted, self._wanted = self._wanted, ""
            ui.timer(0, lambda: self._choose(wanted), once=True)
        self._empty.set_visibility(not rows and self._graph.complete and not self._all.value)

    async def _choose(self, name: str) -> None:
        self._name.set_text(name)
        self._type.set_text(self._types.get(name, ""))
        self._answer.set_text("")
        self._button.disable()
        layout.address_of(layout.query_of("/services", service=name))
        self._form.clear()
        view = self._graph.survey().view
        node = self._system.node
        cls = await self._frame.attempt(lambda: request_type(node, find_server(view, name)))
        if cls is not None and self._name.text == name:
            self._form.show(cls.Request)
            self._button.enable()

    async def _call(self) -> None:
        name, text = self._name.text, self._form.text
        self._button.disable()
        self._answer.set_text("waiting for the answer …")
        answer = await self._frame.attempt(
            lambda: call_service(
                self._system.node, self._system.permission, self._graph.survey().view, name, text
            )
        )
        self._answer.set_text("the call failed" if answer is None else answer or "(empty response)")
        self._button.enable()
