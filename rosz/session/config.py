"""How a session is opened: rosz's settings as a Zenoh configuration.

A *peer* listens on an ephemeral loopback port, tries to hold the rendezvous as well, and keeps
trying to connect there, so whoever comes first is the meeting point and anyone can follow it. A
*client* hangs on one router or peer. Neither listens beyond the machine unless told to, and
multicast is off unless asked for.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from rosz.environment import Environment
from rosz.errors import UsageError
from rosz.session.endpoints import connect_endpoint, listen_endpoints, loopback_interfaces
from rosz.wire import Endpoint

if TYPE_CHECKING:
    from rosz.security import KeyFolder

__all__ = ("EPHEMERAL", "SessionConfig", "keys_of", "new_id", "zenoh_settings")

_RETRY_MS = 200
_LEASE_MS = 60_000
"""How long others wait for a word: a process that was stopped for a while is not given up."""
_LEASE_BEYOND_MS = 8_000
"""The same beyond the machine. A link that was cut is opened anew when this is over; TCP by itself
tries again ever more rarely, so that after a minute's cut it may rest for another one."""
_LOCAL_LINKS = {"open_timeout": 10_000, "accept_timeout": 60_000, "accept_pending": 1000}
"""How long either end tries to open a link, and how many may try: where many start at once answers
take long, and Zenoh tries those that it heard of only once."""
_OPEN_BEYOND_MS = 3_000
"""The same beyond the machine, where what the network swallowed gives way to the next attempt."""
_ROUTER_BY = 10.0
"""Seconds that a node waits for its router, which may have been started just before it."""

_BATCHES = 8
"""Batches of 64 kB that a link queues for data; of Zenoh's two, a megabyte soon waits for either.

Measured: with eight of them two fifths more images of 1 MB come through, and as many in each run.
"""

