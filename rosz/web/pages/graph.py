"""The picture of nodes and topics, as rqt_graph shows it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import NamedTuple

import msgspec
from nicegui import background_tasks, run, ui
from nicegui.events import GenericEventArguments

from rosz import diagram
from rosz.errors import RoszError
from rosz.introspect import Survey, find_nodes, format_node, format_topic
from rosz.names import short_type
from rosz.web.model import System, Traffic
from rosz.web.pages import layout

_PERIOD = 0.05
"""Seconds between two updates; one without a change costs nearly nothing."""
_RATES_PERIOD = 1.0
_CONTENTS = {"nodes": "Nodes only", "active": "Nodes and topics", "all": "All topics"}
_SWITCHES = {
    "hide_debug": "Hide /rosout, /clock and tools",
    "hide_tf": "Hide /tf",
    "hide_parameters": "Hide topics of parameters",
    "hide_dead_sinks": "Hide topics without publishers",
    "hide_leaves": "Hide topics without subscribers",
    "hide_unconnected": "Hide nodes without topics",
}
_USUAL = "usual"
_LABELS = {"rates": "Rates on the arrows", "types": "Types on the arrows"}
_PICK = """(event) => {
  const box = event.target.closest('[data-key]');
  if (box && (event.type === 'click' || event.key === 'Enter')) emit(box.dataset.key);
}"""

_RELABEL = """(labels) => {
  const drawn = document.querySelector('.rosz-graph');
  for (const [number, text] of Object.entries(labels)) {
    const label = drawn?.querySelector(`[data-arrow="${number}"]`);
    if (label) label.textContent = text;
  }
}"""


class _DrawnGraph(NamedTuple):
    """The state of the drawing; the chosen box is emphasised."""

    picture: diagram.Picture
    written: tuple[str, ...]
    chosen: str


class GraphPage:
    """The picture with its choices.

    Args:
        system: The system.
        content: ``nodes``, ``active`` or ``all``.
        nodes: Patterns of nodes.
        topics: Patterns of topics.
        group: Depth of the namespaces that get a frame.
        hide: Kinds that are left out, such as ``tf,leaves``; rqt_graph's choice if it is ``usual``.
        labels: The labels of arrows, of ``rates`` and ``types``.
        pick: What to tell of, such as ``node:/talker``; empty for nothing.
    """

    def __init__(
        self,
        system: System,
        content: str = "nodes",
        nodes: str = "",
        topics: str = "",
        *,
        group: int = 0,
        hide: str = _USUAL,
        labels: str = "rates",
        pick: str = "",
    ) -> None:
        shown: diagram.Content = next(
            (kind for kind in diagram.CONTENTS if kind == content), "nodes"
        )
        options = diagram.PictureOptions(
            content=shown, nodes=nodes, topics=topics, group=max(0, group)
        )
        if hide != _USUAL:
            hidden = set(hide.split(","))
            switches = {name: name.removeprefix("hide_") in hidden for name in _SWITCHES}
            options = msgspec.structs.replace(options, **switches)
        self._options = options
        self._written = tuple(choice for choice in _LABELS if choice in labels.split(","))
        self._frame = frame = layout.Frame(system, "Graph", "/graph")
        self._system = system
        self._watch = frame.use(system.graph)
        self._traffic: Traffic = frame.use(system.traffic)
        self._wanted: object = None
        self._due = 0.0
        self._shown: _DrawnGraph | None = None
        self._drawn: _DrawnGraph | None = None
        self._draws = False
        self._labels: dict[int, str] = {}
        self._picture = diagram.Picture()
        self._chosen = pick
        self._described = not pick
        self._zoom = 100
        with frame.content:
            self._add_choices()
            self._empty = layout.empty_state(
                "hub",
                "Nothing to draw",
                "No node matches, or none runs. Start a node:",
                "rosz run turtlesim turtlesim_node",
            )
            with (
                ui.element("div")
                .classes("rosz-card w-full overflow-auto p-2")
                .style("max-height: calc(100vh - 170px); min-height: 200px") as self._card
            ):
                self._drawing = ui.html("", sanitize=False).classes("rosz-graph")
                for kind in ("click", "keydown"):
                    self._drawing.on(kind, self._pick, js_handler=_PICK)
        frame.every(_PERIOD, self._refresh)

    def _add_choices(self) -> None:
        options = self._options
        with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-2"):
            ui.select(
                _CONTENTS,
                value=options.content,
                label="Show",
                on_change=lambda change: self._choose(content=change.value),
            ).classes("w-40")
            for field, label in (("nodes", "Nodes"), ("topics", "Topics")):
                ui.input(
                    label,
                    value=getattr(options, field),
                    placeholder="/arm/*, -/arm/camera",
                    on_change=lambda change, field=field: self._choose(
                        **{field: change.value or ""}
                    ),
                ).props("clearable debounce=400").classes("w-44")
            self._add_options()
            ui.space()
            with ui.row().classes("items-center gap-1 flex-nowrap"):
                for icon, step, label in (("remove", -20, "Smaller"), ("add", 20, "Larger")):
                    ui.button(icon=icon, on_click=lambda step=step: self._scale(step)).props(
                        f'flat dense round aria-label="{label}"'
                    )
            layout.tool_button(
                "SVG", "download", lambda: self._save(diagram.write_svg, "graph.svg")
            )
            layout.tool_button(
                "DOT", "download", lambda: self._save(diagram.write_dot, "graph.dot")
            )

    def _save(self, write: Callable[[diagram.Picture], str], name: str) -> None:
        ui.download.content(write(self._picture), name)

    def _add_options(self) -> None:
        options = self._options
        with (
            ui.button("Options", icon="tune").props("flat dense"),
            ui.menu(),
            ui.column().classes("p-3 gap-1"),
        ):
            for field, label in _SWITCHES.items():
                ui.switch(
                    label,
                    value=getattr(options, field),
                    on_change=lambda change, field=field: self._choose(**{field: change.value}),
                )
            for name, label in _LABELS.items():
                ui.switch(
                    label,
                    value=name in self._written,
                    on_change=lambda change, name=name: self._choose_label(
                        name, shown=bool(change.value)
                    ),
                )
            ui.number(
                "Frames around namespaces",
                value=options.group,
                min=0,
                max=9,
                precision=0,
                on_change=lambda change: self._choose(group=int(change.value or 0)),
            ).classes("w-full")

    def _choose(self, **changes: object) -> None:
        self._options = msgspec.structs.replace(self._options, **changes)
        self._show_address()
        self._refresh()

    def _show_address(self) -> None:
        options, usual = self._options, diagram.PictureOptions()
        query = {
            name: str(getattr(options, name))
            for name in ("content", "nodes", "topics", "group")
            if getattr(options, name) != getattr(usual, name)
        }
        if any(getattr(options, name) != getattr(usual, name) for name in _SWITCHES):
            hidden = [name for name in _SWITCHES if getattr(options, name)]
            query["hide"] = ",".join(name.removeprefix("hide_") for name in hidden)
        if self._written != ("rates",):
            query["labels"] = ",".join(self._written)
        layout.address_of(layout.query_of("/graph", **query, pick=self._chosen))

    def _choose_label(self, name: str, *, shown: bool) -> None:
        self._written = tuple(
            label for label in _LABELS if (shown if label == name else label in self._written)
        )
        self._choose()

    def _scale(self, step: int) -> None:
        self._zoom = min(300, max(40, self._zoom + step))
        self._drawing.style(f"zoom: {self._zoom / 100}")

    def _refresh(self) -> None:
        """Draw the changes; the rates on the arrows change once a second."""
        if self._drawn is not None and not self._frame.connected:
            return  # a browser that went elsewhere, or that comes back
        survey, now = self._watch.survey(), time.monotonic()
        if not self._described and self._watch.complete:
            with self._frame.content:
                self._describe_chosen()
        wanted = survey, self._options, self._chosen, self._written
        if wanted == self._wanted and now < self._due:
            return
        self._traffic.update(survey)
        if wanted != self._wanted:
            tokens = [t for t in survey.view.tokens if t.node_name != self._system.node.name]
            self._picture = diagram.make_picture(tokens, self._options)
        self._wanted, self._due = wanted, now + _RATES_PERIOD
        self._empty.set_visibility(not self._picture.boxes and self._watch.complete)
        self._card.set_visibility(bool(self._picture.boxes))
        self._update_drawing()

    def _update_drawing(self) -> None:
        """Draw the picture anew if it has changed, and otherwise only the rates that have."""
        flows = self._flows()
        shown = _DrawnGraph(self._picture, self._written if flows else (), self._chosen)
        if shown != self._shown:
            self._shown = shown
            if not self._draws:
                background_tasks.create(self._draw())
        elif self._drawn is self._shown:
            labels = dict(enumerate(diagram.labels_of(self._picture, flows)))
            changed = dict(labels.items() - self._labels.items())
            if changed:
                self._labels.update(changed)
                ui.run_javascript(f"({_RELABEL})({json.dumps(changed)})")

    async def _draw(self) -> None:
        """Draw on another thread, as the layout of a large picture takes a while.

        Changes in the meantime are drawn after it, so that a page in a burst of changes shows some.
        """
        self._draws = True
        try:
            while (shown := self._shown) is not self._drawn and shown is not None:
                flows = self._flows()
                async with self._system.drawing:
                    text = await run.io_bound(diagram.write_svg, shown.picture, flows, shown.chosen)
                if text is None or self._drawing.is_deleted:
                    return
                self._labels = dict(enumerate(diagram.labels_of(shown.picture, flows)))
                self._drawing.set_content(text if shown.picture.boxes else "")
                self._drawn = shown
        finally:
            self._draws = False

    def _flows(self) -> dict[str, str]:
        """Return the labels of arrows, by topic."""
        topics = {topic for arrow in self._picture.arrows for topic in arrow.topics}
        types = self._watch.survey().view.topics() if "types" in self._written else {}
        flows = {}
        for topic in topics:
            flow = self._traffic.flow(topic) if "rates" in self._written else None
            parts = [] if flow is None else [layout.short_rate_text(flow.rate)]
            parts += map(short_type, types.get(topic, ()))
            if parts:
                flows[topic] = " ".join(parts)
        return flows

    def _pick(self, event: GenericEventArguments) -> None:
        self._chosen = str(event.args)
        self._describe_chosen()
        self._show_address()
        self._refresh()

    def _describe_chosen(self) -> None:
        """Describe the chosen box."""
        self._described = True
        kind, _, name = self._chosen.partition(":")
        try:
            text = _describe(self._watch.survey(), kind, name)
        except RoszError as error:
            text = str(error)
        with ui.dialog(value=True) as dialog, ui.card().classes("rosz-card max-w-3xl"):
            ui.label(name).classes("text-base font-semibold")
            ui.label(text).classes("rosz-mono whitespace-pre-wrap break-all")
            with ui.row().classes("w-full justify-end"):
                if kind == "topic":
                    ui.link("Open the topic", layout.query_of("/topics", topic=name))
                ui.button("Close", on_click=dialog.close).props("flat")
        dialog.on("hide", dialog.delete)


def _describe(survey: Survey, kind: str, name: str) -> str:
    if kind == "topic":
        return format_topic(survey, name).strip()
    return "\n".join(format_node(survey, node).strip("-\n ") for node in find_nodes(survey, name))
