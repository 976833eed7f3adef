"""How a session comes about: where to, by which configuration, and what is said if it does not."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import zenoh

from rosz.errors import TransportError
from rosz.session.config import (
    EPHEMERAL,
    SessionConfig,
    key_settings,
    new_id,
    overrides,
    zenoh_settings,
)
from rosz.session.declared import translate_errors
from rosz.session.meeting import open_at
from rosz.session.memory import keep_freed_memory
from rosz.session.presence import Presence, marks, stopped_holder, why_unanswered
from rosz.session.probe import first_listening
from rosz.session.refusals import refusals, tell_refusals
from rosz.session.segments import SEGMENTS, sweep
from rosz.session.stopped import describe, remedy

__all__ = ("open_raw", "places_of")

_NOBODY = "Unable to connect to any of"
_RUNTIME = "ZENOH_RUNTIME"
_ROUTER_RECEIVERS = 16
_BUSY_BY = 60.0
"""Seconds that a node waits for a busy router."""
_RARER = "retry_period_init_ms=100;retry_period_max_ms=86400000;retry_period_increase_factor=4"

_log = logging.getLogger("rosz.session")


def open_raw(config: SessionConfig, presence: Presence | None = None) -> Any:
    """Open a session of Zenoh's.

    Args:
        config: What it is to be.
        presence: Its mark, if it leaves one.

    Raises:
        TransportError: Nobody answers where one must, or who does is stopped, an endpoint is
            occupied or malformed, or a configuration value is refused.
        UsageError: The override text is malformed.
    """
    config = _sharing_if_possible(_within_reach(_patient(config)))
    settings = _settings(config)
    if presence is not None:
        _listen_where_marked(settings, presence)
        _go_round_stopped(settings, presence)
    sweep()
    keep_freed_memory()
    tell_refusals(config)
    try:
        with translate_errors(f"open a session ({_places(config)})"), _receivers(config.mode):
            if config.mode == "peer" and config.hold_rendezvous:
                return open_at(settings, config.rendezvous, lambda: _open(settings, config))
            return _open(settings, config)
    except TransportError as error:
        if _NOBODY not in str(error):
            raise
        raise _nobody(config) from error


def _open(settings: zenoh.Config, config: SessionConfig) -> Any:
    if "id" not in overrides(config.override) and (zid := new_id(config)):
        settings.insert_json5("id", json.dumps(zid))
    return zenoh.open(settings)


def places_of(config: SessionConfig) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return where a session is to listen and to connect, by all that configures it.

    Raises:
        TransportError: A configuration value is refused.
        UsageError: The override text is malformed, or a protocol knows no keys.
    """
    settings = _settings(config)
    listen, connect = (
        json.loads(settings.get_json(f"{way}/endpoints")) for way in ("listen", "connect")
    )
    return _of_mode(listen, config.mode), _of_mode(connect, config.mode)


def _of_mode(endpoints: Any, mode: str) -> tuple[str, ...]:
    """Return the endpoints of a mode, which a configuration file may tell apart."""
    found = endpoints.get(mode) if isinstance(endpoints, dict) else endpoints
    return tuple(found or ())


def _settings(config: SessionConfig) -> zenoh.Config:
    with translate_errors("read the Zenoh configuration"):
        if config.config_file:
            settings = zenoh.Config.from_file(config.config_file)
        else:
            settings = zenoh.Config.from_json5(json.dumps(zenoh_settings(config)))
        for path, part in key_settings(config).items():
            settings.insert_json5(path, json.dumps(part))
        for path, text in overrides(config.override).items():
            settings.insert_json5(path, text)
    return settings


@contextmanager
def _receivers(mode: str) -> Iterator[None]:
    """Have Zenoh receive on one thread, or on several in a router, unless the user says otherwise.

    Two hand a link's data to each other from core to core, which makes a round trip a quarter
    longer. But a link that is given up holds its thread for seconds, and all links with it: to a
    router that loses several at once, that matters more. Zenoh reads this once, when the first
    session of the process opens.
    """
    given = _RUNTIME in os.environ
    if not given:
        count = _ROUTER_RECEIVERS if mode == "router" else 1
        os.environ[_RUNTIME] = f"(rx: (worker_threads: {count}))"
    try:
        yield
    finally:
        if not given:
            os.environ.pop(_RUNTIME, None)


