"""Running launches: their nodes with processor time and memory, and the output of a node."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

from nicegui import ui
from nicegui.events import GenericEventArguments

from rosz.launch.run import NodeStatus
from rosz.web.model import Launches, NodeOutput, RunningLaunch, System
from rosz.web.pages import layout

_Action: TypeAlias = Literal["restart", "stop"]

_LINES = 1000
_PERIOD = 0.4
_LONGEST_LINE = 4096
_STATE_CELL = """<q-td :props="props"><span :class="'rosz-state-' + props.row.kind">
{{ props.value }}</span><div v-if="props.row.detail" class="rosz-soft whitespace-normal"
style="font-size: .75rem; max-width: 20rem">{{ props.row.detail }}</div></q-td>"""
_NAME_CELL = """<q-td :props="props"><a :href="props.row.address">{{ props.value }}</a>
<div v-if="props.row.members" class="rosz-soft whitespace-normal" style="font-size: .75rem">
{{ props.row.members }}</div></q-td>"""
_BUTTONS_CELL = """<q-td :props="props" class="whitespace-nowrap">
<q-btn flat dense round size="sm" :icon="props.row.pid === '—' ? 'play_arrow' : 'restart_alt'"
 :aria-label="(props.row.pid === '—' ? 'Start ' : 'Restart ') + props.row.name"
 @click="() => $parent.$emit('restart', props.row.name)"><q-tooltip>
 {{ props.row.pid === '—' ? 'Start' : 'Restart' }}</q-tooltip></q-btn>
<q-btn flat dense round size="sm" icon="stop" :disable="props.row.pid === '—'"
 :aria-label="'Stop ' + props.row.name"
 @click="() => $parent.$emit('stop', props.row.name)"><q-tooltip>Stop</q-tooltip></q-btn>
