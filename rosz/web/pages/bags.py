"""The bags of a folder: recording, playing with a transport bar, contents, downloads."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, cast
from urllib.parse import quote

from nicegui import run, ui

from rosz.bags import Summary
from rosz.errors import RoszError
from rosz.introspect import list_topics
from rosz.web.model import COMPRESSIONS, BagCommand, BagRun, Bags, PlayOrder, RecordOrder, System
from rosz.web.pages import layout
from rosz.web.pages.launches import confirm

_LIST_PERIOD = 2.0
_PERIOD = 0.25
_RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
_FORMATS = {".mcap": "MCAP", ".bag": "ROS 1 (.bag)"}
_LITTLE_DISK = 1 << 30
_CLOCK_RATE = 100.0
_MINUTE, _HOUR = 60, 3600


class BagsPage:
    """The recorder, the player, and the list of bags; the address may name one to show."""

    def __init__(self, system: System, bag: str = "") -> None:
        self._bags: Bags = system.bags
        self._frame = frame = layout.Frame(system, "Bags", "/bags")
        self._wanted = bag
        with (
            frame.content,
            ui.element("div").classes("w-full grid gap-4 grid-cols-1 lg:grid-cols-2"),
        ):
            with ui.column().classes("gap-4 min-w-0"):
                self._recorder = _Recorder(system, frame)
                self._transport = _Transport(self._bags, frame)
                self._add_list()
            with ui.column().classes("gap-4 min-w-0"):
                self._contents = _Contents(self._bags, frame, self._list)
        layout.offer_choice(self._table, self._contents.show)
        ui.timer(_LIST_PERIOD, self._list)
        frame.every(_PERIOD, self._refresh)

    def _add_list(self) -> None:
        columns = [
            layout.column("name", "Bag", "break-all whitespace-normal"),
            layout.number_column("size", "Size", sort="bytes"),
            layout.number_column("changed", "Changed", sort="stamp"),
        ]
        with layout.card("Bags"):
            ui.label(str(self._bags.folder.path)).classes("rosz-mono rosz-soft break-all")
            self._fault = ui.label("").classes("text-negative")
            self._empty = ui.label(
                "No bag is in this folder yet: record one, or start 'rosz web --bags FOLDER'."
            )
            self._empty.classes("rosz-soft").set_visibility(False)
            self._table = layout.add_table(columns, most=10)
            self._table.set_visibility(False)

    async def _list(self) -> None:
        try:
            listing = await run.io_bound(self._bags.folder.rows)
        except RoszError as error:
            self._fault.set_text(str(error))
            return
        self._fault.set_text("")
        rows = [
            {
                "name": row.name,
                "address": layout.query_of("/bags", bag=row.name),
                "size": layout.size_text(row.size),
                "bytes": row.size,
                "changed": time.strftime("%m-%d %H:%M", time.localtime(row.changed)),
                "stamp": row.changed,
            }
            for row in listing or ()
        ]
        layout.show_rows(self._table, rows)
        self._table.set_visibility(bool(rows))
        self._empty.set_visibility(not rows)
        if self._wanted:
            wanted, self._wanted = self._wanted, ""
            await self._contents.show(wanted)

    def _refresh(self) -> None:
        self._recorder.refresh()
        self._transport.refresh()


class _Recorder:
    """The card that starts a recording, shows its progress, and stops it."""

    def __init__(self, system: System, frame: layout.Frame) -> None:
        self._bags: Bags = system.bags
        self._own = system.node.name
        self._frame = frame
        self._graph = frame.use(system.graph)
        with layout.card("Record", "p-4 gap-3"):
            with ui.column().classes("w-full gap-2") as self._form:
                self._add_form()
            with ui.column().classes("w-full gap-2") as self._going:
                self._add_going()
            self._said = ui.label("").classes("rosz-soft text-sm break-words w-full")
            self._fault = ui.label("").classes("text-negative break-words w-full")
            self._fault.props("role=alert")

    def _add_form(self) -> None:
        self._topics = (
            ui.select([], multiple=True, value=[], label="Topics; none for all", with_input=True)
            .props("use-chips clearable")
            .classes("w-full")
        )
        self._topics.on("popup-show", self._offer_topics)
        with ui.row().classes("w-full gap-3 items-end"):
            self._name = ui.input("Name", placeholder="the time").props("aria-label=Name")
            self._name.classes("grow min-w-24")
            self._format = ui.select(
                _FORMATS, value=".mcap", label="Format", on_change=self._offer_compressions
            )
            self._compression = ui.select(
                list(COMPRESSIONS[".mcap"]), value="none", label="Compression"
            ).classes("w-28")
        with (
            ui.expansion("More").props("dense header-class=rosz-group").classes("w-full"),
            ui.row().classes("w-full gap-3"),
        ):
            self._exclude = ui.input("Leave out, as a regular expression").classes("w-full")
            self._split_size = _number("Split after MB")
            self._split_seconds = _number("Split after seconds")
            self._most = _number("Keep the newest")
        ui.button("Record", icon="fiber_manual_record", on_click=self._record, color="negative")

    def _add_going(self) -> None:
        with ui.row().classes("w-full items-center gap-3"):
            ui.icon("fiber_manual_record", color="negative", size="20px")
            self._path = ui.label("").classes("font-medium break-all")
            ui.space()
            stop = self._bags.stop_recording
            ui.button("Stop", icon="stop", on_click=lambda: self._frame.attempt(stop))
        with ui.row().classes("w-full gap-x-6 gap-y-1 rosz-number"):
            self._facts = {
                name: _fact(name)
                for name in ("Time", "Messages", "Size", "Lost", "Topics", "Disk left")
            }

    def _offer_topics(self) -> None:
        tokens = (
            entry for entry in self._graph.survey().view.tokens if entry.node_name != self._own
        )
        names = {entry.name for entry in list_topics(tokens)}
        chosen = self._topics.value or []
        self._topics.set_options(sorted({*names, *chosen}), value=chosen)

    def _offer_compressions(self) -> None:
        compressions = list(COMPRESSIONS[self._format.value])
        self._compression.set_options(compressions, value="none")

    async def _record(self) -> None:
        suffix = self._format.value
        name = (self._name.value or "").strip() or time.strftime("%Y-%m-%d-%H-%M-%S")
        size = int((self._split_size.value or 0) * 1e6)
        duration = round(float(self._split_seconds.value or 0) * 1e9)
        order = RecordOrder(
            name=name if name.endswith(suffix) else name + suffix,
            topics=tuple(self._topics.value or ()),
            exclude=self._exclude.value or "",
            compression=cast("Any", self._compression.value),
            split=bool(size or duration),
            size=size,
            duration=duration,
            max_splits=int(self._most.value or 0),
        )
        await self._frame.attempt(lambda: self._bags.record(order))
        self.refresh()

    def refresh(self) -> None:
        """Show how it goes."""
        recording = self._bags.recording
        going = recording is not None and not recording.ended
        self._form.set_visibility(not going)
        self._going.set_visibility(going)
        layout.show_text(self._said, _said(recording))
        layout.show_text(self._fault, fault_of(recording))
        if recording is None:
            return
        last = recording.last
        self._path.set_text(last.path or "It starts …")
        texts = {
            "Time": _clock(last.seconds),
            "Messages": f"{last.messages} ({recording.messages_per_second:.0f}/s)",
            "Size": layout.size_text(last.size)
            + f" ({layout.bandwidth_text(recording.bytes_per_second)})",
            "Lost": str(last.lost),
            "Topics": str(last.topics),
            "Disk left": layout.size_text(last.left),
        }
        for name, text in texts.items():
            self._facts[name].set_text(text)
        little = 0 < last.left < _LITTLE_DISK
        for name, is_bad in (("Lost", last.lost), ("Disk left", little)):
            change = "add" if is_bad else "remove"
            self._facts[name].classes(**{change: "text-negative"})


class _Transport:
    """The bar that controls the bag that plays."""

    def __init__(self, bags: Bags, frame: layout.Frame) -> None:
        self._bags = bags
        self._frame = frame
        self._dragged = False
        self._own = False
        with ui.column().classes("rosz-card p-4 gap-2 min-w-0 w-full") as self._card:
            with ui.row().classes("w-full items-center gap-2"):
                ui.label("Playing").classes("text-base font-semibold")
                self._path = ui.label("").classes("rosz-mono break-all")
            with ui.row().classes("w-full items-center gap-2 no-wrap"):
                self._slider = (
                    ui.slider(min=0, max=1, step=0.01, value=0)
                    .props('aria-label="Time of the bag"')
                    .classes("grow")
                )
                self._time = ui.label("").classes("rosz-number text-sm whitespace-nowrap")
            with ui.row().classes("w-full items-center gap-2"):
                self._pause = self._button("pause", "Pause or go on", "pause")
                self._step = self._button("skip_next", "One message", "step")
                self._button("stop", "Stop", "stop")
                self._rate = (
                    ui.select(
                        {rate: f"{rate:g} x" for rate in _RATES},
                        value=1.0,
                        on_change=lambda event: self._change("rate", event.value),
                    )
                    .props('aria-label="Rate"')
                    .classes("w-20")
                )
                self._loop = ui.switch(
                    "Loop", on_change=lambda event: self._change("loop", float(event.value))
                )
            self._said = ui.label("").classes("rosz-soft text-sm break-words w-full")
        self._fault = ui.label("").classes("rosz-card text-negative p-3 w-full break-words")
        self._fault.props("role=alert")
        self._slider.on("pan", self._drag)
        self._slider.on("change", lambda event: self._do("jump", event.args))

    def _button(self, icon: str, label: str, command: Any) -> ui.button:
        button = ui.button(icon=icon, on_click=lambda: self._do(command))
        with button.props(f'flat round dense aria-label="{label}"'):
            ui.tooltip(label)
        return button

    def _drag(self, event: Any) -> None:
        self._dragged = event.args == "start"

    def _change(self, command: Any, value: float) -> Any:
        return None if self._own else self._do(command, value)

    async def _do(self, command: Any, value: float = 0.0) -> None:
        await self._frame.attempt(lambda: self._bags.control(BagCommand(command, float(value))))

    def refresh(self) -> None:
        """Show how far it is."""
        playing: BagRun | None = self._bags.playing
        going = playing is not None and not playing.ended
        self._card.set_visibility(going)
        layout.show_text(self._fault, fault_of(playing))
        if playing is None or not going:
            return
        last, order = playing.last, playing.order.play
        self._path.set_text(last.path or (order.name if order is not None else ""))
        self._own = True
        if last.duration and self._slider.props.get("max") != last.duration:
            self._slider.props(f"max={last.duration}")
        if not self._dragged:
            self._slider.set_value(last.seconds)
        if last.path and self._rate.value != last.rate:
            options = {rate: f"{rate:g} x" for rate in sorted({*_RATES, last.rate})}
            self._rate.set_options(options, value=last.rate)
        self._loop.set_value(last.loop)
        self._own = False
        self._time.set_text(f"{_clock(last.seconds)} / {_clock(last.duration)}")
        self._pause.props(f"icon={'play_arrow' if last.paused else 'pause'}")
        self._step.set_enabled(last.paused)
        layout.show_text(self._said, playing.lines[-1] if playing.lines else "")


class _Contents:
    """One bag: its contents, and the buttons for it."""

    def __init__(self, bags: Bags, frame: layout.Frame, changed: Callable[[], Any]) -> None:
        self._bags = bags
        self._frame = frame
        self._changed = changed
        self._name = ""
        with ui.column().classes("rosz-card p-4 gap-3 min-w-0 w-full") as self._card:
            ui.label("Choose a bag to see what is in it, and to play it.").classes("rosz-soft")

    async def show(self, name: str) -> None:
        """Show a bag."""
        self._name = name
        layout.address_of(layout.query_of("/bags", bag=name))
        self._card.clear()
        with self._card:
            ui.label(name).classes("text-base font-semibold break-all")
            ui.spinner()
        try:
            summary = await run.io_bound(lambda: self._bags.folder.summary(name))
            fault = ""
        except RoszError as error:
            summary, fault = None, str(error)
        if self._name != name:
            return
        self._card.clear()
        with self._card:
            ui.label(name).classes("text-base font-semibold break-all")
            if fault:
                ui.label(fault).classes("text-negative break-words").props("role=alert")
            if summary is not None:
                for problem in summary[1]:
                    ui.label(problem).classes("text-negative break-words text-sm")
                self._add_facts(summary[0])
                self._add_play(summary[0])
            self._add_buttons(name)

    def _add_facts(self, summary: Summary) -> None:
        compression = ", ".join(dict.fromkeys(kind.name for kind in summary.compressions)) or "none"
        facts = {
            "Begin": time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(summary.start)),
            "Duration": _clock(summary.duration),
            "Messages": str(summary.messages),
            "Size": layout.size_text(summary.size),
            "Format": f"{summary.format} {summary.version}".strip(),
            "Compression": compression,
        }
        with ui.row().classes("w-full gap-x-6 gap-y-1 rosz-number"):
            for name, text in facts.items():
                _fact(name).set_text(text)

    def _add_play(self, summary: Summary) -> None:
        columns: list[dict[str, Any]] = [
            {"name": "topic", "label": "Topic", "field": "topic", "align": "left",
             "classes": "break-all"},
            {"name": "type", "label": "Type", "field": "type", "align": "left",
             "classes": "rosz-soft rosz-wide break-all", "headerClasses": "rosz-wide"},
            {"name": "messages", "label": "Messages", "field": "messages", "align": "right",
             "classes": "rosz-number"},
        ]  # fmt: skip
        rows = [
            {"topic": entry.topic, "type": entry.type, "messages": entry.messages}
            for entry in summary.topics
        ]
        self._table = (
            ui.table(
                rows=rows, columns=columns, row_key="topic", selection="multiple", pagination=15
            )
            .classes("w-full")
            .props("flat dense wrap-cells")
        )
        self._table.selected = list(rows)
        with ui.row().classes("w-full items-center gap-3"):
            self._prefix = ui.input("Prefix", placeholder="/old")
            self._prefix.props("aria-label=Prefix").classes("w-28")
            self._paused, self._loop, self._clock = map(ui.switch, ("Paused", "Loop", "/clock"))

    def _add_buttons(self, name: str) -> None:
        with ui.row().classes("w-full items-center gap-3"):
            if not name.endswith(".active"):
                ui.button("Play", icon="play_arrow", on_click=self._play)
                ui.button("Download", icon="download").props(
                    f'outline download href="/bag/{quote(name)}"'
                )
            ui.space()
            delete = ui.button("Delete", icon="delete", on_click=self._question, color="negative")
            delete.props("flat")

    async def _play(self) -> None:
        chosen = [row["topic"] for row in self._table.selected]
        order = PlayOrder(
            name=self._name,
            topics=() if len(chosen) == len(self._table.rows) else tuple(chosen),
            prefix=(self._prefix.value or "").strip(),
            paused=self._paused.value,
            loop=self._loop.value,
            clock=_CLOCK_RATE if self._clock.value else 0.0,
        )
        if not chosen:
            ui.notify("choose a topic to play", type="warning")
            return
        await self._frame.attempt(lambda: self._bags.play(order))

    async def _question(self) -> None:
        name = self._name
        if not await confirm(f"Delete '{name}'?", "It cannot be brought back.", "delete it"):
            return
        if await self._frame.attempt(lambda: self._bags.delete(name)):
            self._card.clear()
            with self._card:
                ui.label(f"'{name}' is deleted.").classes("rosz-soft")
            layout.address_of("/bags")
            await self._changed()


def _said(recording: BagRun | None) -> str:
    """Return the last line of a recording, or how it ended."""
    if recording is None or recording.fault:
        return ""
    if recording.ended:
        last = recording.last
        return f"'{last.path}' has {last.messages} messages, {last.lost} lost."
    return recording.lines[-1] if recording.lines else ""


def fault_of(run: BagRun | None) -> str:
    """Return the error of a recorder or player; empty without one."""
    if run is None:
        return ""
    if run.silent:
        return "Its process does not respond; 'Stop' kills it."
    return run.fault


def _number(label: str) -> ui.number:
    return ui.number(label, min=0).classes("w-36")


def _fact(name: str) -> ui.label:
    with ui.column().classes("gap-0"):
        ui.label(name).classes("rosz-soft text-xs")
        return ui.label("")


def _clock(seconds: float) -> str:
    """Return a duration as text."""
    whole, rest = divmod(seconds, _MINUTE)
    minutes, hours = int(whole) % _MINUTE, int(seconds // _HOUR)
    return f"{minutes}:{rest:04.1f}" if not hours else f"{hours}:{minutes:02d}:{rest:04.1f}"
