"""A robot of a fleet: a second session, beyond the machine, and the crossing to it."""

from __future__ import annotations

import re
import socket
import time
from collections.abc import Callable, Sequence
from typing import Final

from rosz.bridges.fleet.crossing import Crossing, Side, foreign_id
from rosz.bridges.fleet.parameters import ParameterCrossing
from rosz.bridges.fleet.plan import FleetPlan
from rosz.bridges.fleet.relays import log
from rosz.environment import Environment
from rosz.errors import TransportError
from rosz.lifecycle import Closing, Lifecycle, Registration
from rosz.params.replica import Replica
from rosz.session import ExternalRouter, Session
from rosz.wire import Kind, Token, format_token, nodes_key, parse_token
from rosz.worker import Worker

_CORE: Final = "core_"
_ENCLAVE: Final = "/rosz_core"
"""The enclave of the node of a core, by which other cores recognise it."""
_TOKENS_SECONDS: Final = 1.0
_LEFT_SECONDS: Final = 12.0
"""Seconds after which the links of a core that is gone, but could not say so, have ended."""
_POLL_SECONDS: Final = 0.5


class Fleet(Closing):
    """Connects the network of this machine with other machines, until closed.

    The session beyond the machine dials and listens there; that of the machine does neither. If
    another robot with the same prefix appears, nothing crosses for the one that started later until
    the other has gone.

    Args:
        environment: The settings of the process.
        plan: The names that cross.
        inside: The session of the machine.
        replica: The parameters of the machine.
        listen: Endpoints to listen at, beyond the machine.
        connect: Endpoints to connect to, beyond the machine.

    Attributes:
        beyond: The session beyond the machine, with the endpoints that it dials.

    Raises:
        TransportError: Another robot has the prefix, or an endpoint is occupied or malformed.
        UsageError: Neither an endpoint to listen at nor one to connect to is given.
    """

    def __init__(
        self,
        environment: Environment,
        plan: FleetPlan,
        inside: Session,
        replica: Replica,
        listen: Sequence[str] = (),
        connect: Sequence[str] = (),
    ) -> None:
        self._lifecycle = Lifecycle(f"the crossing of '{plan.prefix}'", log=log)
        self._plan = plan
        self._replica = replica
        domain = environment.domain
        self._crossing: Lifecycle | None = None
        self._changes: Worker[Callable[[], object]] = Worker("rosz-fleet-claim", logger=log)
        try:
            self.beyond: ExternalRouter = self._lifecycle.keep(
                ExternalRouter(environment, listen, connect)
            )
            outside = self.beyond.session
            self.beyond.announce()
            now = time.time_ns() // 1_000_000
            zid = foreign_id(plan.prefix, outside.zid)
            host = re.sub(r"\W", "_", socket.gethostname(), flags=re.ASCII)
            self._claim = Token(
                domain, zid, now, now, Kind.NODE, plan.prefix, f"{_CORE}{host}", _ENCLAVE
            )
            self._others: dict[str, Token] = {}
            self._wait_for_name(outside)
            self._inside, self._outside = Side(inside, domain), Side(outside, domain)
            self._lifecycle.keep(self._inside.graph)
            self._lifecycle.keep(self._outside.graph)
            self._lifecycle.keep(Registration(self._end))
            self._lifecycle.keep(outside.token(format_token(self._claim)))
            self._parameters = self._lifecycle.keep(Replica(outside, domain))
            stop = self._outside.graph.listen(self._changed)
            self._lifecycle.keep(Registration(stop))
            self._changes.submit(self._decide)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End it; a second call has no effect."""
        self._lifecycle.close()
        self._changes.close()

    def _wait_for_name(self, outside: Session) -> None:
        """Wait until the tokens of an earlier core of this machine have gone."""
        deadline = time.monotonic() + _LEFT_SECONDS
        while True:
            tokens = outside.live_tokens(nodes_key(self._claim.domain), _TOKENS_SECONDS)
            others = list(filter(self._is_other, map(parse_token, tokens)))
            if not others:
                return
            if others[0].node != self._claim.node or time.monotonic() > deadline:
                raise TransportError(f"{_taken(others[0])}: start this one with another name")
            time.sleep(_POLL_SECONDS)

    def _is_other(self, token: Token) -> bool:
        own = self._claim
        same = token.enclave == _ENCLAVE and token.namespace == own.namespace
        return same and token.kind is Kind.NODE and token.zid != own.zid

    def _changed(self, token: Token, alive: bool) -> None:
        """Note another core of this prefix; on the thread of the graph."""
        if not self._is_other(token):
            return
        if alive:
            self._others[token.zid] = token
        else:
            self._others.pop(token.zid, None)
        self._changes.submit(self._decide)

    def _decide(self) -> None:
        """Begin or end the crossing; on the thread for changes."""
        own = self._claim.node_id, self._claim.zid
        older = [claim for claim in self._others.values() if (claim.node_id, claim.zid) < own]
        if self._lifecycle.closing:
            return
        if older and self._crossing is not None:
            log.error("%s: nothing crosses here until it has gone", _taken(older[0]))
            self._end()
        elif not older and self._crossing is None:
            crossing = Lifecycle(f"what crosses for '{self._plan.prefix}'", log=log)
            crossing.keep(Crossing(self._plan, self._inside, self._outside))
            crossing.keep(ParameterCrossing(self._plan, self._replica, self._parameters))
            self._crossing = crossing

    def _end(self) -> None:
        crossing, self._crossing = self._crossing, None
        if crossing is not None:
            crossing.close()


def _taken(other: Token) -> str:
    host = other.node.removeprefix(_CORE)
    return f"'{other.namespace}' is the name of another robot, '{host}', on this network"
