"""The context that the nodes of one process share: session, graph, clock and shutdown."""

from __future__ import annotations

import atexit
import itertools
import logging
import socket
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING, Any

import msgspec

from rosz import remap
from rosz.environment import Environment, package_index
from rosz.errors import ClosedError, RoszError
from rosz.graph import Graph
from rosz.interrupts import InterruptDeferral
from rosz.lifecycle import Closable, Closing, Lifecycle
from rosz.node.clock import Clock
from rosz.node.direct_delivery import DirectDelivery
from rosz.node.local_delivery import LocalDelivery
from rosz.program import current
from rosz.session import (
    Dialling,
    LocalPeers,
    MeshReadiness,
    Query,
    Session,
    SessionConfig,
    clamp_timeout,
    serve_links,
)
from rosz.wire import dropped_key

if TYPE_CHECKING:
    from rosz.message import Message
    from rosz.params.replica import Replica
    from rosz.security import LocalPermissions
    from rosz.typestore import TypeStore

_log = logging.getLogger("rosz.context")


class Context(Closing):
    """Owner of everything that lives as long as the program takes part in the network.

    The programs of a container share the session of one context, and with it the graph and the
    parameters. A context that such a program makes has only a command line and an end of its own.

    Args:
        environment: Settings; those of the process when not given.
        argv: Command-line arguments without the program name; ROS arguments are taken out.
        config: Settings of the session; those of the environment when not given.

    Attributes:
        session: The session.
        graph: The graph of the domain.
        clock: Wall time; the clocks of nodes are branches of it, whose time may be simulated.
        mesh: Readiness of the session: whether it is linked to all its neighbours.
        direct_delivery: Samples for single subscriptions of this process.
        dropped: Counts of dropped samples.
        local_delivery: Messages between the nodes of this process, if they do not use the session.
        passing: Whether this is a command, which holds no parameters, rather than a node.
        permissions: Permissions of this machine on others; None without rules.
        cooperative: Whether the program is known to check for the shutdown.

    Raises:
        TransportError: The session cannot be opened.
        UsageError: A variable of the environment has an invalid value.
    """

    MESH_TIMEOUT = 2.0
    """Seconds after which a new session counts as linked to all its neighbours in any case."""

    HOLD_TIMEOUT = 10.0
    """Seconds without a new link after which publishers hold samples no longer."""

    def __init__(
        self,
        environment: Environment | None = None,
        argv: Sequence[str] = (),
        config: SessionConfig | None = None,
    ) -> None:
        self.environment: Environment = environment or Environment.read()
        self.arguments: remap.Arguments = remap.parse(argv)
        self.domain: int = self.environment.domain
        self.cooperative: bool = False
        self._making = threading.RLock()
        self._params: Replica | None = None
        self._types: TypeStore | None = None
        self._flushed = threading.Event()
        self._lifecycle = Lifecycle("the context", log=_log, on_fork=self._forked)
        program = current()
        shared: Context | None = None if program is None else program.context
        self._shared: Context | None = None
        if config is None and shared is not None and shared.domain == self.domain:
            self._share(shared)
            return
        self.local_delivery: LocalDelivery | None = None
        config = config or SessionConfig.node(self.environment)
        self.passing: bool = config.must_connect
        self.permissions: LocalPermissions | None = _permissions(config)
        peers = LocalPeers.read(config.rendezvous)
        alone = config.mode == "peer" and not (
            config.connect or config.listen or config.multicast or peers.has_peers
        )
        self.clock: Clock = Clock()
        self._ids = itertools.count()
        with InterruptDeferral(self.close):
            self.session: Session = Session.open(config, peers)
            try:
                # Of two that begin at once, neither may have seen the other one before.
                expected = self.session.others.is_any_running
                self._join_network(config, alone=alone and not expected, expected=expected)
            except BaseException:
                self.session.close()
                raise
            self._forget_end = _at_end(self)

    def _share(self, shared: Context) -> None:
        """Use the network of the context of the container."""
        self._shared = shared
        self.session = shared.session
        self.graph = shared.graph
        self.direct_delivery = shared.direct_delivery
        self.local_delivery = shared.local_delivery
        self.dropped = shared.dropped
        self.mesh = shared.mesh
        self.passing = shared.passing
        self.permissions = shared.permissions
        self.clock = shared.clock.branch()
        self._ids = shared._ids
        self._forget_end = _at_end(self)

    graph: Graph
    direct_delivery: DirectDelivery
    dropped: DroppedSamples
    mesh: MeshReadiness

    def _join_network(self, config: SessionConfig, *, alone: bool, expected: bool) -> None:
        self.graph = Graph(self.session, self.domain)
        self.direct_delivery = DirectDelivery(self.session, self.domain)
        self.dropped = DroppedSamples(self.session, self.domain)
        self.mesh = MeshReadiness(
            self.session,
            0 if alone or self.passing else self.MESH_TIMEOUT,
            self._flushed,
            link_timeout=self.HOLD_TIMEOUT if expected else 0,
            mesh=config.mode == "peer",
            everywhere=config.multicast,
        )
        if config.mode == "peer":
            self._links = serve_links(self.session)
        self._dialling = Dialling(self.session, config)

    def next_id(self) -> int:
        """Return a number for a node or entity, unique within the session.

        Raises:
            ClosedError: The context is shut down, or this is a forked child of its process.
        """
        self.check_open()
        return next(self._ids)

    def check_open(self) -> None:
        """Refuse to declare anything more on a closed context.

        Raises:
            ClosedError: The context is shut down, or this is a forked child of its process.
        """
        self._lifecycle.check_open("declare anything more")

    @property
    def params(self) -> Replica:
        """This process's replica of the parameter store, joined on first use.

        It stays open until all shutdown hooks have run.

        Raises:
            ClosedError: The context is shut down, and has no replica.
        """
        if self._shared is not None:
            return self._shared.params
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
        self._params = replica = Replica(self.session, self.domain, settled=self.mesh.ready)
        if self._lifecycle.closing:  # perhaps too late for the thread that closes the context
            self._params = None
            replica.close()

    def decoder(self, message_type: type[Message]) -> Callable[[bytes], Any]:
        """Return the function that decodes messages of a class for the nodes of this context."""
        return message_type._decode

    @property
    def types(self) -> TypeStore:
        """Message and service types by name."""
        if self._shared is not None:
            return self._shared.types
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
        return self._lifecycle.closing

    @property
    def closed(self) -> bool:
        """Whether the end is complete: hooks have run, and the session is closed."""
        return self._lifecycle.closed

    @property
    def forked(self) -> bool:
        """Whether this is the copy in a forked child, which can do nothing."""
        return self._lifecycle.forked

    @property
    def reason(self) -> str:
        """Reason of the shutdown; may be set before it."""
        return self._lifecycle.reason

    @reason.setter
    def reason(self, reason: str) -> None:
        self._lifecycle.reason = reason

    def on_shutdown(self, hook: Callable[[str], object]) -> Callable[[], None]:
        """Call a function with the reason when the context shuts down.

        Hooks are called in the reverse order of registration, before the session closes.

        Returns:
            A function that removes the hook.

        Raises:
            ClosedError: The end has begun already.
        """
        return self._lifecycle.on_close(hook)

    def shutdown(self, reason: str = "") -> None:
        """End everything: call the hooks, then close the session.

        It may be called from any callback, and a second call has no effect.

        Args:
            reason: Reason of the shutdown, for hooks and errors.
        """
        self._lifecycle.close(self._disconnect, first=self.clock.close, reason=reason)

    def close_links(self) -> AbstractContextManager[object]:
        """Return a context within which the session closes its links, unless others share it."""
        if self._shared is not None and not self._shared.is_shutdown:
            return nullcontext()
        return self.session.close_links()

    def _disconnect(self) -> None:
        if self._shared is not None:
            self._forget_end()
            return
        self._flushed.set()
        self._dialling.close()
        try:
            with self.session.close_links():
                if self._params is not None:
                    self._params.close()
                self.graph.close()
        finally:  # an open session would abort the process at its end
            self.session.close()
            self._forget_end()

    def _forked(self) -> None:
        self._forget_end()
        self._making = threading.RLock()

    def pause_main_thread(self, frame: FrameType | None) -> None:
        """Return at once; a subclass may keep the main thread waiting in its signal handler.

        Args:
            frame: Where a signal has interrupted the main thread.
        """

    def wait_for_shutdown(self, timeout: float | None = None) -> bool:
        """Wait until the end has begun; any number of threads may.

        Args:
            timeout: Time limit in seconds; none when not given.

        Returns:
            Whether it has begun.

        Raises:
            UsageError: The timeout is not a number.
        """
        self.cooperative = self.cooperative or threading.current_thread() is threading.main_thread()
        return self._lifecycle.wait_closing(None if timeout is None else clamp_timeout(timeout))

    def close(self) -> None:
        """Shut down; the same as `shutdown` without a reason."""
        self.shutdown()