EPHEMERAL = "tcp/127.0.0.1:0"
"""Where a peer listens for those of its machine: at any port."""
_AUTOCONNECT = {"router": ["router"], "peer": ["router", "peer"], "client": ["router"]}
"""To whom each connects that it finds by multicast; Zenoh's own routers connect to nobody."""
_ONE_DIALS = {"autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "greater-zid"}}}
"""Of two that hear of each other, that with the greater id connects. If both do, their links get in
each other's way, and of eighty that start at once some never are linked."""
_GREATEST = b"\xff\xff"
"""How ids end of sessions that stay on the machine: who reaches beyond may not reach them, so it is
they who connect. Zenoh compares ends first."""
_COUNTDOWN_BYTES, _RANDOM_BYTES = 6, 8
_EPHEMERAL_EVERYWHERE = "tcp/0.0.0.0:0"
"""Who looks for others by multicast has to be reached by those it finds."""


class SessionConfig(msgspec.Struct, frozen=True, kw_only=True):
    """What a session is to be.

    Attributes:
        mode: ``peer``, ``client`` or ``router``.
        rendezvous: Endpoint where the sessions of this machine meet.
        connect: Further endpoints to connect to.
        listen: Further endpoints to listen on.
        hold_rendezvous: Whether a peer may become the meeting point; short-lived ones should not.
        must_connect: Whether opening fails, after ``open_timeout``, when nobody answers.
        open_timeout: Seconds that a client, or who must connect, waits for somebody to be there.
        multicast: Whether to look for others on the local network.
        keys: What links beyond the machine need; anybody may link to it when not given.
        shared_memory: Payloads of at least so many bytes go by shared memory; 0 is off.
        config_file: Zenoh configuration file to start from.
        override: ``path/to/key=json;…`` applied last.
    """

    mode: Literal["peer", "client", "router"] = "peer"
    rendezvous: str
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    hold_rendezvous: bool = True
    must_connect: bool = False
    open_timeout: float = 2.0
    multicast: bool = False
    shared_memory: int = 0
    keys: KeyFolder | None = None
    config_file: str = ""
    override: str = ""

    @property
    def endpoints(self) -> list[str]:
        """All endpoints that opening a session involves, each once."""
        return list(dict.fromkeys((self.rendezvous, *self.connect, *self.listen)))

    @property
    def reaches_beyond(self) -> bool:
        """Whether there may be links to other machines."""
        told = bool(self.config_file) or "endpoints" in self.override
        local = all(Endpoint(text).is_local for text in self.endpoints)
        return self.multicast or told or not local

    @classmethod
    def node(cls, env: Environment) -> SessionConfig:
        """Return what a node's session is by the environment."""
        client = env.mode == "client"
        return cls(
            mode=env.mode,
            rendezvous=env.rendezvous,
            connect=env.connect,
            listen=() if client else env.listen,
            multicast=env.multicast,
            shared_memory=env.shared_memory,
            keys=keys_of(env),
            open_timeout=_ROUTER_BY,
            config_file=env.zenoh_config,
            override=env.zenoh_override,
        )

    @classmethod
    def command(cls, env: Environment, timeout: float = 1.0) -> SessionConfig:
        """Return what a command's session is: a client of whoever is at the rendezvous.

        Args:
            env: The settings of the process.
            timeout: Seconds to wait for somebody to be there.
        """
        return cls(
            mode="client",
            rendezvous=env.rendezvous,
            connect=env.connect,
            must_connect=True,
            open_timeout=timeout,
            multicast=env.multicast,
            keys=keys_of(env),
            config_file=env.zenoh_config,
            override=env.zenoh_override,
        )


def keys_of(env: Environment) -> KeyFolder | None:
    """Return the keys of this machine, if it is to use any.

    Raises:
        UsageError: There are none where they should be, or others may read them.
        YamlError: The rules beside them are no rules.
    """
    if env.keys is None:
        return None
    from rosz.security import KeyFolder

    return KeyFolder.find(env.keys, socket.gethostname())


def new_id(config: SessionConfig) -> str:
    """Return an id for a session, if it matters how that compares; empty for any.

    It is smaller the later it is made. So who is there connects to who comes: one that is stopped
    does so when it goes on, and nobody waits for its answer meanwhile.
    """
    if config.mode != "peer" or config.reaches_beyond:
        return ""
    left = (1 << 8 * _COUNTDOWN_BYTES) - time.time_ns() // 1_000_000
    some = bytearray(os.urandom(_RANDOM_BYTES))
    some[0] |= 0x10  # no id begins with 0
    return (some + left.to_bytes(_COUNTDOWN_BYTES, "little") + _GREATEST).hex()


def zenoh_settings(config: SessionConfig) -> dict[str, Any]:
    """Return the Zenoh configuration, as nested dictionaries."""
    connect = [*config.connect]
    if config.mode != "router":
        connect.insert(0, config.rendezvous)
    if config.keys is not None:
        connect = [connect_endpoint(endpoint) for endpoint in connect]
    listen = _listen(config)
    local = not config.reaches_beyond
    must_listen = config.mode == "router"
    must_connect = config.must_connect or config.mode == "client"
    return {
        "mode": config.mode,
        "connect": {
            "endpoints": connect,
            "exit_on_failure": must_connect,
            "timeout_ms": int(config.open_timeout * 1000) if must_connect else 0,
            "retry": {
                "period_init_ms": _RETRY_MS,
                "period_max_ms": _RETRY_MS,
                "period_increase_factor": 1,
            },
        },
        "listen": {"endpoints": listen, "exit_on_failure": must_listen, "timeout_ms": 0},
        "open": {
            "return_conditions": {
                "connect_scouted": must_connect,
                "declares": must_connect,
            }
        },
        "scouting": {
            "multicast": {"enabled": config.multicast, "autoconnect": _AUTOCONNECT},
            "gossip": {"enabled": True} | (_ONE_DIALS if local else {}),
        },
        "timestamping": {"enabled": True},
        "transport": {
            "shared_memory": _shared_memory(config.shared_memory),
            "unicast": _LOCAL_LINKS if local else {"open_timeout": _OPEN_BEYOND_MS},
            "link": {"tx": {"lease": _LEASE_MS if local else _LEASE_BEYOND_MS, "keep_alive": 4}},
        },
    }


def _listen(config: SessionConfig) -> list[str]:
    keys = config.keys is not None
    places = config.listen
    if config.mode == "router" or (config.mode == "peer" and config.hold_rendezvous):
        places = listen_endpoints(config.rendezvous, places, keys=keys)
    if config.mode == "peer":
        places = (*places, _EPHEMERAL_EVERYWHERE if config.multicast else EPHEMERAL)
    return [str(Endpoint(place).secured()) for place in places] if keys else [*places]


def key_settings(config: SessionConfig) -> dict[str, Any]:
    """Return what keys add to a Zenoh configuration, by path in it."""
    if config.keys is None:
        return {}
    from rosz.security import access_control

    return {
        "transport/link/tls": _tls(config.keys),
        "access_control": access_control(config.keys.rules, loopback_interfaces()),
    }


def overrides(text: str) -> Mapping[str, str]:
    """Read ``ZENOH_CONFIG_OVERRIDE``: key path to JSON text.

    Raises:
        UsageError: A part is not ``path=json``.
    """
    found: dict[str, str] = {}
    for part in filter(None, (piece.strip() for piece in text.split(";"))):
        key, separator, value = part.partition("=")
        if not separator:
            raise UsageError(f"ZENOH_CONFIG_OVERRIDE has '{part}'; expected 'path/to/key=json'")
        found[key.strip()] = value.strip()
    return found


def _tls(keys: KeyFolder) -> dict[str, Any]:
    return {
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
        "root_ca_certificate": str(keys.authority),
        **{f"{end}_certificate": str(keys.certificate) for end in ("listen", "connect")},
        **{f"{end}_private_key": str(keys.key) for end in ("listen", "connect")},
    }


def _shared_memory(threshold: int) -> dict[str, Any]:
    if not threshold:
        return {"enabled": False}
    return {
        "enabled": True,
        "transport_optimization": {"enabled": True, "message_size_threshold": threshold},
    }
