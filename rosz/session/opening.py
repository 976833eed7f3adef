"""Opening a session: its Zenoh configuration, and the errors when it does not open."""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import zenoh

from rosz.errors import TransportError
from rosz.interrupts import raise_deferred
from rosz.session.config import (
    SessionConfig,
    connect_endpoint,
    ephemeral,
    insert_setting,
    loopback_interfaces,
    new_id,
    overrides,
    read_setting,
    zenoh_settings,
)
from rosz.session.declared import translate_errors
from rosz.session.local_peers import LocalPeer, LocalPeers, direct_endpoint, is_private
from rosz.session.probe import SILENT, first_listening, is_listening, why_refused
from rosz.session.zenoh_workarounds import (
    SEGMENTS,
    connect_to_running,
    open_and_listen,
    prepare_process,
    reachable_config,
    remove_abandoned_segments,
    remove_abandoned_sockets,
    search_seconds,
)
from rosz.wire import Endpoint
from rosz.worker import start_thread

if TYPE_CHECKING:
    from rosz.security import KeyFolder

_NOBODY = "Unable to connect to any of"
_NO_SEGMENT = "Unable to create POSIX shm segment"
_BUSY_TIMEOUT = 60.0
"""Time limit in seconds of each attempt of a node at a busy router. To give up earlier would have
the router begin anew."""
_SLOW_SECONDS = 8.0
"""Seconds after which a node logs the reason of its wait."""
_NAMED_SECONDS = 1.0
"""Seconds after which a command says what it waits for; to find out why takes another one."""
_ATTEMPT_SECONDS = 2.0
"""Time limit of each attempt of a node that waits for other machines."""
_LOOK_SECONDS = 0.5
"""Seconds after which a node that waits for other machines looks for Ctrl-C."""

_BUSY = f"it is busy: it accepts connections, and has opened no link for {_SLOW_SECONDS:g} s"

_log = logging.getLogger("rosz.session")


class _Unanswered(TransportError):
    """Nobody answers at any endpoint."""


