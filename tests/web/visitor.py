"""A browser's part of the protocol of a page, without a browser."""

from __future__ import annotations

import ast
import html
import json
import re
import threading
import urllib.request
from contextlib import ExitStack, suppress
from queue import SimpleQueue
from typing import Any
from urllib.parse import urlencode

from network import TIMEOUT, eventually
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

__all__ = ("Visitor",)

_QUERY = re.compile(r"query: (\{[^}]*\})")
_ELEMENTS = re.compile(r"parseElements\(String\.raw`(.*?)`\)", re.DOTALL)
_UPDATE = re.compile(r'42\["update",(.*)\]', re.DOTALL)
_LONG = 4 * TIMEOUT


class Visitor:
    """A page that is open until it is closed.

    Args:
        address: Address of the server.
        path: Path and query of the page.
        awake: Whether it reads what comes, and answers the pings of the server.
        cookie: What the browser got when its user logged in.

    Attributes:
        first: What the server sent first, as HTML.
        link: Its websocket.

    Raises:
        HTTPError: The server refuses.
    """

    def __init__(
        self, address: str, path: str = "/", *, awake: bool = True, cookie: str = ""
    ) -> None:
        request = urllib.request.Request(address + path, headers={"Cookie": cookie})
        with urllib.request.urlopen(request, timeout=_LONG) as response:
            self.first: str = response.read().decode()
        text = self.first
        found, elements = _QUERY.search(text), _ELEMENTS.search(text)
        assert found is not None
        assert elements is not None
        self._elements: dict[str, Any] = json.loads(html.unescape(elements[1]))
        query = {name: str(value).lower() for name, value in ast.literal_eval(found[1]).items()}
        self._client = query["client_id"]
        query.update(document_id="d", tab_id=f"t{query['client_id']}", old_tab_id="")
        query.update(EIO="4", transport="websocket")
        place = address.replace("http", "ws", 1) + "/_nicegui_ws/socket.io/?" + urlencode(query)
        self._stack = ExitStack()
        self.link: ClientConnection = self._stack.enter_context(
            connect(
                place,
                additional_headers={"Cookie": cookie},
                open_timeout=_LONG,
                max_size=None,
                ping_interval=None,
                close_timeout=1,
            )
        )
        self.link.send("40")
        self._events: SimpleQueue[str] = SimpleQueue()
        if awake:
            threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        with suppress(ConnectionClosed):
            for text in self.link:
                if text == "2":
                    self.link.send("3")
                else:
                    if found := _UPDATE.fullmatch(str(text)):
                        self._elements = {**self._elements, **json.loads(found[1])}
                    self._events.put(str(text))

    def _find(self, label: str) -> dict[str, Any] | None:
        """Return the newest element with a label, or with an accessible name, and its number."""
        for number, one in reversed(self._elements.items()):
            props = one.get("props", {}) if isinstance(one, dict) else {}
            if label in (props.get("label"), props.get("aria-label")) and one.get("events"):
                return {**one, "id": int(number)}
        return None

    def act(self, label: str, event: str, value: object = None) -> None:
        """Let an event happen at an element, as soon as there is one that handles it.

        Args:
            label: Label of the element, or its accessible name; that of a table is empty.
            event: Type of the event, or the beginning of it.
            value: What is sent with it.
        """
        taken: list[tuple[int, str]] = []

        def take() -> bool:
            one = self._find(label) if label else self._find_handling(event)
            taken.extend(
                (one["id"], listener["listener_id"])
                for listener in (one or {}).get("events", ())
                if one is not None and listener["type"].startswith(event)
            )
            return bool(taken)

        eventually(take, f"'{label}' with {event}", _LONG)
        number, listener_id = taken[0]
        message = {
            "id": number,
            "client_id": self._client,
            "listener_id": listener_id,
            "args": [json.dumps(value)],
        }
        self.link.send(f"42{json.dumps(['event', message])}")

    def _find_handling(self, event: str) -> dict[str, Any] | None:
        for number, one in self._elements.items():
            events = one.get("events", ()) if isinstance(one, dict) else ()
            if any(listener["type"] == event for listener in events):
                return {**one, "id": int(number)}
        return None

    def press(self, label: str) -> None:
        """Press a button."""
        self.act(label, "click")

    def write(self, label: str, value: object) -> None:
        """Change the value of a field."""
        self.act(label, "update:", value)

    def should_see(self, text: str) -> None:
        """Wait until a text is on the page, which may have been sent with the first HTML."""
        eventually(lambda: text in json.dumps(self._elements), f"'{text}' on the page", _LONG)

    def wait_for(self, text: str) -> None:
        """Wait until a text is in what comes."""
        while text not in self._events.get(timeout=_LONG):
            pass

    def count(self, text: str) -> int:
        """Return how many messages with a text have come that nobody has waited for."""
        waiting = [self._events.get() for _ in range(self._events.qsize())]
        return sum(text in one for one in waiting)

    def close(self) -> None:
        """Close the page."""
        self._stack.close()
