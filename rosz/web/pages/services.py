"""All services, and a form that calls one."""

from __future__ import annotations

from nicegui import ui

from rosz.introspect.services import list_services
from rosz.web.model import System, call_service, service_type
from rosz.web.pages.form import MessageForm
from rosz.web.pages.layout import (
    Frame,
    address_of,
    column,
    empty_state,
    offer_choice,
    query_of,
)

__all__ = ("show_services",)

_PERIOD = 1.0
_HIDDEN = ("/get_loggers", "/set_logger_level")


def show_services(system: System, service: str) -> None:
    """Build the page.

    Args:
        system: The system.
        service: Service to call; empty for none.
    """
    _Services(system, service)


class _Services:
    """The list of services, and the form."""

    def __init__(self, system: System, service: str) -> None:
        self._system = system
        self._frame = frame = Frame(system, "Services", "/services")
        self._graph = frame.use(system.graph)
        self._types: dict[str, str] = {}
        self._wanted = service
        with frame.content:
            self._empty = empty_state(
                "build",
                "No service",
                "Nodes that offer services appear here, such as:",
                "rosz run rosz_tutorials add_two_ints_server.py",
            )
            with ui.element("div").classes("w-full grid gap-4 grid-cols-1 lg:grid-cols-2"):
                with ui.column().classes("rosz-card p-4 gap-2 min-w-0") as self._card:
                    with ui.row().classes("w-full items-center"):
                        ui.label("Services").classes("text-base font-semibold")
                        ui.space()
                        search = (
                            ui.input(placeholder="Filter").props("dense clearable").classes("w-40")
                        )
                    self._table = self._add_table(search)
                    self._all = ui.switch("Services of loggers too", on_change=self._refresh).props(
                        "dense"
                    )
                self._add_form()
        frame.every(_PERIOD, self._refresh)

    def _add_table(self, search: ui.input) -> ui.table:
        table = (
            ui.table(
                rows=[],
                columns=[
                    column("name", "Service"),
                    column("type", "Type", "rosz-soft rosz-wide"),
                    column("nodes", "Node", "rosz-wide"),
                ],
                row_key="name",
                pagination=12,
            )
            .classes("w-full")
            .props("flat dense wrap-cells")
        )
        offer_choice(table, self._choose)
        search.on_value_change(lambda change: setattr(table, "filter", change.value or ""))
        return table

    def _add_form(self) -> None:
        with ui.column().classes("rosz-card p-4 gap-2 min-w-0"):
            self._name = ui.label("Choose a service.").classes("text-base font-semibold break-all")
            self._type = ui.label("").classes("rosz-soft")
            self._form = MessageForm(
                self._system.node, "Request in YAML; fields left out have their default value"
            )
            self._button = ui.button("Call", icon="send", on_click=self._call).props("no-caps")
            self._button.disable()
            self._answer = ui.label("").classes("rosz-mono whitespace-pre-wrap break-all w-full")

    def _refresh(self) -> None:
        own = self._system.node.name
        entries = [
            one
            for one in list_services(self._graph.survey().view)
            if one.nodes != (own,) and (self._all.value or not one.name.endswith(_HIDDEN))
        ]
        self._types = {one.name: one.types[0] for one in entries}
        rows = [
            {
                "name": one.name,
                "address": query_of("/services", service=one.name),
                "type": ", ".join(one.types),
                "nodes": ", ".join(one.nodes),
            }
            for one in entries
        ]
        if self._table.rows != rows:
            self._table.rows = rows
        if self._wanted in self._types:
            wanted, self._wanted = self._wanted, ""
            ui.timer(0, lambda: self._choose(wanted), once=True)
        self._empty.set_visibility(not rows and self._graph.complete and not self._all.value)

    async def _choose(self, name: str) -> None:
        self._name.set_text(name)
        self._type.set_text(self._types.get(name, ""))
        self._answer.set_text("")
        self._button.disable()
        address_of(query_of("/services", service=name))
        self._form.clear()
        view = self._graph.survey().view
        cls = await self._frame.attempt(lambda: service_type(self._system.node, view, name))
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
