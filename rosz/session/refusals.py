"""Saying why links beyond the machine do not come about where they need keys."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING

import zenoh

from rosz.session.endpoints import connect_endpoint
from rosz.wire import Endpoint

if TYPE_CHECKING:
    from rosz.security import KeyFolder
    from rosz.session.config import SessionConfig

__all__ = ("refusals", "tell_refusals")

_log = logging.getLogger("rosz.session")


def refusals(config: SessionConfig) -> list[str]:
    """Return the endpoints that no link leads to for want of keys, each with the reason.

    Asks each of them, which takes seconds where nobody answers.
    """
    places = list(dict.fromkeys((config.rendezvous, *config.connect)))
    if config.keys is not None:
        places = [connect_endpoint(endpoint) for endpoint in places]
    reasons = {endpoint: _reason(endpoint, config.keys) for endpoint in places}
    return [f"'{endpoint}': {reason}" for endpoint, reason in reasons.items() if reason]


def _reason(place: str, keys: KeyFolder | None) -> str:
    endpoint = Endpoint(place)
    if endpoint.is_local or not endpoint.is_tcp:
        return ""
    from rosz.security.handshake import refusal, wants_keys

    if keys is not None:
        return refusal(endpoint, keys)
    return "it wants keys, and there are none here: set ROSZ_KEYS" if wants_keys(endpoint) else ""


def tell_refusals(config: SessionConfig) -> None:
    """Have the log tell of links that are refused, here or at the other end, from now on.

    Whom this end lets in is Zenoh's to decide, and told by Zenoh's own log.
    """
    if config.keys is not None and config.listen:
        zenoh.init_log_from_env_or("zenoh_link_tls=warn")
    if config.connect and not config.must_connect and config.mode != "client":
        threading.Thread(target=_tell, args=(config,), name="rosz-refusals", daemon=True).start()


def _tell(config: SessionConfig) -> None:
    for reason in refusals(config):
        _log.warning("no link to %s", reason)