def open_raw(config: SessionConfig, peers: LocalPeers, own: LocalPeer | None = None) -> Any:
    """Open a session of Zenoh.

    A node that was told to connect to other machines waits until one of them answers, and one whose
    router is busy until that does; a command, which may not hold the rendezvous, does not.

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
    waits = config.mode == "client" and config.hold_rendezvous and not config.must_connect
    if not waits and config.mode == "client" and config.connect:
        reasons = partial(_reasons, config)
        with _reporting(" or ".join(config.connect), _NAMED_SECONDS, reasons):
            return _open_once(config, peers, own)
    if not waits:
        return _open_once(config, peers, own)
    if not config.connect:
        return _open_at_router(config, peers, own)
    config = msgspec.structs.replace(config, open_timeout=_ATTEMPT_SECONDS)
    others = " or ".join(config.connect)
    waited = False
    while True:
        try:
            raw = _open_once(config, peers, own)
        except _Unanswered:
            if not waited:
                _log.warning("waiting for %s: %s", others, _reasons(config))
            waited = True
            raise_deferred()
            while not first_listening(config.endpoints, _LOOK_SECONDS):
                raise_deferred()
            peers = LocalPeers.read(config.rendezvous)
            continue
        if waited:
            _log.warning("connected to %s", others)
        return raw


def _reasons(config: SessionConfig) -> str:
    return "; ".join(_refused_links(config)) or "nobody answers"


@contextmanager
def _reporting(place: str, seconds: float, reason: Callable[[], str]) -> Iterator[threading.Event]:
    """Log the reason if a block takes longer; the block gets an event that is set then."""
    over = threading.Event()
    reported = threading.Event()

    def report() -> None:
        if not over.wait(seconds):
            text = reason()
            if not over.is_set():
                reported.set()
                _log.warning("waiting for %s: %s", place, text)

    start_thread(threading.Thread(target=report, name="rosz-waiting", daemon=True))
    try:
        yield reported
    finally:
        over.set()


def _open_at_router(config: SessionConfig, peers: LocalPeers, own: LocalPeer | None) -> Any:
    """Open the session of a node whose router may be busy, as when many nodes start at once."""
    place = config.rendezvous
    with _reporting(place, _SLOW_SECONDS, lambda: why_refused(place) or _BUSY) as reported:
        while True:
            try:
                raw = _open_once(config, peers, own)
            except _Unanswered:
                raise_deferred()
                peers = LocalPeers.read(config.rendezvous)
                if not (peers.is_any_running and is_listening(config.rendezvous)):
                    raise
                continue
            if reported.is_set():
                _log.warning("connected to %s", config.rendezvous)
            return raw


def _open_once(config: SessionConfig, peers: LocalPeers, own: LocalPeer | None) -> Any:
    if config.mode == "client" and not config.must_connect and peers.is_any_running:
        longer = max(config.open_timeout, _BUSY_TIMEOUT)
        config = msgspec.structs.replace(config, open_timeout=longer)
    reachable = reachable_config(config, peers)
    if reachable is None:
        raise _nobody(config, search_seconds(config, peers))
    config = reachable
    if config.shared_memory and SEGMENTS.exists() and not os.access(SEGMENTS, os.W_OK):
        _log.warning("no shared memory: %s cannot be written to; samples go over links", SEGMENTS)
        config = msgspec.structs.replace(config, shared_memory=0)
    settings = _settings(config)
    _listen_directly(settings, config.rendezvous, own)
    if own is not None:
        connect_to_running(settings, peers, config)
    remove_abandoned_segments()
    if config.keys is not None and config.listen:
        # Zenoh decides which links this machine accepts, and its log says which it refuses.
        zenoh.init_log_from_env_or("zenoh_link_tls=warn")
    try:
        return _open_and_listen(settings, config)
    except TransportError as error:
        if config.shared_memory and _NO_SEGMENT in str(error):
            _log.warning("no shared memory: %s is full; samples go over links", SEGMENTS)
            return _open_once(msgspec.structs.replace(config, shared_memory=0), peers, own)
        if _NOBODY not in str(error):
            raise
        raise _nobody(config, config.open_timeout) from error


def _listen_directly(settings: zenoh.Config, rendezvous: str, own: LocalPeer | None) -> None:
    """Listen for direct links where the session is registered, or at a private socket."""
    endpoint = Endpoint(rendezvous)
    if endpoint.is_unix and not (folder := Path(endpoint.address).parent).is_dir():
        raise TransportError(f"nobody can meet at '{endpoint}': there is no folder '{folder}'")
    if is_private(rendezvous):
        remove_abandoned_sockets(rendezvous)
    listen = read_setting(settings, "listen/endpoints")
    if ephemeral() in listen and (direct := direct_endpoint(rendezvous, own)):
        listen[listen.index(ephemeral())] = direct
        insert_setting(settings, "listen/endpoints", listen)


def places_of(config: SessionConfig) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the endpoints to listen at and to connect to, from the whole configuration.

    Raises:
        TransportError: A configuration value is refused.
        UsageError: The override text is malformed, or a protocol cannot use keys.
    """
    settings = _settings(config)

    def places(way: str) -> tuple[str, ...]:
        endpoints = read_setting(settings, f"{way}/endpoints")
        # A configuration file may list them by mode.
        return tuple(
            (endpoints.get(config.mode) if isinstance(endpoints, dict) else endpoints) or ()
        )

    return places("listen"), places("connect")


def outlasted_silence(config: SessionConfig) -> float:
    """Return for how many seconds a session may send nothing until others give up its links.

    Raises:
        TransportError: A configuration value is refused.
        UsageError: The override text is malformed, or a protocol cannot use keys.
    """
    sending = read_setting(_settings(config), "transport/link/tx")
    # The last message may be as old as the period in which an idle link sends one.
    return float(sending["lease"] * (1 - 1 / sending["keep_alive"]) / 1000)