</q-td>"""
_KINDS = {"running": "good", "failed": "bad", "ended": "soft"}


class LaunchCards:
    """A card for each running launch."""

    def __init__(self, frame: layout.Frame, launches: Launches) -> None:
        self._frame = frame
        self._launches = launches
        self._tables: dict[str, ui.table] = {}
        self._cards: dict[str, ui.column] = {}
        self._box = ui.column().classes("w-full gap-4")
        with self._box:
            self._fault = ui.label("").classes("rosz-card w-full p-3 text-negative")

    def update(self) -> None:
        """Show what runs now."""
        launches = {running.key: running for running in self._launches.found or ()}
        layout.show_text(self._fault, self._launches.fault)
        self._box.set_visibility(bool(launches or self._launches.fault))
        for key in self._cards.keys() - launches:
            self._cards.pop(key).delete()
            del self._tables[key]
        for key, launch in launches.items():
            if key not in self._cards:
                self._add(launch)
            rows = [_row(launch, node) for node in launch.status.nodes]
            layout.show_rows(self._tables[key], rows)

    def _add(self, launch: RunningLaunch) -> None:
        status = launch.status
        files = ", ".join(file.rpartition("/")[2] for file in status.files) or "launch"
        with self._box, ui.column().classes("rosz-card w-full p-0 gap-0") as card:
            with ui.row().classes("w-full items-baseline px-4 pt-3 gap-x-3 gap-y-0"):
                ui.label(files).classes("text-base font-semibold").tooltip(", ".join(status.files))
                ui.label(f"launch {status.pid} on {status.host}").classes("rosz-soft text-sm")
            columns = [
                layout.column("name", "Node"),
                layout.column("state", "State"),
                layout.column("buttons", ""),
                layout.column("type", "Type", "rosz-wide rosz-soft"),
                layout.number_column("pid", "Process", "rosz-wide"),
                layout.number_column("restarts", "Restarts", "rosz-wide"),
                layout.number_column("cpu", "CPU"),
                layout.number_column("memory", "Memory"),
                layout.number_column("uptime", "Running for", "rosz-wide"),
                layout.column("machine", "Machine", "rosz-wide"),
            ]
            table = layout.add_table(columns, most=20)
        table.add_slot("body-cell-name", _NAME_CELL)
        table.add_slot("body-cell-state", _STATE_CELL)
        table.add_slot("body-cell-buttons", _BUTTONS_CELL)
        table.on("restart", lambda event: self._request(launch.key, "restart", event))
        table.on("stop", lambda event: self._request(launch.key, "stop", event))
        self._cards[launch.key], self._tables[launch.key] = card, table

    async def _request(self, key: str, action: _Action, event: GenericEventArguments) -> None:
        name = str(event.args)
        launches = self._launches.found or ()
        launch = next((running for running in launches if running.key == key), None)
        if launch is None:
            ui.notify(f"the launch of '{name}' has ended", type="negative")
            return
        with self._box:
            if await _act(self._frame, self._launches, launch, action, name):
                self.update()


async def _act(
    frame: layout.Frame, launches: Launches, launch: RunningLaunch, action: _Action, name: str
) -> bool:
    """Restart or stop a node, unless the user takes it back; return whether to go on."""
    text = launches.describe(launch, name, action)
    if text and not await confirm(f"{action.capitalize()} {name}?", text, action):
        return False
    done = "runs again" if action == "restart" else "is stopped"
    await frame.attempt(lambda: launches.act(launch.key, action, name), f"{name} {done}")
    return True


async def confirm(title: str, text: str, button: str) -> bool:
    """Ask a question with its meaning, and return whether the button was pressed that does it."""
    with ui.dialog() as dialog, ui.card().classes("rosz-card max-w-lg"):
        ui.label(title).classes("text-base font-semibold")
        ui.label(text)
        with ui.row().classes("w-full justify-end"):
            ui.button("Cancel", on_click=lambda: dialog.submit(False)).props("flat")
            act = ui.button(button.capitalize(), on_click=lambda: dialog.submit(True))
            act.props("autofocus")
    answer = bool(await dialog)
    dialog.delete()
    return answer


def _row(launch: RunningLaunch, node: NodeStatus) -> dict[str, Any]:
    share = launch.shares.get(node.name)
    runs = bool(node.pid)
    return {
        "name": node.name,
        "address": layout.query_of("/output", node=node.name),
        "members": ", ".join(node.members),
        "state": node.state,
        "kind": _KINDS.get(node.state, "busy"),
        "detail": node.detail,
        "type": node.type,
        "pid": node.pid or "—",
        "restarts": node.restarts,
        "cpu": f"{share:.0%}" if runs and share is not None else "—",
        "memory": layout.size_text(node.memory) if runs else "—",
        "uptime": layout.duration_text(node.uptime) if runs else "—",
        "machine": node.machine,
    }


class OutputPage:
    """The newest lines of the output of a node, by its full name, and the buttons."""

    def __init__(self, system: System, node: str = "") -> None:
        self._frame = frame = layout.Frame(system, "Output", "/")
        if not system.permission.sees_launches:
            frame.show_fault("the rules of this machine do not let this page see launches")
            return
        self._name = node
        self._launches = frame.use(system.launches)
        self._output = NodeOutput(system.node, node)
        frame.keep(self._output)
        self._waiting = ""
        with frame.content:
            self._add_output(node)
        frame.every(_PERIOD, self._refresh)

    def _add_output(self, node: str) -> None:
        with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-2"):
            ui.link("Overview", "/")
            ui.label(node).classes("font-semibold")
            self._state = ui.label("").classes("rosz-soft")
            ui.space()
            self._pause = ui.switch("Pause")
            layout.tool_button("Restart", "restart_alt", lambda: self._act("restart"))
            layout.tool_button("Stop", "stop", lambda: self._act("stop"))
        self._empty = ui.label("It has written nothing yet.").classes("rosz-soft")
        self._log = (
            ui.log(max_lines=_LINES)
            .classes("rosz-card rosz-mono w-full")
            .style("height: calc(100vh - 190px)")
        )
        self._log.props('role=log aria-label="Output"')

    def _launch(self) -> RunningLaunch | None:
        launches = self._launches.found or ()
        return next((launch for launch in launches if launch.find(self._name) is not None), None)

    def _refresh(self) -> None:
        launch = self._launch()
        status = None if launch is None else launch.find(self._name)
        parts = [] if status is None else [status.state, status.detail]
        parts.append(self._output.state)
        if self._output.skipped:
            parts.append(f"{layout.size_text(self._output.skipped)} left out")
        self._state.set_text(" · ".join(part for part in parts if part))
        if self._pause.value:
            return
        text = self._output.take()
        *lines, self._waiting = (self._waiting + text).split("\n")
        # A line without an end, such as a question.
        if self._waiting and (not text or len(self._waiting) > _LONGEST_LINE):
            lines, self._waiting = [self._waiting], ""
        if lines:
            self._empty.set_visibility(False)
            self._log.push("\n".join(lines[-_LINES:]))

    async def _act(self, action: _Action) -> None:
        launch = self._launch()
        if launch is None:
            ui.notify(f"no launch runs '{self._name}'", type="negative")
            return
        await _act(self._frame, self._launches, launch, action, self._name)
