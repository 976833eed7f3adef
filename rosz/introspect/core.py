"""What ``rosz core`` keeps up: a Zenoh router at the rendezvous, and a replica of the parameters.

Nothing needs it: nodes find each other and keep the parameters among themselves. It gives what a
process that stays can: a meeting point that does not move, links to other machines, and parameters
that outlive all nodes, on disk also itself.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from rosz.environment import Environment
from rosz.errors import TransportError
from rosz.introspect.interfaces import Latecomers
from rosz.session import Session, SessionConfig, keys_of, places_of
from rosz.wire import Endpoint

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

        listen = (*environment.listen, *listen)
        if environment.multicast and all(Endpoint(text).is_local for text in listen):
            listen += _everywhere(environment.rendezvous)
        self.domain = environment.domain
        self.store = store
        config = SessionConfig(
            mode="router",
            rendezvous=environment.rendezvous,
            listen=listen,
            connect=(*environment.connect, *connect),
            multicast=environment.multicast,
            keys=keys_of(environment),
            config_file=environment.zenoh_config,
            override=environment.zenoh_override,
        )
        self.endpoints, self.connect = places_of(config)
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
        self._latecomers = Latecomers(config)
        try:
            self.params: Replica = Replica(self.session, self.domain, keep=keep)
        except BaseException:
            self._latecomers.close()
            self.session.close()
            raise

    def close(self) -> None:
        """End both; again is no error."""
        self.params.close()
        self._latecomers.close()
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


def _everywhere(rendezvous: str) -> tuple[str, ...]:
    """Return where whoever finds this core by multicast can reach it."""
    place = Endpoint(rendezvous)
    if place.protocol != "tcp" or place.port is None:
        return ()
    return (str(Endpoint.of("tcp", "0.0.0.0", place.port)),)  # noqa: S104  # as multicast is


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
