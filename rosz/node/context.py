"""What the nodes of one process share: the session, the graph, the clock, and their end."""

from __future__ import annotations

import atexit
import itertools
import logging
import os
import socket
import threading
import weakref
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Self

from rosz import remap
from rosz.environment import Environment, package_index
from rosz.errors import ClosedError
from rosz.graph import Graph
from rosz.node import signals
from rosz.node.clock import Clock
from rosz.node.inbox import Inbox
from rosz.node.mismatch import MismatchWatch
from rosz.session import (
    LocalPeers,
    MeshReadiness,
    Session,
    SessionConfig,
    clamp_timeout,
    serve_links,
)

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.node.endpoint import Endpoint
    from rosz.params.replica import Replica
    from rosz.security import Leave
    from rosz.typestore import TypeStore

__all__ = ("Context",)

_log = logging.getLogger("rosz.context")
_FORKED = (
    "this process was forked from one that uses rosz, and threads and links do not outlive a fork:"
    " start the child first, or use the 'spawn' method of multiprocessing"
)
_CLOSED_BY = 10.0
"""Seconds that whoever shuts down a second time waits for the first, and its hooks, to be done."""


class Context:
    """Owner of everything that lives as long as the program's part in the network.

    Args:
        environment: Settings; those of the process when not given.
        argv: Command-line arguments without the program name; ROS ones are taken out.
        config: How to open the session; by the environment when not given.

    Attributes:
        session: The network.
        graph: Who is alive.
        clock: ROS time.
        settled: Set when the process is linked to all its neighbours.
        when_settled: Has a function called when it is, or at once if it is already.
        inbox: What comes for single subscriptions of this process.
        reason: Why it is shut down, or about to be.
        passing: Whether this is a command rather than a part of the system: it holds no parameters.
        leave: What rules let this machine do elsewhere, where it knows of any.
        cooperative: Whether the program has shown that it asks for the end by itself.
        forked: Whether this is the copy in a forked child, which can do nothing.

    Raises:
        TransportError: The session cannot be opened.
        UsageError: The environment has a value that means nothing.
    """

    SETTLED_BY = 2.0
    """Seconds after which a young session counts as linked to all its neighbours, come what may."""

    def __init__(
        self,
        environment: Environment | None = None,
        argv: Sequence[str] = (),
        config: SessionConfig | None = None,
    ) -> None:
        self.environment = environment or Environment.read()
        self.arguments = remap.parse(argv)
        self.domain = self.environment.domain
        config = config or SessionConfig.node(self.environment)
        self.passing = config.must_connect
        self.leave = _leave(config)
        peers = LocalPeers.read(config.rendezvous)
        alone = config.mode == "peer" and not (
            config.connect or config.listen or config.multicast or peers.is_anybody_there
        )
        self.clock = Clock()
        self._ids = itertools.count()
        self._hooks: list[Callable[[str], None]] = []
        self._lock = threading.RLock()
        self._making = threading.RLock()
        self._params: Replica | None = None
        self._types: TypeStore | None = None
        self._stopping = threading.Event()
        self._flushed = threading.Event()
        self._stopped = threading.Event()
        self._closer: threading.Thread | None = None
        self.reason = ""
        self.cooperative = False
        self.forked = False
        self._endpoints: weakref.WeakSet[Endpoint] = weakref.WeakSet()
        self.session = Session.open(config, peers)
        try:
            self._look_around(config, alone=alone)
        except BaseException:  # Ctrl-C comes anywhere
            self.session.close()
            raise
        atexit.register(self.close)
        _contexts.add(self)

    def _look_around(self, config: SessionConfig, *, alone: bool) -> None:
        self.graph = Graph(self.session, self.domain)
        self._mismatches = MismatchWatch(self.graph, self.session.zid)
        self.inbox = Inbox(self.session, self.domain)
        mesh = MeshReadiness(
            self.session,
            0 if alone or self.passing else self.SETTLED_BY,
            self._flushed,
            mesh=config.mode == "peer",
            everywhere=config.multicast,
        )
        self.settled = mesh.ready
        self.when_settled = mesh.when_ready
        if config.mode == "peer":
            self._links = serve_links(self.session)

    def next_id(self) -> int:
        """Return a number for a node or endpoint, unique within the session.

        Raises:
            ClosedError: The context is shut down, or this is a forked child of its process.
        """
        self.check_open()
        return next(self._ids)

    def check_open(self) -> None:
        """Refuse to begin something new at the end.

        Raises:
            ClosedError: The context is shut down, or this is a forked child of its process.
        """
        if self._stopping.is_set():
            raise ClosedError(
                f"the context is shut down{': ' + self.reason if self.reason else ''}"
            )

    def add_endpoint(self, endpoint: Endpoint, *, watch: bool = True) -> None:
        """Take note of an endpoint of this process.

        Args:
            endpoint: It.
            watch: Whether to tell of endpoints of the same name that it does not reach.
        """
        with self._lock:
            self._endpoints.add(endpoint)
            if watch:
                self._mismatches.add(endpoint)

    def remove_endpoint(self, endpoint: Endpoint) -> None:
        """Forget an endpoint."""
        with self._lock:
            self._endpoints.discard(endpoint)
            self._mismatches.remove(endpoint)

    @property
    def params(self) -> Replica:
        """This process's replica of the parameter store, joined on first use.

        It is there until all shutdown hooks have run.

        Raises:
            ClosedError: The context is shut down, and has no replica.
        """
        if self._params is None:
            with self._making:
                if self._params is None:
                    self._join_store()
        if self._params is None:
            raise ClosedError("the context is shut down: it has no parameters")
        return self._params

    def _join_store(self) -> None:
        from rosz.params.replica import Replica

        self.check_open()
        replica = Replica(self.session, self.domain, settled=self.settled)
        with self._lock:
            if not self._stopping.is_set():
                self._params = replica
                return
        replica.close()

    @property
    def types(self) -> TypeStore:
        """Message and service types by name."""
        if self._types is None:
            from rosz.typestore import TypeStore

            with self._making:
                if self._types is None:
                    self._types = TypeStore(
                        package_index(self.environment), self.environment.home / "rosz"
                    )
        return self._types

    @property
    def is_shutdown(self) -> bool:
        """Whether the end has begun."""
        return self._stopping.is_set()

    @property
    def closed(self) -> bool:
        """Whether the end has come: hooks have run, and the session is closed."""
        return self._stopped.is_set()

    def on_shutdown(self, hook: Callable[[str], None]) -> Callable[[], None]:
        """Have a function called with the reason when the context shuts down.

        Hooks run in the reverse order of registration, before the session closes.

        Returns:
            A function that takes the hook back.

        Raises:
            ClosedError: The end has begun already.
        """
        with self._lock:
            if self._stopping.is_set():
                raise ClosedError("the context is shut down: no hook will run")
            self._hooks.append(hook)

        def withdraw() -> None:
            with self._lock:
                if hook in self._hooks:
                    self._hooks.remove(hook)

        return withdraw

    def shutdown(self, reason: str = "") -> None:
        """End everything: hooks, then the session. Again, or from any callback, is no error."""
        with self._lock:
            begun = self._stopping.is_set()
            if not begun:
                self.reason = reason = reason or self.reason
                self._closer = threading.current_thread()
                self._stopping.set()
        if begun:
            # Whoever comes second, often the main thread on its way out, must not outrun the first.
            if threading.current_thread() is not self._closer and not self._stopped.wait(
                _CLOSED_BY
            ):
                _log.warning("shutting down takes more than %g s: a hook blocks it", _CLOSED_BY)
            return
        with self._lock:
            hooks = self._hooks[::-1]
            self._hooks.clear()
        self.clock.close()
        try:
            for hook in hooks:
                try:
                    hook(reason)
                except (Exception, SystemExit):  # noqa: BLE001  # the callback boundary
                    _log.exception("a shutdown hook failed")
        finally:  # also where Ctrl-C interrupts a hook
            self._flushed.set()
            self._disconnect()

    def _disconnect(self) -> None:
        try:
            with self.session.close_links():
                if self._params is not None:
                    self._params.close()
                self.graph.close()
            self.session.close()
        finally:
            atexit.unregister(self.close)
            self._stopped.set()

    def disown(self) -> None:
        """Refuse everything from now on, touching neither threads nor links: after a fork."""
        atexit.unregister(self.close)
        self.forked = True
        self.reason = _FORKED
        self._lock = threading.RLock()
        self._making = threading.RLock()
        self._stopping = self._flushed = self._stopped = threading.Event()
        self._stopping.set()
        self._closer = threading.current_thread()
        self._hooks = []
        if self._params is not None:
            self._params.disown()
        for endpoint in self._endpoints:
            endpoint.disown(_FORKED)

    def wait_for_shutdown(self, timeout: float | None = None) -> bool:
        """Wait until the end has begun; any thread, any number of them.

        Args:
            timeout: Seconds; forever when not given.

        Returns:
            Whether it has.

        Raises:
            UsageError: The timeout is no number.
        """
        self.cooperative = self.cooperative or threading.current_thread() is threading.main_thread()
        return self._stopping.wait(None if timeout is None else clamp_timeout(timeout))

    def close(self) -> None:
        """Shut down; the same as `shutdown` without a reason."""
        self.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def _leave(config: SessionConfig) -> Leave | None:
    """Return what rules say of this machine, if what it declares is for others as well."""
    if config.keys is None or not (config.reaches_beyond or config.must_connect):
        return None
    from rosz.security import Leave

    return Leave.find(config.keys, socket.gethostname())


_contexts: weakref.WeakSet[Context] = weakref.WeakSet()
"""Those of this process. What is registered for a fork stays so, and would add up for each."""


def _disown_all() -> None:
    """Take a forked child's hands off what belongs to its parent."""
    for context in list(_contexts):
        signals.release()
        context.disown()


os.register_at_fork(after_in_child=_disown_all)