def settings_text(config: SessionConfig) -> str:
    """Return the whole configuration as JSON, without the values that are left to Zenoh.

    Raises:
        TransportError: A configuration value is refused.
        UsageError: The override text is malformed, or a protocol cannot use keys.
    """
    import json

    return json.dumps(_given(json.loads(str(_settings(config)))), indent=2)


def _given(value: Any) -> Any:
    """Return a value of JSON without the members that are null."""
    if isinstance(value, dict):
        return {key: _given(item) for key, item in value.items() if item is not None}
    return value


def _open_and_listen(settings: zenoh.Config, config: SessionConfig) -> Any:
    with translate_errors(f"open a session ({_quoted(config)})"), prepare_process(config.mode):
        if config.mode == "peer" and config.hold_rendezvous:
            return open_and_listen(settings, config.rendezvous, lambda: _open(settings, config))
        return _open(settings, config)


def _open(settings: zenoh.Config, config: SessionConfig) -> Any:
    if settings.get_json("id") == "null":
        insert_setting(settings, "id", new_id(config))
    return zenoh.open(settings)


def _settings(config: SessionConfig) -> zenoh.Config:
    with translate_errors("read the Zenoh configuration"):
        if config.config_file:
            settings = zenoh.Config.from_file(config.config_file)
        else:
            text = msgspec.json.encode(zenoh_settings(config)).decode()
            settings = zenoh.Config.from_json5(text)
        if config.keys is not None:
            from rosz.security import access_control

            rules = access_control(config.keys.rules, loopback_interfaces())
            insert_setting(settings, "access_control", rules)
            insert_setting(settings, "transport/link/tls", _tls(config.keys))
        for path, text in overrides(config.override).items():
            settings.insert_json5(path, text)
    return settings


def _tls(keys: KeyFolder) -> dict[str, Any]:
    certificate, key = str(keys.certificate), str(keys.key)
    return {
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
        "root_ca_certificate": str(keys.authority),
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
    }


def _nobody(config: SessionConfig, seconds: float) -> _Unanswered:
    reasons = "".join(f"; no link to {reason}" for reason in _refused_links(config))
    return _Unanswered(
        f"nobody answers at {_quoted(config)} within {seconds:g} s{reasons}: start"
        " 'rosz core', a launch or a node there first, or name another place in ROSZ_RENDEZVOUS"
    )


def _quoted(config: SessionConfig) -> str:
    return ", ".join(f"'{endpoint}'" for endpoint in config.endpoints)


def why_refused_by_keys(endpoint: Endpoint, keys: KeyFolder | None) -> str:
    """Return why an endpoint refuses links because of missing or wrong keys; empty if it does not.

    This connects to the endpoint, which takes seconds where nobody answers.

    Args:
        endpoint: The endpoint as it is dialled.
        keys: The keys of this machine, if it has any.
    """
    if endpoint.is_local or not endpoint.is_tcp:
        return ""
    from rosz.security import refusal, wants_keys

    if keys is not None:
        return refusal(endpoint, keys)
    if wants_keys(endpoint):
        return "it requires keys, and this machine has none: set ROSZ_KEYS"
    return ""


def _refused_links(config: SessionConfig) -> Iterator[str]:
    """Yield the endpoints that nobody answers at, with the reason.

    Of a rendezvous where nobody listens nothing is said, as that is how the first process finds it.
    """
    for text in dict.fromkeys((config.rendezvous, *config.connect)):
        endpoint = Endpoint(text if config.keys is None else connect_endpoint(text))
        reason = why_refused(str(endpoint))
        if not reason:
            reason = why_refused_by_keys(endpoint, config.keys) or SILENT
        elif text not in config.connect:
            continue
        yield f"'{endpoint}': {reason}"
