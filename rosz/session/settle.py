"""Finding out when a young session is linked to everybody that the others are linked to.

A peer hears of the other peers from the one it meets first, and connects to them in the background.
What it publishes before that is done misses those it is not linked to yet. So it asks whom it
meets for *their* links, and is settled once it has all of them itself.
"""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

import msgspec

from rosz.errors import RoszError
from rosz.session.samples import Query

if TYPE_CHECKING:
    from rosz.session.declared import Closable
    from rosz.session.session import Session

__all__ = ("serve_links", "settle")

_SPACE = "@rosz/links"
_POLL = 0.002
_ASK_TIMEOUT = 0.5


def serve_links(session: Session) -> Closable:
    """Tell others whom this session is linked to."""

    def answer(query: Query) -> None:
        # Zenoh forbids calls into the session on its own threads.
        threading.Thread(target=_answer, args=(session, query), daemon=True).start()

    return session.queryable(f"{_SPACE}/{session.zid}", answer)


def _answer(session: Session, query: Query) -> None:
    with query:
        try:
            query.reply(f"{_SPACE}/{session.zid}", msgspec.msgpack.encode(session.peers()))
        except RoszError:
            return  # the session closed meanwhile; whoever asked sees that it is gone


def settle(session: Session, *, timeout: float, stop: threading.Event) -> bool:
    """Wait until the session is linked to all that its neighbours are linked to.

    Args:
        session: A peer that is not alone.
        timeout: Seconds.
        stop: Ends the wait when set.

    Returns:
        Whether it is settled; false when the time was over or the wait was stopped.
    """
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        if stop.wait(_POLL):
            return False
        if not session.peers():
            continue
        wanted: set[str] = set()
        for reply in session.get(f"{_SPACE}/*", timeout=_ASK_TIMEOUT):
            if reply.ok:
                wanted.update(msgspec.msgpack.decode(reply.payload, type=list[str]))
        if wanted <= {session.zid, *session.peers()}:
            return True
    return False
