"""Images of cameras, as rqt_image_view shows them, several at a time."""

from __future__ import annotations

from nicegui import ui
from nicegui.events import MouseEventArguments

from rosz.errors import RoszError
from rosz.introspect import list_topics
from rosz.web.model import IMAGE_TYPES, ImageWatch, System
from rosz.web.pages.layout import Frame, address_of, empty_state, offer_options, query_of, rate_text

_LIST_PERIOD = 1.0
_PERIOD = 0.05


class ImagesPage:
    """The choice of topics, which have commas between in the address, and a card for each."""

    def __init__(self, system: System, topics: str = "") -> None:
        self._system = system
        chosen = [topic for topic in topics.split(",") if topic]
        self._frame = frame = Frame(system, "Images", "/images")
        self._graph = frame.use(system.graph)
        self._views: dict[str, _View] = {}
        with frame.content:
            with ui.row().classes("rosz-card w-full items-center gap-3 px-3 py-2"):
                self._select = (
                    ui.select(
                        chosen,
                        value=chosen,
                        multiple=True,
                        label="Topics of images",
                        on_change=self._choose,
                    )
                    .props("use-chips")
                    .classes("grow min-w-52")
                )
            self._empty = empty_state(
                "photo_camera",
                "No image",
                "Topics of sensor_msgs/Image and CompressedImage appear here.",
            )
            self._box = ui.element("div").classes("w-full grid gap-4 grid-cols-1 lg:grid-cols-2")
        frame.keep(self)
        frame.every(_LIST_PERIOD, self._list)
        frame.every(_PERIOD, self._refresh)

    def close(self) -> None:
        """Unsubscribe."""
        for view in self._views.values():
            view.close()
        self._views.clear()

    def _list(self) -> None:
        survey = self._graph.survey()
        names = {
            entry.name
            for entry in list_topics(survey.view.tokens)
            if IMAGE_TYPES & set(entry.types)
        }
        chosen = list(self._select.value or [])
        options = offer_options(self._select, names)
        self._empty.set_visibility(not options and self._graph.complete)
        for topic in chosen:
            if topic not in self._views and topic in names:
                self._open(topic)

    def _choose(self) -> None:
        chosen = list(self._select.value or [])
        for topic in [shown for shown in self._views if shown not in chosen]:
            self._views.pop(topic).remove()
        address_of(query_of("/images", topics=",".join(chosen)))
        self._list()

    def _open(self, topic: str) -> None:
        try:
            self._system.permission.check("subscribe", topic)
            watch = ImageWatch(self._system.node, self._graph.survey(), topic)
        except RoszError as error:
            self._frame.show_fault(str(error))
            return
        with self._box:
            self._views[topic] = _View(self._system, watch)

    def _refresh(self) -> None:
        for view in self._views.values():
            view.refresh()


class _View:
    """One topic of images."""

    def __init__(self, system: System, watch: ImageWatch) -> None:
        self._system = system
        self._watch = watch
        self._key = system.pictures.add(watch.encoded)
        self._shown = 0
        with ui.column().classes("rosz-card w-full p-3 gap-2 min-w-0") as self._card:
            with ui.row().classes("w-full items-center gap-3"):
                ui.label(watch.topic).classes("font-semibold break-all")
                ui.space()
                self._flow = ui.label("").classes("rosz-soft rosz-number text-sm")
                ui.button(icon="download", on_click=self._save).props(
                    'flat dense round aria-label="Save"'
                )
            self._image = ui.interactive_image(
                events=["mousemove"], on_mouse=self._point, cross="#ff4081"
            ).classes("w-full")
            self._value = ui.label("").classes("rosz-mono rosz-soft").style("min-height: 1.2em")

    def refresh(self) -> None:
        """Show the newest image; the browser skips those that it has no time for."""
        watch = self._watch
        if watch.received == self._shown:
            return
        self._shown = watch.received
        self._image.set_source(f"/picture/{self._key}?n={self._shown}")
        flow = watch.flow()
        text = watch.description() + (f" · {rate_text(flow.rate)}" if flow is not None else "")
        self._flow.set_text(text)

    def _point(self, event: MouseEventArguments) -> None:
        try:
            self._value.set_text(self._watch.value_at(int(event.image_x), int(event.image_y)))
        except RoszError as error:
            self._value.set_text(str(error))

    def _save(self) -> None:
        try:
            content, _ = self._watch.encoded(".png")
        except RoszError as error:
            ui.notify(str(error), type="negative")
            return
        ui.download.content(content, f"{self._watch.topic.strip('/').replace('/', '_')}.png")

    def remove(self) -> None:
        """Take it off the page."""
        self.close()
        self._card.delete()

    def close(self) -> None:
        """Unsubscribe."""
        self._system.pictures.remove(self._key)
        self._watch.close()
