"""The settings of a session, and the Zenoh configuration made from them.

A *peer* listens on an ephemeral loopback port, tries to listen at the rendezvous as well, and keeps
trying to connect there. So the first session holds the rendezvous, and any other can take its
place. A *client* is linked to one router or peer. Neither listens beyond the machine unless told
to, and multicast is off unless asked for.
"""

from __future__ import annotations

import fcntl
import os
import socket
import struct
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import msgspec

from rosz.environment import Environment
from rosz.errors import UsageError
from rosz.session.probe import present_loopback
from rosz.wire import Endpoint, id_prefix

if TYPE_CHECKING:
    import zenoh

    from rosz.security import KeyFolder

_RETRY_MS = 200
"""Milliseconds between attempts to connect, on average: of many sessions that lost one router, not
all come back to it at the same moment."""
_LONGEST_RETRY_MS = 1000
"""The longest pause between attempts to reach another machine, which may be off for days."""
_FOREVER_MS = -1
_LEASE_MS = 60_000
"""Milliseconds for which others keep a silent link, so that a stopped process keeps its links.
"""
_LEASE_BEYOND_MS = 8_000
"""The same beyond the machine. A link that was cut is opened again after this time. TCP by itself
pauses longer after each attempt, so after a minute without connection it may wait another one."""
_ACCEPTING = {"accept_timeout": 60_000, "accept_pending": 1000, "max_sessions": 10_000}
"""The time limit in milliseconds for others to open a link, how many may do so at a time, and how
many links there may be. When many processes start at once, each takes long to open its link."""
_OPEN_MS = 10_000
"""Time limit in milliseconds for opening a link on the machine. Answers take long when many
processes start at once, and Zenoh tries each peer that it heard of only once."""
_OPEN_AT_ROUTER_MS = 60_000
"""The same for a client on the machine, which has nobody else to connect to: its router answers one
after the other, and would find those that had given up first."""
_OPEN_BEYOND_MS = 3_000
"""The time limit beyond the machine, where an attempt that the network lost is soon repeated."""
_LOCAL_QUEUE = {
    "size": {"data": 16},
    "congestion_control": {
        "drop": {"wait_before_drop": 50_000, "max_wait_before_drop_fragments": 150_000}
    },
}
"""The queue of a link of this machine. 16 batches of 64 kB are the most that Zenoh allows: some
thousand small messages that are published at once, or one image.

By default Zenoh drops a message that finds no room for a millisecond. On a busy machine, its own
threads may not run for longer, and a second image would be lost. The times are in microseconds: for
a message, and added for the rest of one that is larger than a batch. A subscriber that is stopped
delays a publisher by as much once; after that, Zenoh drops for its link without waiting until it
reads."""
_ROUTER_TIMEOUT = 10.0
"""Seconds that a node waits for its router, which may have been started just before it."""

