"""All parameters as a tree that is edited in place, and who changed what."""

from __future__ import annotations

import time
from typing import Any

from nicegui import ui
from nicegui.events import UploadEventArguments

from rosz.errors import YamlError
from rosz.params import Value, type_name
from rosz.params.yaml import inline
from rosz.web.model import System
from rosz.web.pages import layout

_PERIOD = 0.5
_LONGEST = 120
_HEADER = """<div class="row items-center no-wrap full-width" style="gap: .5rem">
<span>{{ props.node.label }}</span>
<span v-if="props.node.type" class="rosz-value ellipsis">{{ props.node.value }}</span>
<q-badge v-if="props.node.type" outline color="secondary" :label="props.node.type" />
</div>"""


class ParametersPage:
    """The tree, its filter, and the changes.

    Args:
        system: The system.
        prefix: Text that the shown names contain.
        name: Parameter to edit; empty for none.
    """

    def __init__(self, system: System, prefix: str = "", name: str = "") -> None:
        self._frame = frame = layout.Frame(system, "Parameters", "/parameters")
        self._parameters = frame.use(system.parameters)
        self._values: dict[str, Value] = {}
        self._seen: object = None
        self._opened: set[str] = set()
        self._chosen = name
        self._wanted = name
        with frame.content:
            self._add_tools(prefix)
            self._empty = layout.empty_state(
                "tune",
                "No parameter is set",
                "Nodes and launch files set them, and so does:",
                "rosz param set /speed 1.5",
            )
            with ui.element("div").classes("w-full grid gap-4 grid-cols-1 lg:grid-cols-3"):
                with ui.column().classes("rosz-card p-4 lg:col-span-2 min-w-0") as self._card:
                    self._tree = (
                        ui.tree(
                            [],
                            node_key="id",
                            label_key="label",
                            on_select=lambda event: self._pick(event.value),
                        )
                        .props("dense no-transition no-selection-unset")
                        .classes("w-full")
                    )
                    self._tree.add_slot("default-header", _HEADER)
                with layout.card("Changes since this page looked"):
                    self._changes = ui.column().classes("w-full gap-2")
        frame.every(_PERIOD, self._refresh)

    def _add_tools(self, prefix: str) -> None:
        with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-2"):
            self._search = (
                ui.input("Filter", value=prefix, on_change=self._filter)
                .props("clearable debounce=300")
                .classes("grow min-w-40")
            )
            layout.tool_button("New", "add", lambda: self._edit(""))
            layout.tool_button("Save", "download", self._save)
            upload = ui.upload(on_upload=self._load, auto_upload=True).classes("hidden")
            upload.props('accept=".yaml,.yml"')
            layout.tool_button("Load", "upload", lambda: upload.run_method("pickFiles"))

    def _filter(self) -> None:
        self._show_address()
        self._refresh()

    def _show_address(self) -> None:
        prefix = str(self._search.value or "")
        layout.address_of(layout.query_of("/parameters", prefix=prefix, name=self._chosen))

    def _refresh(self) -> None:
        wanted = self._search.value or ""
        state = (self._parameters.version, wanted)
        if state == self._seen:
            return
        self._seen = state
        self._values = {
            name: value for name, value in self._parameters.values().items() if wanted in name
        }
        nodes, namespaces = _nodes(self._values)
        self._tree.props["nodes"] = nodes
        self._tree.update()
        if new := namespaces - self._opened:
            self._opened |= new
            self._tree.expand(list(new))
        self._card.set_visibility(bool(nodes))
        self._empty.set_visibility(not nodes and not wanted)
        self._show_changes()
        self._open_wanted()

    def _open_wanted(self) -> None:
        """Edit the parameter that the address names, as soon as there is one."""
        name = self._wanted
        if name and name in self._values:
            self._wanted = ""
            self._frame.show_fault("")
            self._edit(name)
        elif name:
            self._frame.show_fault(f"no parameter '{name}' is set")

    def _show_changes(self) -> None:
        self._changes.clear()
        with self._changes:
            changes = self._parameters.changes()
            if not changes:
                ui.label("None.").classes("rosz-soft")
            for change in changes[:50]:
                with ui.column().classes("gap-0 w-full"):
                    ui.label(change.name).classes("rosz-mono break-all")
                    text = "deleted" if change.new is None else _short(change.new)
                    before = "" if change.old is None else f"{_short(change.old)} → "
                    ui.label(before + text).classes("rosz-mono rosz-value break-all")
                    when = time.strftime("%H:%M:%S", time.localtime(change.time / 1e9))
                    ui.label(f"{when}, {change.origin}").classes("rosz-soft text-xs")

    def _pick(self, name: Any) -> None:
        if isinstance(name, str) and name in self._values:
            self._edit(name)
        self._tree.deselect()

    def _edit(self, name: str) -> None:
        value = self._values.get(name)
        self._chosen = name
        self._show_address()

        def leave() -> None:
            self._chosen = ""
            self._show_address()
            dialog.delete()

        with ui.dialog(value=True).on("hide", leave) as dialog, ui.card().classes("rosz-card w-96"):
            ui.label(name or "New parameter").classes("text-base font-semibold break-all")
            field = ui.input("Name", value="/").props(remove="dense") if not name else None
            if isinstance(value, bool):
                switch = ui.switch("Value", value=value).props(remove="dense")
                text = ui.input(value=inline(value)).classes("hidden")
                switch.on_value_change(
                    lambda change: text.set_value("true" if change.value else "false")
                )
            else:
                start = "" if value is None else value if isinstance(value, str) else inline(value)
                kind = f" ({type_name(value)})" if value is not None else " in YAML"
                text = (
                    ui.textarea(f"Value{kind}", value=start)
                    .props("autogrow outlined input-class=rosz-mono")
                    .classes("w-full")
                )
            other = ui.switch("Allow another type")
            other.set_visibility(value is not None)

            async def store() -> None:
                target = name or str(field.value if field else "").strip()
                done = await self._frame.attempt(
                    lambda: self._store(target, str(text.value), other_type=bool(other.value)),
                    f"{target} is set",
                )
                if done:
                    dialog.close()

            async def delete() -> None:
                await self._frame.attempt(
                    lambda: self._parameters.delete(name), f"{name} is deleted"
                )
                dialog.close()

            with ui.row().classes("w-full justify-end"):
                if name:
                    ui.button("Delete", color="negative", on_click=delete).props("flat")
                    ui.space()
                ui.button("Cancel", on_click=dialog.close).props("flat")
                ui.button("Set", on_click=store)

    def _store(self, name: str, text: str, *, other_type: bool) -> bool:
        self._parameters.set_text(name, text, other_type=other_type)
        return True

    def _save(self) -> None:
        ui.download.content(self._parameters.save("/"), "parameters.yaml")

    async def _load(self, event: UploadEventArguments) -> None:
        content = await event.file.read()

        def act() -> int:
            try:
                text = content.decode()
            except UnicodeDecodeError as error:
                raise YamlError("it is not UTF-8", event.file.name) from error
            return self._parameters.load("/", text, event.file.name)

        count = await self._frame.attempt(act)
        if count is not None:
            ui.notify(f"{count} parameters of {event.file.name} are set", type="positive")


def _nodes(values: dict[str, Value]) -> tuple[list[dict[str, Any]], set[str]]:
    """Return parameters as a tree of namespaces, and the namespaces."""
    children: dict[str, list[dict[str, Any]]] = {"/": []}
    for name, value in sorted(values.items()):
        path = "/"
        *spaces, leaf = name.strip("/").split("/")
        for space in spaces:
            above, path = path, f"{path}{space}/"
            if path not in children:
                children[path] = []
                node = {"id": path, "label": space, "selectable": False}
                children[above].append({**node, "children": children[path]})
        children[path].append(
            {"id": name, "label": leaf, "value": _short(value), "type": type_name(value)}
        )
    return children["/"], children.keys() - {"/"}


def _short(value: Value) -> str:
    text = inline(value)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "…"
