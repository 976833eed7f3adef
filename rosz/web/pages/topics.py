"""One topic: its newest message, what flows, and a form to publish."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from rosz.errors import RoszError
from rosz.introspect import FieldPath, find_topic, list_topics
from rosz.names import short_type
from rosz.web.model import FieldCondition, Sending, System, TopicWatch, message_tree
from rosz.web.pages import layout
from rosz.web.pages.form import MessageForm

_PERIOD = 0.25
_LIST_PERIOD = 1.0
_MILLI = 1e3
_FASTEST = 1000.0


class TopicsPage:
    """The choice of a topic, and the topic.

    Args:
        system: The system.
        topic: Topic to show; empty for none.
        field: Path of the field to show; empty for the whole message.
        condition: A condition that a shown message fulfils; empty for all.
    """

    def __init__(
        self, system: System, topic: str = "", field: str = "", condition: str = ""
    ) -> None:
        self._system = system
        self._frame = frame = layout.Frame(system, "Topics", "/topics")
        self._graph = frame.use(system.graph)
        self._field = field
        self._condition = condition
        self._watch: layout.Opened[TopicWatch] = layout.Opened(frame)
        self._fault = ""
        with frame.content:
            with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-2"):
                self._select = layout.add_select(
                    "Topic",
                    topic,
                    lambda change: self._choose(change.value),
                    with_input=True,
                    new_value_mode="add-unique",
                )
                self._select.props("clearable").classes("grow min-w-52")
                ui.input(
                    "Field",
                    value=field,
                    placeholder="pose/position",
                    on_change=lambda change: self._choose_field(change.value or ""),
                ).props("clearable debounce=400").classes("w-40")
                ui.input(
                    "Only if",
                    value=condition,
                    placeholder="linear/x > 0.5",
                    on_change=lambda change: self._choose_condition(change.value or ""),
                ).props("clearable debounce=600").classes("w-40")
                self._frozen = ui.switch("Freeze")
            with ui.element("div").classes("w-full grid gap-4 grid-cols-1 lg:grid-cols-2"):
                self._echo = _Echo()
                self._publish = _Publish(system, frame)
        frame.every(_LIST_PERIOD, self._list)
        frame.every(_PERIOD, self._refresh)

    def _list(self) -> None:
        own = self._system.node.name
        survey = self._graph.survey()
        tokens = (token for token in survey.view.tokens if token.node_name != own)
        rows = [entry.name for entry in list_topics(tokens)]
        chosen = self._select.value
        layout.offer_options(self._select, rows)
        if self._watch.value is None and chosen and chosen in rows:
            self._open(chosen)

    def _choose(self, topic: str | None) -> None:
        self._watch.close()
        self._echo.clear()
        self._show_address()
        if topic:
            self._open(topic)

    def _choose_field(self, field: str) -> None:
        self._field = field
        self._echo.clear()
        self._show_address()

    def _choose_condition(self, condition: str) -> None:
        self._condition = condition
        self._choose(self._select.value)

    def _show_address(self) -> None:
        topic = self._select.value
        query = layout.query_of(
            "/topics", topic=topic, field=self._field, condition=self._condition
        )
        layout.address_of(query)

    def _open(self, topic: str) -> None:
        try:
            self._system.permission.check("subscribe", topic)
            survey = self._graph.survey()
            find_topic(survey, topic)
            condition = FieldCondition(self._condition) if self._condition.strip() else None
            watch = TopicWatch(self._system.node, survey, topic, condition)
        except RoszError as error:
            self._fault = str(error) if self._graph.complete else ""
            return
        self._watch.set(watch)
        self._fault = ""
        self._publish.offer(topic, short_type(watch.type_name))

    def _refresh(self) -> None:
        watch = self._watch.value
        if watch is None:
            self._echo.show_nothing(self._select.value, self._fault)
            return
        message = watch.message()
        self._echo.show_flow(watch)
        if message is None or self._frozen.value:
            return
        try:
            value = FieldPath(self._field).read(message) if self._field else message
        except (LookupError, AttributeError, RoszError) as error:
            self._echo.show_nothing(watch.topic, f"no field '{self._field}' in it: {error}")
            return
        self._echo.show(message_tree(value, self._field or short_type(watch.type_name)))


class _Echo:
    """The newest message as a tree."""

    def __init__(self) -> None:
        self._ids: set[str] = set()
        self._shown: object = None
        with ui.column().classes("rosz-card w-full p-4 gap-2 min-w-0"):
            with ui.row().classes("w-full gap-4 items-center"):
                ui.label("Newest message").classes("text-base font-semibold")
                ui.space()
                self._flow = ui.label("").classes("rosz-soft rosz-number text-sm")
            self._note = ui.label("Choose a topic.").classes("rosz-soft")
            self._tree = ui.tree([], node_key="id", label_key="name").props(
                'dense no-transition no-nodes-label=" "'
            )
            self._tree.classes("rosz-mono w-full overflow-auto").style("max-height: 65vh")
            self._tree.add_slot(
                "default-header",
                "<span>{{ props.node.name }}</span><span v-if=\"props.node.value !== ''\""
                ' class="rosz-value">: {{ props.node.value }}</span>',
            )

    def clear(self) -> None:
        """Clear the shown message."""
        self._ids = set()
        self._shown = None
        self._flow.set_text("")
        self._set_tree([])

    def _set_tree(self, nodes: list[dict[str, Any]]) -> None:
        self._tree.props["nodes"] = nodes
        self._tree.update()
        self._tree.set_visibility(bool(nodes))

    def show_nothing(self, topic: str | None, fault: str) -> None:
        """Say why nothing is shown."""
        text = fault or (f"Waiting for '{topic}'." if topic else "Choose a topic.")
        layout.show_text(self._note, text)

    def show_flow(self, watch: TopicWatch) -> None:
        """Show what flows."""
        flow, delay = watch.flow(), watch.delay()
        parts = [short_type(watch.type_name)]
        if flow is not None:
            parts += [
                layout.rate_text(flow.rate),
                layout.bandwidth_text(flow.bandwidth),
                layout.size_text(flow.size),
            ]
        if delay is not None:
            parts.append(f"{delay.mean * _MILLI:.1f} ms old")
        self._flow.set_text(" · ".join(parts))
        text = "" if watch.received else "No message has come yet."
        if watch.received and watch.message() is None:
            text = f"None of {watch.received} messages fulfils the condition."
        layout.show_text(self._note, text)

    def show(self, tree: dict[str, Any]) -> None:
        """Show a message; new parts of it are opened."""
        if tree == self._shown:
            return
        self._shown = tree
        self._set_tree([tree])
        ids = set(_ids(tree))
        if new := ids - self._ids:
            self._ids |= ids
            self._tree.expand(list(new))


def _ids(tree: dict[str, Any]) -> list[str]:
    ids = [tree["id"]] if tree.get("children") else []
    for child in tree.get("children", ()):
        ids += _ids(child)
    return ids


class _Publish:
    """The form that publishes."""

    def __init__(self, system: System, frame: layout.Frame) -> None:
        self._system = system
        self._frame = frame
        self._sending: layout.Opened[Sending] = layout.Opened(frame)
        with layout.card("Publish"):
            with ui.row().classes("w-full gap-3"):
                self._topic = ui.input("Topic").classes("grow")
                self._type = ui.input("Type", placeholder="std_msgs/String").classes("grow")
            self._form = MessageForm(
                system.node, "Fields in YAML; those left out have their default value"
            )
            with ui.row().classes("w-full items-center gap-3"):
                ui.button("Fill in", on_click=self._fill).props("flat")
                ui.button("Publish once", icon="send", on_click=self._send)
                self._rate = ui.number("Hz", value=10, min=0.01, max=_FASTEST).classes("w-16")
                self._repeat = ui.button("Repeat", icon="repeat", on_click=self._toggle)
                self._repeat.props("outline")
                self._sent = ui.label("").classes("rosz-soft text-sm")
        ui.timer(0.5, self._count)

    def offer(self, topic: str, type_name: str) -> None:
        """Fill in a topic and its type, unless the form is of that topic already."""
        if (self._topic.value, self._type.value) == (topic, type_name):
            return
        self._sending.close()
        self._topic.set_value(topic)
        self._type.set_value(type_name)
        self._fill()

    def _fill(self) -> None:
        try:
            self._form.show(self._system.node.context.types.message(self._type.value))
        except (RoszError, ValueError) as error:
            ui.notify(str(error), type="negative")

    def _open(self) -> Sending:
        topic, type_name = self._topic.value.strip(), self._type.value.strip()
        name = self._system.node.resolve(topic)
        sending = self._sending.value
        if sending is None or sending.named != (name, type_name):
            self._sending.close()
            sending = Sending(self._system.node, self._system.permission, topic, type_name)
            self._sending.set(sending)
        return sending

    async def _send(self) -> None:
        text = self._form.text
        await self._frame.attempt(lambda: self._open().send(text), f"published {self._topic.value}")

    async def _toggle(self) -> None:
        sending = self._sending.value
        if sending is not None and sending.repeats:
            sending.stop()
        else:
            text, rate = self._form.text, min(_FASTEST, max(0.01, float(self._rate.value or 1)))
            await self._frame.attempt(lambda: self._open().repeat(text, rate))
        self._count()

    def _count(self) -> None:
        sending = self._sending.value
        repeats = sending is not None and sending.repeats
        self._repeat.set_text("Stop" if repeats else "Repeat")
        self._sent.set_text(f"{sending.sent} sent" if sending is not None and sending.sent else "")