_AUTOCONNECT = {"router": ["router"], "peer": ["router", "peer"], "client": ["router"]}
"""The sessions found by multicast that each mode connects to; Zenoh's routers connect to none."""
_ONE_DIALS = {"autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "greater-zid"}}}
"""Of two peers that hear of each other, the one with the greater id connects. If both did, their
links would disturb each other, and of eighty peers that start at once some would never be linked.
"""
_GREATEST = "ffff"
"""The end of the ids of sessions that stay on the machine, which Zenoh compares first. A session
that reaches beyond the machine may be unreachable for these, so it connects to them."""
_ID_DIGITS, _COUNTDOWN_DIGITS = 32, 12
_EPHEMERAL_EVERYWHERE = "tcp/0.0.0.0:0"
"""Endpoint at which a peer listens that others find by multicast."""

_INTERFACES = Path("/sys/class/net")
_SIOCGIFADDR = 0x8915
_LOOPBACK = "772"
"""The type of a loopback interface on Linux (ARPHRD_LOOPBACK)."""


class SessionConfig(msgspec.Struct, frozen=True, kw_only=True):
    """The settings of a session.

    Attributes:
        mode: ``peer``, ``client`` or ``router``.
        rendezvous: The endpoint where the sessions of this machine meet.
        connect: Further endpoints to connect to.
        listen: Further endpoints to listen at.
        hold_rendezvous: Whether a peer may listen at the rendezvous; short-lived ones should not.
        rendezvous_is_held: Whether another process holds the rendezvous of a router, which then
            connects to that process.
        beyond: Whether a router is linked to other machines only, never to sessions of this one.
        must_connect: Whether opening fails, after ``open_timeout``, when nobody answers.
        open_timeout: Seconds that a client, or a session that must connect, waits for an answer.
        multicast: Whether to look for others on the local network.
        keys: The keys that links beyond the machine need; none are needed when not given.
        shared_memory: The size in bytes from which payloads go by shared memory; 0 turns it off.
        config_file: A Zenoh configuration file to start from.
        override: Settings applied last, as ``path/to/key=json;…``.
    """

    mode: Literal["peer", "client", "router"] = "peer"
    rendezvous: str
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    hold_rendezvous: bool = True
    rendezvous_is_held: bool = False
    beyond: bool = False
    must_connect: bool = False
    open_timeout: float = 2.0
    multicast: bool = False
    shared_memory: int = 0
    keys: KeyFolder | None = None
    config_file: str = ""
    override: str = ""

    @property
    def endpoints(self) -> list[str]:
        """All endpoints of the session, each once."""
        return list(dict.fromkeys((self.rendezvous, *self.connect, *self.listen)))

    @property
    def reaches_beyond(self) -> bool:
        """Whether there may be links to other machines."""
        told = bool(self.config_file) or "endpoints" in self.override
        local = all(Endpoint(text).is_local for text in self.endpoints)
        return self.multicast or told or not local

    @classmethod
    def of(cls, env: Environment, **settings: Any) -> SessionConfig:
        """Return the settings that each session of this process has, with some more.

        Args:
            env: The settings of the process.
            settings: Attributes of the result.
        """
        shared: dict[str, Any] = {
            "rendezvous": env.rendezvous,
            "connect": env.connect,
            "multicast": env.multicast,
            "keys": keys_of(env),
            "config_file": env.zenoh_config,
            "override": env.zenoh_override,
        }
        return cls(**(shared | settings))

    @classmethod
    def node(cls, env: Environment) -> SessionConfig:
        """Return the settings of a node's session."""
        return cls.of(
            env,
            mode=env.mode,
            listen=() if env.mode == "client" else env.listen,
            shared_memory=env.shared_memory,
            open_timeout=_ROUTER_TIMEOUT,
        )

    @classmethod
    def command(cls, env: Environment, timeout: float = 1.0) -> SessionConfig:
        """Return the settings of a command's session, a client of whoever holds the rendezvous.

        Args:
            env: The settings of the process.
            timeout: Time limit for connecting, in seconds.
        """
        return cls.of(env, mode="client", must_connect=True, open_timeout=timeout)


def keys_of(env: Environment) -> KeyFolder | None:
    """Return the keys that this machine uses, if any.

    Raises:
        UsageError: The folder has no keys, or others may read them.
        YamlError: The access rules beside the keys cannot be read.
    """
    if env.keys is None:
        return None
    from rosz.security import KeyFolder

    return KeyFolder.find(env.keys, socket.gethostname())


def new_id(config: SessionConfig) -> str:
    """Return the id for a session, which tells that it is rosz's, and its host (`rosz.wire`).

    A later id of a peer is smaller. So existing sessions connect to new ones: one that is stopped
    does so when it resumes, and nobody waits for its answer meanwhile.
    """
    start = id_prefix(socket.gethostname())
    if config.mode != "peer" or config.reaches_beyond:
        return start + _random_digits(_ID_DIGITS - len(start))
    left = f"{-(time.time_ns() // 1_000_000) % 10**_COUNTDOWN_DIGITS:0{_COUNTDOWN_DIGITS}d}"
    countdown = "".join(left[at : at + 2] for at in range(_COUNTDOWN_DIGITS - 2, -1, -2))
    random = _random_digits(_ID_DIGITS - len(start) - _COUNTDOWN_DIGITS - len(_GREATEST))
    return start + random + countdown + _GREATEST


def _random_digits(count: int) -> str:
    return f"{int.from_bytes(os.urandom(count)) % 10**count:0{count}d}"


def zenoh_settings(config: SessionConfig) -> dict[str, Any]:
    """Return the Zenoh configuration, as nested dictionaries."""
    local, must_connect = not config.reaches_beyond, _must_connect(config)
    sharing = {"enabled": True, "message_size_threshold": config.shared_memory}
    return {
        "mode": config.mode,
        "connect": _connecting(config, local=local),
        "listen": {
            "endpoints": _listen(config),
            "exit_on_failure": config.mode == "router",
            "timeout_ms": 0,
        },
        "open": {"return_conditions": dict.fromkeys(("connect_scouted", "declares"), must_connect)},
        "scouting": {
            "multicast": {"enabled": config.multicast, "autoconnect": _AUTOCONNECT},
            "gossip": {"enabled": True} | (_ONE_DIALS if local else {}),
        },
        "timestamping": {"enabled": True},
        "transport": {
            "shared_memory": {"enabled": True, "transport_optimization": sharing}
            if config.shared_memory
            else {"enabled": False},
            "unicast": _ACCEPTING | {"open_timeout": _open_timeout_ms(config.mode, local=local)},
            "link": {
                "tx": {
                    "lease": _LEASE_MS if local else _LEASE_BEYOND_MS,
                    "keep_alive": 4,
                    "queue": _LOCAL_QUEUE if local else {},
                }
            },
        },
    }


def _must_connect(config: SessionConfig) -> bool:
    return config.must_connect or config.mode == "client"


def _connecting(config: SessionConfig, *, local: bool) -> dict[str, Any]:
    """Return the settings of connecting to others."""
    endpoints = [*config.connect]
    if (config.mode != "router" or config.rendezvous_is_held) and not config.beyond:
        endpoints.insert(0, config.rendezvous)
    if config.keys is not None:
        endpoints = [connect_endpoint(endpoint) for endpoint in endpoints]
    # Zenoh tries just once with 0: enough for a rendezvous that the session may hold itself.
    timeout_ms = _FOREVER_MS if config.connect or config.rendezvous_is_held else 0
    if must_connect := _must_connect(config):
        timeout_ms = int(config.open_timeout * 1000)
    retry = _RETRY_MS
    if config.mode != "router":
        retry = _RETRY_MS // 2 + int.from_bytes(os.urandom(2)) % _RETRY_MS
    return {
        "endpoints": [*map(_present, endpoints)],
        "exit_on_failure": must_connect,
        "timeout_ms": timeout_ms,
        "retry": {
            "period_init_ms": retry,
            "period_max_ms": retry if local else _LONGEST_RETRY_MS,
            "period_increase_factor": 1.5,
        },
    }


def read_setting(settings: zenoh.Config, path: str) -> Any:
    """Return a value of a Zenoh configuration."""
    return msgspec.json.decode(settings.get_json(path))


def insert_setting(settings: zenoh.Config, path: str, value: object) -> None:
    """Replace a value of a Zenoh configuration."""
    settings.insert_json5(path, msgspec.json.encode(value).decode())


def _open_timeout_ms(mode: str, *, local: bool) -> int:
    if not local:
        return _OPEN_BEYOND_MS
    return _OPEN_AT_ROUTER_MS if mode == "client" else _OPEN_MS


def _listen(config: SessionConfig) -> list[str]:
    keys = config.keys is not None
    places = config.listen
    if config.beyond:
        places = tuple(_share_port(config))
    elif config.rendezvous_is_held:
        places = (ephemeral(), *_share_port(config))
    elif config.mode == "router" or (config.mode == "peer" and config.hold_rendezvous):
        places = listen_endpoints(config.rendezvous, places, keys=keys)
    if config.mode == "peer":
        places = (*places, _EPHEMERAL_EVERYWHERE if config.multicast else ephemeral())
    return [_present(str(Endpoint(place).secured()) if keys else place) for place in places]


def _present(text: str) -> str:
    """Return an endpoint, at ``::1`` if it is one of an IPv4 loopback that is not there."""
    host = Endpoint(text).host
    present = present_loopback(host)
    return text if present == host else text.replace(f"/{host}:", f"/[{present}]:", 1)


def ephemeral() -> str:
    """Return the endpoint at which a peer listens for sessions of its machine, on any free port."""
    return _present("tcp/127.0.0.1:0")


def overrides(text: str) -> Mapping[str, str]:
    """Parse ``ZENOH_CONFIG_OVERRIDE`` into JSON texts by path.

    Raises:
        UsageError: A part is not of the form ``path=json``.
    """
    settings: dict[str, str] = {}
    for part in filter(None, (piece.strip() for piece in text.split(";"))):
        key, separator, value = part.partition("=")
        if not separator:
            raise UsageError(f"ZENOH_CONFIG_OVERRIDE has '{part}'; expected 'path/to/key=json'")
        settings[key.strip()] = value.strip()
    return settings


def connect_endpoint(text: str) -> str:
    """Return the endpoint to connect to where links beyond this machine need keys.

    A machine that is told to connect to itself, as when several machines share one setting, uses
    the loopback.

    Args:
        text: The endpoint as it was configured.

    Raises:
        UsageError: The protocol cannot use keys.
    """
    endpoint = Endpoint(text).secured()
    if endpoint.protocol == "tls" and endpoint.port is not None and is_own(endpoint.host):
        return str(Endpoint.of("tcp", "localhost", endpoint.port))
    return str(endpoint)


def listen_endpoints(
    rendezvous: str, listen: Sequence[str], *, keys: bool = False
) -> tuple[str, ...]:
    """Return the endpoints that hold the rendezvous at all addresses of its host name.

    ``tcp/0.0.0.0:7447`` includes ``127.0.0.1:7447``, and a second listener there would fail. Where
    ``localhost`` is also ``::1``, that address has to be held too, or the next node would hold it.
    With keys, one port serves this machine without TLS and other machines with TLS. Linux lets both
    listeners share the port when each is bound to its network interfaces.

    Args:
        rendezvous: The endpoint where the sessions of this machine meet.
        listen: Further endpoints.
        keys: Whether links beyond the machine need keys.

    Raises:
        UsageError: A protocol cannot use keys.
    """
    meeting, others = Endpoint(rendezvous), [Endpoint(text) for text in listen]
    if keys:
        meeting, others = meeting.secured(), [endpoint.secured() for endpoint in others]
    wide = [
        endpoint
        for endpoint in others
        if endpoint.is_tcp and endpoint.is_any_address and endpoint.port == meeting.port
        if not endpoint.configuration
    ]
    local: list[Endpoint] = []
    if wide and meeting.protocol == "tcp" and meeting.port is not None:
        addresses = addresses_of(meeting.host)
        local = [Endpoint.of("tcp", address, meeting.port) for address in addresses]
    if not local:
        places = [meeting, *others]
    elif any(endpoint.protocol == "tls" for endpoint in wide) and sys.platform == "linux":
        places = _on_interfaces(local, others, wide)
    else:
        places = [*others, *_not_among(local, {endpoint.host for endpoint in wide})]
    return tuple(dict.fromkeys(map(str, places)))


def _share_port(config: SessionConfig) -> Iterator[str]:
    """Yield the endpoints of a router while another process holds its rendezvous.

    An endpoint of all addresses would include the rendezvous, so each address gets its own.
    """
    meeting = Endpoint(config.rendezvous)
    for endpoint in map(Endpoint, config.listen):
        port = endpoint.port
        if port is None or not endpoint.is_any_address or port != meeting.port:
            yield str(endpoint)
            continue
        for _, name in socket.if_nameindex():
            address = _address_of(name) if _is_beyond(name) else ""
            if address:
                yield str(Endpoint.of(endpoint.protocol, address, port).on_interface(name))


def loopback_interfaces() -> list[str]:
    """Return the names of the network interfaces whose traffic stays on this machine."""
    names = [name for _, name in socket.if_nameindex()]
    if not _INTERFACES.is_dir():
        return [name for name in names if name.startswith("lo0")]
    return [name for name in names if _interface_type(name) == _LOOPBACK]


def _not_among(local: list[Endpoint], hosts: set[str]) -> list[Endpoint]:
    """Return the endpoints of this machine that listening at some hosts does not include."""
    if "::" in hosts:  # on Linux, it serves IPv4 as well
        return []
    all_v4 = "0.0.0.0" in hosts  # noqa: S104
    return [place for place in local if not (all_v4 and place.host.startswith("127."))]


def _on_interfaces(
    local: list[Endpoint], others: list[Endpoint], wide: list[Endpoint]
) -> list[Endpoint]:
    """Return endpoints of one port, each at its interfaces; `wide` are those for all addresses."""
    beyond = [name for _, name in socket.if_nameindex() if _is_beyond(name)]
    places: list[Endpoint] = []
    for endpoint in others:
        places += map(endpoint.on_interface, beyond) if endpoint in wide else [endpoint]
    names = loopback_interfaces()
    return places + [endpoint.on_interface(name) for endpoint in local for name in names]


def _is_beyond(name: str) -> bool:
    # An interface that is part of a bridge has no addresses of its own.
    return _interface_type(name) != _LOOPBACK and not (_INTERFACES / name / "master").exists()


def _address_of(name: str) -> str:
    """Return the IPv4 address of a network interface (netdevice(7)); empty if it has none."""
    request = struct.pack("256s", name.encode()[:15])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            return socket.inet_ntoa(fcntl.ioctl(probe, _SIOCGIFADDR, request)[20:24])
        except OSError:
            return ""


def _interface_type(name: str) -> str:
    try:
        return (_INTERFACES / name / "type").read_text().strip()
    except OSError:  # the interface is gone
        return ""


def addresses_of(host: str) -> list[str]:
    """Return the addresses of a host name or address; none if it is not known."""
    try:
        addresses = socket.getaddrinfo(present_loopback(host), None, type=socket.SOCK_STREAM)
    except (OSError, ValueError):  # Zenoh's own error gives the reason
        return []
    return list(dict.fromkeys(str(entry[4][0]) for entry in addresses))


def is_own(host: str) -> bool:
    """Tell whether all addresses of a host name belong to this machine."""
    addresses = addresses_of(host)
    for address in addresses:
        family = socket.AF_INET6 if ":" in address else socket.AF_INET
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.bind((address, 0))
        except OSError:
            return False
    return bool(addresses)
