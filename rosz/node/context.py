"""What the nodes of one process share: the session, the graph, the clock, and their end."""

from __future__ import annotations

import atexit
import itertools
import logging
import os
import threading
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Self

from rosz import remap
from rosz.environment import Environment, package_index
from rosz.errors import ClosedError, RoszError
from rosz.graph import Graph
from rosz.node.clock import Clock
from rosz.session import Closable, Sample, Session, SessionConfig
from rosz.session.probe import is_answered
from rosz.session.settle import serve_links, settle
from rosz.wire import own_key

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.params.replica import Replica
    from rosz.typestore import TypeStore

__all__ = ("Context",)

_log = logging.getLogger("rosz.context")
_CLOSED_BY = 2.0


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
        reason: Why it was shut down, once it is.
        cooperative: Whether the program has shown that it asks for the end by itself.

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
        self._process = os.getpid()
        config = config or SessionConfig.node(self.environment)
        alone = config.mode == "peer" and not (
            config.connect or config.listen or config.multicast or is_answered(config.rendezvous)
        )
        self.session = Session.open(config)
        self.graph = Graph(self.session, self.domain)
        self.clock = Clock()
        self._ids = itertools.count()
        self._hooks: list[Callable[[str], None]] = []
        self._lock = threading.RLock()
        self._stopping = threading.Event()
        self._flushed = threading.Event()
        self._stopped = threading.Event()
        self._closer: threading.Thread | None = None
        self.reason = ""
        self.cooperative = False
        atexit.register(self.close)
        self.settled = threading.Event()
        self._when_settled: list[Callable[[], None]] = []
        self._inbox: dict[int, Callable[[Sample], None]] = {}
        if config.mode == "peer":
            self._links = serve_links(self.session)
        if config.mode != "peer" or alone:
            self.settled.set()
        else:
            threading.Thread(target=self._settle, name="rosz-settle", daemon=True).start()

    def _settle(self) -> None:
        try:
            settle(self.session, timeout=self.SETTLED_BY, stop=self._flushed)
        except RoszError as error:
            if not self._flushed.is_set():
                _log.warning("cannot tell whether all peers are linked: %s", error)
        finally:
            with self._lock:
                waiting = self._when_settled
                self._when_settled = []
                self.settled.set()
            for callback in waiting:
                callback()

    def when_settled(self, callback: Callable[[], None]) -> None:
        """Have a function called when all neighbours are linked, or at once if they are."""
        with self._lock:
            if not self.settled.is_set():
                self._when_settled.append(callback)
                return
        callback()

    @cached_property
    def _inbox_subscriber(self) -> Closable:
        key = own_key(self.domain, "inbox", self.session.zid)
        return self.session.subscriber(f"{key}/*", self._sort_inbox)

    def _sort_inbox(self, sample: Sample) -> None:
        deliver = self._inbox.get(int(sample.key.rpartition("/")[2]))
        if deliver is not None:
            deliver(sample)

    def open_inbox(self, entity_id: int, deliver: Callable[[Sample], None]) -> Callable[[], None]:
        """Take in what is addressed to one subscription alone.

        Args:
            entity_id: Number of the subscription.
            deliver: Gets each sample, on a Zenoh thread.

        Returns:
            A function that ends it.
        """
        self._inbox[entity_id] = deliver
        with self._lock:
            self._inbox_subscriber  # noqa: B018  # declared on first use
        return lambda: self._inbox.pop(entity_id, None) and None

    def has_inbox(self, zid: str) -> bool:
        """Tell whether a session takes in what is addressed to one of its subscriptions."""
        return any(process.zid == zid for process in self.graph.processes())

    def next_id(self) -> int:
        """Return a number for a node or endpoint, unique within the session.

        Raises:
            ClosedError: The context is shut down, or this is a forked child of its process.
        """
        if self._process != os.getpid():
            raise ClosedError(
                "this process was forked from one that uses rosz; threads and links do not outlive"
                " a fork: start the child first, or use the 'spawn' method of multiprocessing"
            )
        if self._stopping.is_set():
            raise ClosedError(
                f"the context is shut down{': ' + self.reason if self.reason else ''}"
            )
        return next(self._ids)

    @cached_property
    def params(self) -> Replica:
        """This process's replica of the parameter store, joined on first use."""
        from rosz.params.replica import Replica

        with self._lock:
            replica = Replica(self.session, self.domain)
            self.on_shutdown(lambda _: replica.close())
            return replica

    @cached_property
    def types(self) -> TypeStore:
        """Message and service types by name."""
        from rosz.typestore import TypeStore

        return TypeStore(package_index(self.environment), self.environment.home / "rosz")

    @property
    def is_shutdown(self) -> bool:
        """Whether the end has begun."""
        return self._stopping.is_set()

    def on_shutdown(self, hook: Callable[[str], None]) -> Callable[[], None]:
        """Have a function called with the reason when the context shuts down.

        Hooks run in the reverse order of registration, before the session closes.

        Returns:
            A function that takes the hook back.
        """
        with self._lock:
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
                self.reason = reason
                self._closer = threading.current_thread()
                self._stopping.set()
        if begun:
            # Whoever comes second, often the main thread on its way out, must not outrun the first.
            if threading.current_thread() is not self._closer:
                self._stopped.wait(_CLOSED_BY)
            return
        with self._lock:
            hooks = self._hooks[::-1]
            self._hooks.clear()
        self.clock.close()
        for hook in hooks:
            try:
                hook(reason)
            except Exception:  # noqa: BLE001  # the callback boundary
                _log.exception("a shutdown hook failed")
        self._flushed.set()
        self.graph.close()
        self.session.close()
        atexit.unregister(self.close)
        self._stopped.set()

    def wait_for_shutdown(self, timeout: float | None = None) -> bool:
        """Wait until the end has begun; any thread, any number of them.

        Args:
            timeout: Seconds; forever when not given.

        Returns:
            Whether it has.
        """
        return self._stopping.wait(timeout)

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
