"""``rosz core``: run a meeting point with a copy of the parameters."""

from __future__ import annotations

import threading
import uuid
from contextlib import ExitStack, closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rosz.cli import suggest
from rosz.cli.console import print_lines, until_stopped
from rosz.cli.declare import App, Option
from rosz.errors import UsageError

if TYPE_CHECKING:
    from rosz.params.replica import Replica
    from rosz.params.replica.storage import Storage

__all__ = ("app",)

app = App()


@app.command()
def core_command(
    *,
    listen: Annotated[
        list[str] | None,
        Option(
            "--listen ENDPOINT",
            "Listen at this endpoint as well, such as tcp/0.0.0.0:7447; repeatable.",
        ),
    ] = None,
    connect: Annotated[
        list[str] | None,
        Option(
            "--connect ENDPOINT", "Connect to this endpoint, such as tcp/robot1:7447; repeatable."
        ),
    ] = None,
    keys: Annotated[str, Option("--keys DIR", "Folder of keys for links to other machines.")] = "",
    store: Annotated[str, Option("--store FILE", "Keep parameters in a file.", suggest.files)] = "",
    port: Annotated[str, Option("-p --port")] = "",
) -> None:
    """Run a meeting point with a copy of the parameters, until it is stopped.

    No node needs a core. It links machines, and keeps parameters when no node runs.
    """
    if port:
        raise UsageError(
            "there is no master, and so no port: ROSZ_RENDEZVOUS moves the meeting point,"
            " ROS_DOMAIN_ID keeps groups of nodes apart"
        )
    import msgspec

    from rosz.cli.zenohlog import summarize_zenoh_log
    from rosz.environment import Environment
    from rosz.params.replica import Replica
    from rosz.session.router import Router

    environment = Environment.read()
    if keys:
        environment = msgspec.structs.replace(environment, keys=Path(keys).absolute())
    file = Path(store).absolute() if store else None
    logging = nullcontext() if environment.keys is None else summarize_zenoh_log()
    with logging, until_stopped() as ready, ExitStack() as stack:
        storage = None if file is None else _open_storage(file, stack)
        router = stack.enter_context(Router(environment, listen or (), connect or ()))
        domain = environment.domain
        replica = stack.enter_context(closing(Replica(router.session, domain, storage=storage)))
        _set_core_params(replica)
        lines = [f"listening on {endpoint}" for endpoint in router.endpoints]
        lines += [f"connecting to {endpoint}" for endpoint in router.connect]
        kept = f"kept in {file}" if file else "kept in memory"
        lines.append(f"parameters of domain {domain} are {kept}")
        ready()
        print_lines([*lines, "started core; press Ctrl-C to end it"])
        threading.Event().wait()


def _open_storage(file: Path, stack: ExitStack) -> Storage:
    from rosz.params.replica.storage import Storage, StoreFile

    return stack.enter_context(closing(Storage(StoreFile(file))))


def _set_core_params(replica: Replica) -> None:
    """Set the parameters that a ROS 1 core sets, unless they are set already."""
    from rosz.launch.run.network import core_params, write_params

    known = core_params(str(uuid.uuid1()))
    missing = {name: value for name, value in known.items() if not replica.has(name)}
    if missing:
        write_params(replica, missing)
