"""The frame of all pages: header, navigation, light and dark colors, and error messages."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar
from urllib.parse import urlencode

from nicegui import run, ui

from rosz.errors import RoszError
from rosz.lifecycle import Closable
from rosz.web.model import SharedResource, System

T = TypeVar("T", bound=Closable)
R = TypeVar("R")

_log = logging.getLogger("rosz.web")
_THEME_COOKIE = "rosz-theme"
_THEMES = {"auto": None, "light": False, "dark": True}
_THEME_ICONS = {"auto": "brightness_auto", "light": "light_mode", "dark": "dark_mode"}
_KILO = 1000.0
_CHOICE_CELL = """<q-td :props="props"><a :href="props.row.address" @click.exact.prevent>
{{ props.value }}</a></q-td>"""
_CHOICE = """(event, row) => {
  if (event.defaultPrevented || !event.target.closest('a')) emit(row.name);
}"""


class NavigationEntry(NamedTuple):
    """One page in the navigation."""

    path: str
    title: str
    icon: str


ENTRIES = (
    NavigationEntry("/", "Overview", "space_dashboard"),
    NavigationEntry("/graph", "Graph", "hub"),
    NavigationEntry("/topics", "Topics", "swap_horiz"),
    NavigationEntry("/plot", "Plot", "show_chart"),
    NavigationEntry("/images", "Images", "photo_camera"),
    NavigationEntry("/3d", "3D", "view_in_ar"),
    NavigationEntry("/console", "Console", "subject"),
    NavigationEntry("/parameters", "Parameters", "tune"),
    NavigationEntry("/reconfigure", "Reconfigure", "settings_input_component"),
    NavigationEntry("/services", "Services", "build"),
    NavigationEntry("/actions", "Actions", "flag"),
    NavigationEntry("/bags", "Bags", "inventory_2"),
    NavigationEntry("/drive", "Drive", "sports_esports"),
)
"""The pages, in the order of the navigation."""

_STYLE = Path(__file__).with_name("style.css")

# The look of the controls of all pages.
ui.button.default_props("no-caps")
ui.select.default_props("dense options-dense")
for _control in (ui.input, ui.number, ui.switch):
    _control.default_props("dense")


class Frame:
    """One opened page: its header and navigation, and its resources until it is closed.

    Args:
        system: The system that it shows.
        title: Title of the page.
        path: Path of its entry in the navigation.
    """

    def __init__(self, system: System, title: str, path: str) -> None:
        self.system = system
        self._uses: list[Closable] = []
        self._client = ui.context.client
        self._client.on_delete(self._close)
        ui.page_title(f"{title} · rosz")
        ui.colors(
            primary="#2456c8",
            secondary="#5b6577",
            positive="#1f8a5b",
            negative="#c8342b",
            warning="#b7791f",
            info="#2b7bb9",
        )
        ui.add_css(_STYLE)
        self._add_header(title, path)
        self.content = ui.column().classes("w-full max-w-7xl mx-auto px-3 sm:px-6 py-4 gap-4")
        with self.content:
            self._fault = (
                ui.label().classes("rosz-card text-negative w-full p-3").props("role=alert")
            )
            self._fault.set_visibility(False)

    def _add_header(self, title: str, path: str) -> None:
        with (
            ui.left_drawer(value=False, bordered=True)
            .props("width=216 breakpoint=900 show-if-above")
            .classes("p-0 pt-3") as drawer,
            ui.element("nav").props('aria-label="Pages"').classes("w-full"),
        ):
            for entry in ENTRIES:
                with (
                    ui.item()
                    .props(f'href="{entry.path}" tag=a')
                    .classes("rosz-nav w-auto" + " rosz-here" * (entry.path == path))
                ):
                    with ui.item_section().props("avatar").classes("min-w-0 pr-3"):
                        ui.icon(entry.icon, size="20px")
                    ui.item_section(entry.title)
        with (
            ui.header()
            .classes("items-center gap-2 px-3 py-1")
            .style("background: #16213a; min-height: 52px")
        ):
            ui.button(icon="menu", on_click=drawer.toggle).props(
                'flat round dense color=white aria-label="Navigation"'
            )
            ui.label("rosz").classes("font-bold text-lg")
            ui.label(title).classes("text-base opacity-80")
            ui.space()
            if self.system.permission.read_only:
                ui.badge("read-only", color="warning")
            ui.label(f"domain {self.system.node.context.domain}").classes(
                "rosz-wide text-sm opacity-70"
            )
            self._add_theme_button()

    def _add_theme_button(self) -> None:
        cookies = self._client.request.cookies
        theme = cookies.get(_THEME_COOKIE, "auto")
        theme = theme if theme in _THEMES else "auto"
        dark = ui.dark_mode(_THEMES[theme])

        def change() -> None:
            nonlocal theme
            names = list(_THEMES)
            theme = names[(names.index(theme) + 1) % len(names)]
            dark.value = _THEMES[theme]
            button.props(f"icon={_THEME_ICONS[theme]}")
            tooltip.set_text(f"Colors: {theme}")
            ui.run_javascript(
                f"document.cookie = '{_THEME_COOKIE}={theme};path=/;max-age=31536000;SameSite=Lax'"
            )

        with ui.button(icon=_THEME_ICONS[theme], on_click=change).props(
            'flat round dense color=white aria-label="Light or dark"'
        ) as button:
            tooltip = ui.tooltip(f"Colors: {theme}")

    # Resources of a page.

    def use(self, shared: SharedResource[T]) -> T:
        """Open something until the page is closed.

        Raises:
            RoszError: It cannot be opened.
        """
        use = shared.use()
        self.keep(use)
        return use.value

    def keep(self, part: Closable) -> None:
        """Close something with the page."""
        if self.closed:
            part.close()
        else:
            self._uses.append(part)

    @property
    def closed(self) -> bool:
        """Whether the browser has left the page."""
        return self._client.is_deleted

    @property
    def connected(self) -> bool:
        """Whether the browser has a link to the page, which it may lose for some seconds."""
        return self._client.has_socket_connection

    def _close(self) -> None:
        uses, self._uses = self._uses, []
        for use in reversed(uses):
            use.close()

    def every(self, seconds: float, refresh: Callable[[], None]) -> None:
        """Call a function now and after each period while the page is open; errors are shown."""
        faults: list[str] = []

        def guarded() -> None:
            try:
                refresh()
            except RoszError as error:
                faults[:] = [str(error)]
                self.show_fault(faults[0])
            else:
                if faults:
                    faults.clear()
                    self.show_fault("")

        guarded()
        ui.timer(seconds, guarded, immediate=False)

    def show_fault(self, text: str) -> None:
        """Show a sentence at the top of the page; hide it if it is empty."""
        show_text(self._fault, text)

    async def attempt(self, action: Callable[[], R], done: str = "") -> R | None:
        """Run something that may take long, and say how it went.

        Args:
            action: Function that is called on another thread.
            done: What to say if it succeeds.

        Returns:
            The result of the function; None if it raises an error of rosz, which is shown.
        """
        try:
            result = await run.io_bound(action)
        except RoszError as error:
            _log.debug("a page failed to act", exc_info=True)
            ui.notify(
                str(error), type="negative", multi_line=True, timeout=8000, close_button="Close"
            )
            return None
        if done:
            ui.notify(done, type="positive")
        return result


class Opened(Generic[T]):
    """At most one open resource of a page; it is closed with the page, or when another replaces it.

    Attributes:
        value: The open resource, or None.
    """

    def __init__(self, frame: Frame) -> None:
        self.value: T | None = None
        frame.keep(self)

    def set(self, value: T) -> None:
        """Close the open resource, and hold another."""
        self.close()
        self.value = value

    def close(self) -> None:
        """Close the open resource; a second call has no effect."""
        value, self.value = self.value, None
        if value is not None:
            value.close()


def empty_state(icon: str, title: str, text: str, command: str = "") -> ui.column:
    """Add a note that there is nothing, and what to start."""
    with ui.column().classes("rosz-card w-full items-center text-center p-8 gap-2") as column:
        ui.icon(icon, size="48px").classes("rosz-soft")
        ui.label(title).classes("text-lg font-medium")
        ui.label(text).classes("rosz-soft")
        if command:
            ui.label(command).classes("rosz-mono rosz-card px-3 py-1")
    return column


def show_text(label: ui.label, text: str) -> None:
    """Show a text, and hide its label if it is empty."""
    label.set_text(text)
    label.set_visibility(bool(text))


def card(title: str, classes: str = "p-4 gap-2") -> ui.column:
    """Add a card with a title, and return it for its contents."""
    with ui.column().classes(f"rosz-card {classes} min-w-0 w-full") as column:
        ui.label(title).classes("text-base font-semibold")
    return column


def tool_button(text: str, icon: str, act: Callable[[], Any]) -> ui.button:
    """Add a flat button, as rows of tools have them."""
    return ui.button(text, icon=icon, on_click=act).props("flat dense")


def add_table(columns: list[dict[str, Any]], key: str = "name", most: int = 12) -> ui.table:
    """Add a table without rows, which shows that many at a time; a column tells rows apart."""
    table = ui.table(rows=[], columns=columns, row_key=key, pagination=most)
    return table.classes("w-full").props("flat dense")


def show_rows(table: ui.table, rows: list[dict[str, Any]]) -> None:
    """Give a table other rows, unless they are the same."""
    if table.rows != rows:
        table.rows = rows


def add_select(
    label: str, chosen: str, on_change: Callable[..., object], **options: Any
) -> ui.select:
    """Add a choice of names, which has only the chosen one yet; see `offer_options`."""
    names = [chosen] if chosen else []
    return ui.select(names, value=chosen or None, label=label, on_change=on_change, **options)


def offer_options(select: ui.select, names: Iterable[str]) -> list[str]:
    """Offer names beside those that are chosen, and return all, sorted."""
    chosen = select.value
    options = sorted({*names, *(chosen if isinstance(chosen, list) else filter(None, [chosen]))})
    if select.options != options:
        select.set_options(options, value=chosen)
    return options


def address_of(path: str) -> None:
    """Show the address that the page has now, so that it can be kept and sent."""
    ui.run_javascript(f"history.replaceState(null, '', {json.dumps(path)})")


def query_of(path: str, **given: str) -> str:
    """Return the address of a page with what it shows; empty values are left out."""
    query = urlencode({name: value for name, value in given.items() if value}, safe="/,:*[]@")
    return f"{path}?{query}" if query else path


def offer_choice(table: ui.table, choose: Callable[[str], object]) -> None:
    """Let a row be chosen by a click, or by its ``name``, which is a link, with the keyboard.

    Rows also have an ``address`` that shows them.
    """
    table.classes("cursor-pointer")
    table.add_slot("body-cell-name", _CHOICE_CELL)
    table.on("row-click", lambda event: choose(str(event.args)), js_handler=_CHOICE)


def column(
    name: str, label: str, classes: str = "", *, align: str = "left", sort: str = ""
) -> dict[str, Any]:
    """Return a column of a table, sorted by the numbers in a field, or by the shown texts."""
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


def number_column(name: str, label: str, classes: str = "", sort: str = "") -> dict[str, Any]:
    """Return a column of numbers; the arguments are those of `column`."""
    return column(name, label, f"rosz-number {classes}".strip(), align="right", sort=sort)


def duration_text(seconds: float) -> str:
    """Return a time in whole minutes as text, which changes rarely."""
    minutes = max(0, int(seconds)) // 60
    if minutes >= 60:  # noqa: PLR2004
        return f"{minutes // 60} h {minutes % 60} min"
    return f"{minutes} min" if minutes else "under 1 min"


def short_rate_text(rate: float) -> str:
    """Return a rate in hertz in two digits, which change less often."""
    return f"{float(f'{rate:.2g}'):g} Hz"


def rate_text(rate: float) -> str:
    """Return a rate in hertz as text."""
    return f"{rate:.0f} Hz" if rate >= 100 else f"{rate:.1f} Hz"  # noqa: PLR2004


def bandwidth_text(value: float) -> str:
    """Return bytes per second as text."""
    return f"{size_text(value)}/s"


def size_text(value: float) -> str:
    """Return a number of bytes as text."""
    for unit in ("B", "kB", "MB"):
        if value < _KILO:
            return f"{value:.0f} {unit}" if unit == "B" else f"{value:.1f} {unit}"
        value /= _KILO
    return f"{value:.1f} GB"