def _sharing_if_possible(config: SessionConfig) -> SessionConfig:
    """Go without shared memory where there can be none, as in some containers."""
    if not config.shared_memory or not SEGMENTS.exists() or os.access(SEGMENTS, os.W_OK):
        return config
    _log.warning("no shared memory, for %s cannot be written to: samples go by links", SEGMENTS)
    return msgspec.structs.replace(config, shared_memory=0)


def _patient(config: SessionConfig) -> SessionConfig:
    """Have a node wait longer for who is there: of many that start at once some come last."""
    if config.mode != "client" or config.must_connect:
        return config
    if all(mark.is_stopped for mark in marks(config.rendezvous)):
        return config
    return msgspec.structs.replace(config, open_timeout=max(config.open_timeout, _BUSY_BY))


def _within_reach(config: SessionConfig) -> SessionConfig:
    """Have a client of several places go to the first that answers: Zenoh stays at the very first.

    A command asks where it was told to ask rather than at home; a node is a client of its own hub.

    Raises:
        TransportError: Nobody answers at any of them.
    """
    if config.mode != "client" or config.config_file:
        return config
    home = _awake_at_home(config)
    wanted = (*config.connect, *home) if config.must_connect else (*home, *config.connect)
    if wanted == (config.rendezvous,):
        return config
    place = first_listening(wanted, config.open_timeout)
    if not place:
        raise _nobody(config)
    return msgspec.structs.replace(config, rendezvous=place, connect=())


def _awake_at_home(config: SessionConfig) -> tuple[str, ...]:
    """Return the meeting point; if who holds it is stopped, all other places of this machine.

    Raises:
        TransportError: There are none, and nowhere else to go.
    """
    there = marks(config.rendezvous)
    if stopped_holder(config.rendezvous, there) is None:
        return (config.rendezvous,)
    awake = tuple(mark.endpoint for mark in there if mark.port and not mark.is_stopped)
    if not awake and not config.connect:
        raise TransportError(why_unanswered(config.rendezvous))
    return awake


def _nobody(config: SessionConfig) -> TransportError:
    reasons = "".join(f"; no link to {reason}" for reason in refusals(config))
    return TransportError(
        f"nobody answers at {_places(config)} within {config.open_timeout:g} s{reasons}: start"
        " 'rosz core', a launch or a node there first, or name another place in ROSZ_RENDEZVOUS"
    )


def _listen_where_marked(settings: zenoh.Config, presence: Presence) -> None:
    """Have a session listen at the port that its mark tells."""
    listen = json.loads(settings.get_json("listen/endpoints"))
    if presence.mark.endpoint and EPHEMERAL in listen:
        listen[listen.index(EPHEMERAL)] = presence.mark.endpoint
        settings.insert_json5("listen/endpoints", json.dumps(listen))


def _go_round_stopped(settings: zenoh.Config, presence: Presence) -> None:
    """Link a session to all that it is not introduced to, as who would do that is stopped.

    The others are tried ever more rarely, as nobody knows who will listen there in an hour.
    """
    others = presence.others()
    pid = stopped_holder(presence.rendezvous, others)
    if pid is None:
        return
    _log.warning(
        "%s holds the meeting point %s and is stopped: it is not reached until it goes on (%s)",
        describe(pid),
        presence.rendezvous,
        remedy(pid),
    )
    awake = [f"{mark.endpoint}#{_RARER}" for mark in others if mark.port and not mark.is_stopped]
    connect = [*awake, *json.loads(settings.get_json("connect/endpoints"))]
    settings.insert_json5("connect/endpoints", json.dumps(connect))
    settings.insert_json5("connect/timeout_ms", "-1")  # in the background


def _places(config: SessionConfig) -> str:
    return ", ".join(f"'{endpoint}'" for endpoint in config.endpoints)
