"""Saying why links beyond the machine do not come about where they need keys."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

import zenoh

from rosz.session.config import secured

if TYPE_CHECKING:
    from rosz.session.config import SessionConfig

__all__ = ("refusals", "tell_refusals")

_log = logging.getLogger("rosz.session")


def refusals(config: SessionConfig) -> list[str]:
    """Return the endpoints that no link leads to, each with the reason.

    Asks each of them, which takes seconds where nobody answers; without keys there is none to ask.
    """
    if config.keys is None:
        return []
    from rosz.security.handshake import refusal

    found = []
    for endpoint in map(secured, dict.fromkeys((config.rendezvous, *config.connect))):
        reason = refusal(endpoint, config.keys) if endpoint.startswith("tls/") else ""
        if reason:
            found.append(f"'{endpoint}': {reason}")
    return found


def tell_refusals(config: SessionConfig) -> None:
    """Have the log tell of links that are refused, here or at the other end, from now on.

    Whom this end lets in is Zenoh's to decide, and told by Zenoh's own log.
    """
    if config.keys is None:
        return
    if config.listen:
        zenoh.init_log_from_env_or("zenoh_link_tls=warn")
    if config.connect and not config.must_connect and config.mode != "client":
        threading.Thread(target=_tell, args=(config,), name="rosz-refusals", daemon=True).start()


def _tell(config: SessionConfig) -> None:
    for reason in refusals(config):
        _log.warning("no link to %s", reason)
