"""The namespace that ``rosz core --as`` gives this machine beyond it."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rosz.errors import UsageError

if TYPE_CHECKING:
    from rosz.bridges.fleet import FleetPlan
    from rosz.environment import Environment
    from rosz.params.replica import Replica
    from rosz.session import Router

Places = tuple[list[str], list[str]]
"""The endpoints to listen at, and those to connect to."""

_FILE = "fleet.yaml"


def read_fleet(
    environment: Environment,
    namespace: str | None,
    share: str | None,
    file: str | None,
    *,
    frames: bool,
) -> FleetPlan | None:
    """Return the plan of the names that cross; ``None`` if this machine keeps its names.

    The options replace those of the file. Without a file, there may be one beside the keys.
    An option that is empty, as from a variable that is not set, is an error.

    Raises:
        UsageError: An option has no meaning, or a file cannot be read.
        YamlError: The file says something else.
    """
    path = _beside_keys(environment) if file is None else Path(file)
    if namespace is None and share is None and path is None and not frames:
        return None
    from rosz.bridges.fleet import FleetPlan, check_prefix, read_plan, read_share
    from rosz.security import read_trusted

    plan = FleetPlan() if path is None else read_plan(read_trusted(path), str(path))
    if namespace is not None:
        plan = msgspec.structs.replace(plan, prefix=check_prefix(namespace, "--as"))
    if share is not None:
        plan = msgspec.structs.replace(plan, share=read_share(share))
    if not plan.prefix:
        line = f", or a line 'as: /robot1' in '{path}'" if path else ""
        raise UsageError(f"no namespace for this machine: expected --as /robot1{line}")
    return msgspec.structs.replace(plan, frames=plan.frames or frames)


def on_machine(
    plan: FleetPlan | None, environment: Environment, places: Places
) -> tuple[Environment, list[str], list[str]]:
    """Return the arguments of the router for the nodes of this machine.

    Raises:
        UsageError: There is a namespace, but no way to others.
    """
    if plan is None:
        return environment, *places
    if not (environment.listen or environment.connect or environment.multicast or any(places)):
        raise UsageError(
            f"nobody would see '{plan.prefix}': say where others are with --connect, such as"
            " tcp/laptop:7447, or --listen, such as tcp/0.0.0.0:7447"
        )
    return msgspec.structs.replace(environment, listen=(), connect=(), multicast=False), [], []


def open_fleet(
    plan: FleetPlan | None,
    environment: Environment,
    router: Router,
    replica: Replica,
    places: Places,
    stack: ExitStack,
) -> list[str]:
    """Start the exchange with others, and return lines that describe it.

    Raises:
        TransportError: Another robot has the namespace, or an endpoint is occupied or malformed.
    """
    if plan is None:
        return []
    from rosz.bridges.fleet import Fleet

    listen, connect = (*environment.listen, *places[0]), (*environment.connect, *places[1])
    fleet = stack.enter_context(
        Fleet(environment, plan, router.session, replica, listen=listen, connect=connect)
    )
    beyond = fleet.beyond
    router.outlasted_silence = min(router.outlasted_silence, beyond.outlasted_silence)
    return [
        f"names of this machine are below {plan.prefix} for others",
        *(f"listening on {endpoint}" for endpoint in beyond.endpoints),
        *(
            f"{'connected to' if reached else 'waiting for'} {endpoint}"
            for endpoint, reached in beyond.announce().items()
        ),
    ]


def _beside_keys(environment: Environment) -> Path | None:
    if environment.keys is None:
        return None
    from rosz.session import keys_of

    keys = keys_of(environment)
    file = keys and keys.path / _FILE
    return file if file and file.exists() else None
