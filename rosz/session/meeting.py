"""Opening a session that is to be the meeting point where nobody else is.

Of two processes that begin to listen at one port at the same moment, Linux may refuse both: each
finds the other one about to. Zenoh does not try again, and they would never meet.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

import zenoh

from rosz.session.probe import is_listening
from rosz.wire import Endpoint

__all__ = ("open_at",)

_ATTEMPTS = 8
_PAUSE = 0.02


def open_at(settings: zenoh.Config, rendezvous: str, opened: Callable[[], Any]) -> Any:
    """Open a session, and see to it that somebody then listens at the meeting point.

    Args:
        settings: The configuration.
        rendezvous: Endpoint of the meeting point. One of another machine is left to itself, and
            so is one that the configuration does not listen at.
        opened: Opens a session by the configuration, with an id that none had before.

    Raises:
        zenoh.ZError: The session cannot be opened.
    """
    raw: Any = opened()
    endpoint = Endpoint(rendezvous)
    if _can_be_refused(endpoint) and _is_held(endpoint, settings):
        for _ in range(_ATTEMPTS):
            if is_listening(rendezvous):
                break
            raw.close()
            # Who was refused together must not come back together.
            time.sleep(_PAUSE * os.urandom(1)[0] / 256)
            raw = opened()
    return raw


def _can_be_refused(endpoint: Endpoint) -> bool:
    return endpoint.is_local and (endpoint.is_unix or endpoint.protocol == "tcp")


def _is_held(endpoint: Endpoint, settings: zenoh.Config) -> bool:
    """Tell whether a configuration listens at the meeting point, also under another name."""
    places = settings.get_json("listen/endpoints")
    return str(endpoint) in places or f":{endpoint.port}" in places
