"""What ``rosz core`` keeps up: a Zenoh router at the rendezvous, and a replica of the parameters.

Nothing needs it: nodes find each other and keep the parameters among themselves. It gives what a
process that stays can: a meeting point that does not move, links to other machines, and parameters
that outlive all nodes, on disk also itself.
"""

from __future__ import annotations

import re
import socket
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from rosz.environment import Environment
from rosz.errors import TransportError
from rosz.session import Session, SessionConfig, keys_of, secured

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.params.replica import Replica

__all__ = ("Core",)

_REFUSED = re.compile(
    r"bound to (\S+?): \[.*address already in use|listener on (\S+) - unable to acquire lock",
    re.IGNORECASE,
)
"""What Zenoh says of a TCP endpoint, and of a unix socket, that somebody else holds."""


class Core:
    """A meeting point and a replica, until closed.

    Args:
        environment: Settings.
        listen: Further endpoints to listen on.
        connect: Further endpoints to connect to.
        store: File that keeps the parameters; none when not given.

    Attributes:
        endpoints: Where it listens.
        connect: Where it connects to.
        domain: The ROS domain of the parameters; nodes of all domains may meet here.
        store: The file.

    Raises:
        TransportError: An endpoint is occupied or malformed.
        StoreError: The file cannot be used.
    """

    def __init__(
        self,
        environment: Environment,
        listen: Sequence[str] = (),
        connect: Sequence[str] = (),
        store: Path | None = None,
    ) -> None:
        from rosz.params.replica import Replica

        self.endpoints = _listening(environment.rendezvous, (*environment.listen, *listen))
        self.connect = (*environment.connect, *connect)
        self.domain = environment.domain
        self.store = store
        keys = keys_of(environment)
        if keys is not None:
            self.endpoints = tuple(secured(endpoint) for endpoint in self.endpoints)
            self.connect = tuple(secured(endpoint) for endpoint in self.connect)
        config = SessionConfig(
            mode="router",
            rendezvous=self.endpoints[0],
            listen=self.endpoints[1:],
            connect=self.connect,
            multicast=environment.multicast,
            keys=keys,
            config_file=environment.zenoh_config,
            override=environment.zenoh_override,
        )
        keep = None
        if store is not None:
            from rosz.params.store import Store

            keep = Store(store)
        try:
            self.session = Session.open(config)
        except TransportError as error:
            if keep is not None:
                keep.close()
            raise _explained(error, self.endpoints) from error
        try:
            self.params: Replica = Replica(self.session, self.domain, keep=keep)
        except BaseException:
            self.session.close()
            raise

    def close(self) -> None:
        """End both; again is no error."""
        self.params.close()
        self.session.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def _listening(rendezvous: str, listen: Sequence[str]) -> tuple[str, ...]:
    """Return where to listen so that the rendezvous is held at all addresses of its name.

    ``tcp/0.0.0.0:7447`` holds ``127.0.0.1:7447`` already, and nobody can listen there twice; but
    where ``localhost`` is ``::1`` as well, that has to be held too, or the next node would.
    """
    protocol, _, place = rendezvous.partition("/")
    host, _, port = place.rpartition(":")
    every = {f"tcp/0.0.0.0:{port}": "127.", f"tcp/[::]:{port}": ""}
    held = [start for endpoint, start in every.items() if endpoint in listen]
    if protocol != "tcp" or not held:
        return tuple(dict.fromkeys((rendezvous, *listen)))
    try:
        found = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_STREAM)
    except (OSError, ValueError):  # Zenoh says better what is wrong with it
        return (rendezvous, *listen)
    addresses = dict.fromkeys(str(entry[4][0]) for entry in found)
    rest = [address for address in addresses if not address.startswith(tuple(held))]
    extra = [f"tcp/[{one}]:{port}" if ":" in one else f"tcp/{one}:{port}" for one in rest]
    return tuple(dict.fromkeys((*listen, *extra)))


def _explained(error: TransportError, endpoints: Sequence[str]) -> TransportError:
    match = _REFUSED.search(str(error))
    if match is None:
        return error
    place = match[1] or match[2]
    endpoint = next((one for one in endpoints if one.endswith(place)), place)
    return TransportError(
        f"'{endpoint}' is occupied: another core, or a node that the others meet at, holds it; all"
        " goes on as it is, or end that one and start the core then"
    )
