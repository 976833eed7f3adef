"""A browser's part of the protocol of a page, without a browser."""

from __future__ import annotations

import ast
import re
import threading
import urllib.request
from contextlib import ExitStack, suppress
from queue import SimpleQueue
from urllib.parse import urlencode

from network import TIMEOUT
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

__all__ = ("Visitor",)

_QUERY = re.compile(r"query: (\{[^}]*\})")
_LONG = 4 * TIMEOUT


class Visitor:
    """A page that is open until it is closed.

    Args:
        address: Address of the server.
        path: Path and query of the page.
        awake: Whether it reads what comes, and answers the pings of the server.

    Attributes:
        link: Its websocket.

    Raises:
        HTTPError: The server refuses.
    """

    def __init__(self, address: str, path: str = "/", *, awake: bool = True) -> None:
        with urllib.request.urlopen(address + path, timeout=_LONG) as response:
            found = _QUERY.search(response.read().decode())
        assert found is not None
        query = {name: str(value).lower() for name, value in ast.literal_eval(found[1]).items()}
        query.update(document_id="d", tab_id=f"t{query['client_id']}", old_tab_id="")
        query.update(EIO="4", transport="websocket")
        place = address.replace("http", "ws", 1) + "/_nicegui_ws/socket.io/?" + urlencode(query)
        self._stack = ExitStack()
        self.link: ClientConnection = self._stack.enter_context(
            connect(place, open_timeout=_LONG, max_size=None, ping_interval=None, close_timeout=1)
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
                    self._events.put(str(text))

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
