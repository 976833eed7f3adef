"""Opening a session: its Zenoh configuration, and the errors when it does not open."""

from __future__ import annotations

import json
import logging
import os
import threading
from typing import TYPE_CHECKING, Any

import msgspec
import zenoh

from rosz.errors import TransportError
from rosz.session.config import (
    EPHEMERAL,
    SessionConfig,
    connect_endpoint,
    key_settings,
    new_id,
    overrides,
    zenoh_settings,
)
from rosz.session.declared import translate_errors
from rosz.session.zenoh_workarounds import (
    SEGMENTS,
    connect_to_running,
    open_and_listen,
    prepare_process,
    reachable_config,
    remove_abandoned_segments,
)
from rosz.wire import Endpoint

if TYPE_CHECKING:
    from rosz.security import KeyFolder
    from rosz.session.local_peers import LocalPeer, LocalPeers

__all__ = ("open_raw", "places_of")

_NOBODY = "Unable to connect to any of"
_BUSY_TIMEOUT = 60.0
"""Seconds that a node waits for a busy router."""

_log = logging.getLogger("rosz.session")


def open_raw(config: SessionConfig, peers: LocalPeers, own: LocalPeer | None = None) -> Any:
    """Open a session of Zenoh.

    Args:
        config: The configuration.
        peers: The other sessions of this machine.
        own: How this session is registered among them, if it is.

    Raises:
        TransportError: Nobody answers although the configuration requires a link, the process that
            should answer is stopped, an endpoint is occupied or malformed, or a configuration value
            is refused.
        UsageError: The override text is malformed.
    """
    config = _wait_for_busy_router(config, peers)
    reachable = reachable_config(config, peers)
    if reachable is None:
        raise _nobody(config)
    config = _without_impossible_sharing(reachable)
    settings = _settings(config)
    if own is not None:
        _listen_as_registered(settings, own)
        connect_to_running(settings, peers)
    remove_abandoned_segments()
    _log_refused_links(config)
    try:
        with translate_errors(f"open a session ({_quoted(config)})"), prepare_process(config.mode):
            if config.mode == "peer" and config.hold_rendezvous:
                return open_and_listen(settings, config.rendezvous, lambda: _open(settings, config))
            return _open(settings, config)
    except TransportError as error:
        if _NOBODY not in str(error):
            raise
        raise _nobody(config) from error


def places_of(config: SessionConfig) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return where a session would listen and connect, by everything that configures it.

    Raises:
        TransportError: A configuration value is refused.
        UsageError: The override text is malformed, or a protocol cannot use keys.
    """
    settings = _settings(config)
    listen, connect = (
        json.loads(settings.get_json(f"{way}/endpoints")) for way in ("listen", "connect")
    )
    return _of_mode(listen, config.mode), _of_mode(connect, config.mode)


def _of_mode(endpoints: Any, mode: str) -> tuple[str, ...]:
    """Return the endpoints of a mode; a configuration file may list them by mode."""
    found = endpoints.get(mode) if isinstance(endpoints, dict) else endpoints
    return tuple(found or ())


def _open(settings: zenoh.Config, config: SessionConfig) -> Any:
    if "id" not in overrides(config.override) and (zid := new_id(config)):
        settings.insert_json5("id", json.dumps(zid))
    return zenoh.open(settings)


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


def _without_impossible_sharing(config: SessionConfig) -> SessionConfig:
    """Turn shared memory off where it cannot be used, as in some containers."""
    if not config.shared_memory or not SEGMENTS.exists() or os.access(SEGMENTS, os.W_OK):
        return config
    _log.warning("no shared memory, for %s cannot be written to: samples go by links", SEGMENTS)
    return msgspec.structs.replace(config, shared_memory=0)


def _wait_for_busy_router(config: SessionConfig, peers: LocalPeers) -> SessionConfig:
    """Give a node more time to connect: when many start at once, some come last."""
    if config.mode != "client" or config.must_connect or not peers.is_any_running:
        return config
    return msgspec.structs.replace(config, open_timeout=max(config.open_timeout, _BUSY_TIMEOUT))


def _listen_as_registered(settings: zenoh.Config, own: LocalPeer) -> None:
    """Listen at the port that others read in the registration."""
    listen = json.loads(settings.get_json("listen/endpoints"))
    if own.endpoint and EPHEMERAL in listen:
        listen[listen.index(EPHEMERAL)] = own.endpoint
        settings.insert_json5("listen/endpoints", json.dumps(listen))


def _nobody(config: SessionConfig) -> TransportError:
    reasons = "".join(f"; no link to {reason}" for reason in _refused_links(config))
    return TransportError(
        f"nobody answers at {_quoted(config)} within {config.open_timeout:g} s{reasons}: start"
        " 'rosz core', a launch or a node there first, or name another place in ROSZ_RENDEZVOUS"
    )


def _quoted(config: SessionConfig) -> str:
    return ", ".join(f"'{endpoint}'" for endpoint in config.endpoints)


def _refused_links(config: SessionConfig) -> list[str]:
    """Return the endpoints that refuse links for want of the right keys, each with the reason.

    This connects to each endpoint, which takes seconds where nobody answers.
    """
    endpoints = list(dict.fromkeys((config.rendezvous, *config.connect)))
    if config.keys is not None:
        endpoints = [connect_endpoint(endpoint) for endpoint in endpoints]
    reasons = {endpoint: _why_refused(Endpoint(endpoint), config.keys) for endpoint in endpoints}
    return [f"'{endpoint}': {reason}" for endpoint, reason in reasons.items() if reason]


def _why_refused(endpoint: Endpoint, keys: KeyFolder | None) -> str:
    if endpoint.is_local or not endpoint.is_tcp:
        return ""
    from rosz.security.handshake import refusal, wants_keys

    if keys is not None:
        return refusal(endpoint, keys)
    return "it wants keys, and there are none here: set ROSZ_KEYS" if wants_keys(endpoint) else ""


def _log_refused_links(config: SessionConfig) -> None:
    """Log which links are refused, by this machine or by the other end, from now on.

    Zenoh decides which links this machine accepts, and its own log says which it refuses.
    """
    if config.keys is not None and config.listen:
        zenoh.init_log_from_env_or("zenoh_link_tls=warn")
    if config.connect and not config.must_connect and config.mode != "client":
        thread = threading.Thread(
            target=_log_refusals_of_others, args=(config,), name="rosz-refusals", daemon=True
        )
        thread.start()


def _log_refusals_of_others(config: SessionConfig) -> None:
    for reason in _refused_links(config):
        _log.warning("no link to %s", reason)
