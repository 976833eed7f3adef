"""A core of the launch's own, for launches of many nodes.

In a full mesh the links grow with the square of the number of nodes, and so does the work of
bringing them up. Above some number a launch therefore starts ``rosz core`` and makes its nodes
clients of it. It is a process of its own: when the launch is killed, the nodes go on.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from types import TracebackType
from typing import Final, Self

import msgspec

from rosz.environment import Environment
from rosz.errors import LaunchError
from rosz.launch.run.command import TAG
from rosz.launch.run.console import Console
from rosz.launch.run.loop import Loop
from rosz.session import is_listening

__all__ = ("MESH_LIMIT", "Hub", "wants_hub")

MESH_LIMIT: Final = 24
"""So many nodes still come up faster in a mesh than as clients; measured on two cores."""

_MODE: Final = "ROSZ_MODE"
_UP_SECONDS: Final = 10.0
_LOOK_SECONDS: Final = 0.01
_AGAIN_SECONDS: Final = 0.5
_END_SECONDS: Final = 2.0


def wants_hub(nodes: int, environment: Environment, environ: Mapping[str, str]) -> bool:
    """Tell whether a launch is to start a core.

    For many nodes, and for nodes linked to another machine: without one here all that they say to
    each other would go by way of that machine, and end with the link.

    Not where the user has chosen a mode, or a way to open sessions, and not where somebody holds
    the rendezvous already.

    Args:
        nodes: How many nodes it starts.
        environment: Settings.
        environ: Variables.
    """
    dials = bool(nodes and environment.connect and not environment.listen)
    return (
        (nodes > MESH_LIMIT or dials)
        and not environ.get(_MODE)
        and not environment.zenoh_config
        and not is_listening(environment.rendezvous)
    )


class Hub:
    """The process that holds the rendezvous.

    Args:
        environment: Settings.
        environ: Variables.

    Attributes:
        environment: The settings of a client of it.
        environ: The variables of clients of it.

    Raises:
        LaunchError: It does not come up.
    """

    def __init__(self, environment: Environment, environ: Mapping[str, str]) -> None:
        self.environment = msgspec.structs.replace(environment, mode="client")
        self.environ = {**environ, _MODE: "client"}
        self._own_environ = {name: value for name, value in environ.items() if name != TAG}
        self._closing = False
        self._process = self._start()
        try:
            self._await(environment.rendezvous)
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int:
        """Process id of the core."""
        return self._process.pid

    def _start(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-P", "-m", "rosz", "core"],
            env=self._own_environ,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )

    def _await(self, rendezvous: str) -> None:
        deadline = time.monotonic() + _UP_SECONDS
        while not is_listening(rendezvous):
            if self._process.poll() is not None:
                raise LaunchError(
                    f"the core for these nodes ended with exit code {self._process.returncode};"
                    f" {_MODE}=peer does without one"
                )
            if time.monotonic() > deadline:
                raise LaunchError(
                    f"the core for these nodes does not answer at {rendezvous} within"
                    f" {_UP_SECONDS:g} s; {_MODE}=peer does without one"
                )
            time.sleep(_LOOK_SECONDS)

    def keep(self, loop: Loop, console: Console) -> None:
        """Have it started again whenever it ends, until it is closed."""

        def ended() -> None:
            code = self._process.wait()
            if self._closing:
                return
            console.error(f"[core] process has died [pid {self.pid}, exit code {code}].")
            loop.later(_AGAIN_SECONDS, again)

        def again() -> None:
            console.say("[core] restarting process")
            try:
                self._process = self._start()
            except OSError as error:
                console.error(f"[core] cannot be started: {error.strerror}")
                loop.later(_AGAIN_SECONDS, again)
                return
            console.strong(f"process[core]: started with pid [{self.pid}]")
            loop.watch_exit(self.pid, ended)

        loop.watch_exit(self.pid, ended)

    def close(self) -> None:
        """End it; again is no error."""
        self._closing = True
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(_END_SECONDS)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