def _at_end(context: Context) -> Callable[[], object]:
    """Shut a context down when its program ends; return a function that takes this back."""
    program = current()
    if program is not None:
        return program.on_end(context.shutdown)
    atexit.register(context.close)
    return partial(atexit.unregister, context.close)


def _permissions(config: SessionConfig) -> LocalPermissions | None:
    """Return the permissions of this machine, if its declarations reach others."""
    if config.keys is None or not (config.reaches_beyond or config.must_connect):
        return None
    from rosz.security import LocalPermissions

    return LocalPermissions.find(config.keys, socket.gethostname())


class DroppedSamples:
    """Counts dropped samples, and tells those who query the counts.

    The queryable is declared with the first dropped sample.

    Args:
        session: The session.
        domain: The ROS domain.
    """

    def __init__(self, session: Session, domain: int) -> None:
        self._session = session
        self._key = dropped_key(domain, session.zid)
        self._counts: Counter[int] = Counter()
        self._lock = threading.RLock()  # a signal handler may publish meanwhile
        self._queryable: Closable | None = None

    def add(self, entity_id: int, count: int) -> None:
        """Count samples that an entity has dropped."""
        with self._lock:
            self._counts[entity_id] += count
            if self._queryable is None:
                try:
                    self._queryable = self._session.queryable(self._key, self._reply)
                except RoszError as error:  # the session closes
                    logging.getLogger("rosz.node").debug(
                        "nobody can query dropped samples: %s", error
                    )

    def _reply(self, query: Query) -> None:
        with query:
            with self._lock:
                counts = dict(self._counts)
            query.reply(self._key, msgspec.msgpack.encode(counts))
