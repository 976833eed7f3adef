"""Declarations on a session: publishers, subscribers, and the threads that call back."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

import msgspec
import zenoh

from rosz.errors import ClosedError, PanicError, RoszError, TransportError
from rosz.names import LONGEST_KEY, check_length
from rosz.session.at_exit import leak_at_exit, lose_sessions
from rosz.session.channels import CallbackQueue, declare_callback
from rosz.session.samples import Sample
from rosz.worker import ENDING, Serial, Worker, handle_all

_PANIC = "PanicException"
"""The class of PyO3 for panics. It is not an `Exception`, and no module has it."""
_POISONED = "PoisonError"
"""Name of the error by which Rust reports a lock that was held during a panic."""

_OFTEN_SECONDS = 1.0
_MANY = 5
"""Samples within that time that make a subscriber busy."""
_IDLE_SECONDS = 2.0
"""Seconds between two checks whether a busy subscriber is idle; after two idle ones it is free."""

_log = logging.getLogger("rosz.session")


@contextmanager
def translate_errors(what: str, key: str = "") -> Iterator[None]:
    """Turn errors and panics of Zenoh into errors of rosz, and refuse keys that are too long.

    A panic that leaves a lock poisoned makes every later operation fail: the sessions are lost.

    Args:
        what: The operation, as a verb with its object.
        key: The object, if it is a key expression.

    Raises:
        ClosedError: The session is closed, or the operation was cancelled.
        InvalidName: The key is too long.
        PanicError: Zenoh panicked.
        TransportError: Zenoh reported another error.
    """
    if key:
        what = f"{what} '{check_length(key, LONGEST_KEY)}'"
    try:
        yield
    except zenoh.ZError as error:
        text = str(error).partition(" at ")[0].strip()
        if "closed" in text.lower():
            raise ClosedError(f"cannot {what}: the session is closed") from error
        if "cancelled" in text:
            raise ClosedError(f"cannot {what}: it was cancelled") from error
        raise TransportError(f"cannot {what}: {text}") from error
    except BaseException as error:
        if type(error).__name__ != _PANIC:
            raise
        if _POISONED in str(error):
            lose_sessions(f"cannot {what}: {error}")
        raise PanicError(f"cannot {what}: Zenoh panicked: {error}") from error


class Declared:
    """One declaration, which is undeclared at most once.

    Zenoh refuses to undeclare a declaration while a thread is inside a method of it. So `_calls`
    has an item for each such thread, and the last of them undeclares a declaration that was closed
    meanwhile. Nobody waits, since to append to a list and to pop from it are atomic.

    Args:
        what: The name of the declaration in error texts.
        entity: The object of Zenoh that was declared.
    """

    def __init__(self, what: str, entity: Any) -> None:
        self._what = what
        self._entities = [entity]
        self._calls: list[None] = []
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether it is undeclared, or about to be."""
        return self._closed

    def close(self) -> None:
        """Undeclare it; a second call, or one after the end of the session, has no effect.

        If another thread is inside a method of it, that thread undeclares it when it leaves.
        """
        self._closed = True
        self._undeclare()

    @contextmanager
    def _call(self, doing: str) -> Iterator[None]:
        """Return a context for calling a method of Zenoh's object, which translates its errors."""
        try:
            self._calls.append(None)
            if self._closed:
                raise ClosedError(f"cannot {doing}: the {self._what} is closed")
            with translate_errors(doing):
                yield
        finally:
            self._calls.pop()
            if self._closed:
                self._undeclare()

    def _undeclare(self) -> None:
        """Undeclare it, unless a call is running or another thread already does."""
        ending = ENDING.is_set()
        if self._calls and not ending:
            return
        try:
            entity = self._entities.pop()
        except IndexError:
            return
        if ending:
            leak_at_exit(entity)
        else:
            # The session may close at this very moment, and undeclares everything.
            with suppress(ClosedError), translate_errors(f"undeclare {self._what}"):
                entity.undeclare()

    def __del__(self) -> None:
        """Undeclare a declaration that nobody closed."""
        self.close()


class Callbacks(Declared):
    """A declaration with a function that is called back for each item of it, one at a time.

    Args:
        what: The name of the declaration in error texts.
        declared: The object of Zenoh, and where its items arrive.
        callback: Function called with each item; exceptions are logged.
        begin: Function called once, before the first item.
        idle: Function called each time when all items have been handled.
    """

    def __init__(
        self,
        what: str,
        declared: tuple[Any, Any],
        callback: Callable[[Any], None],
        begin: Callable[[], None] | None = None,
        idle: Callable[[], None] | None = None,
    ) -> None:
        entity, source = declared
        super().__init__(what, entity)
        # The delivery must not hold this object: `__del__` would never run.
        if isinstance(source, CallbackQueue):
            delivery = _Delivery(what, source.take, callback, begin, idle)
            source.handle_with(Serial(delivery.deliver_all), at_once=bool(begin or idle))
            return
        delivery = _Delivery(what, source.try_recv, callback, begin, idle)
        recv = source.recv

        def receive() -> bool | None:
            if ENDING.is_set():
                return None
            try:
                delivery.deliver_all()
                item = recv()
            except zenoh.ZError:  # undeclared, or the session is closed
                return None
            delivery.deliver(item)
            return True

        Worker(f"rosz {what}", lambda _: None, receive=receive, logger=_log)


class _Delivery(msgspec.Struct, eq=False):
    """Passes items to a callback; the arguments are those of `Callbacks`, but for ``take``.

    Items do not leave this package, not even as arguments: see `rosz.session.at_exit`.
    """

    what: str
    take: Callable[[], Any]
    callback: Callable[[Any], None]
    begin: Callable[[], None] | None
    idle: Callable[[], None] | None

    def deliver(self, item: Any) -> None:
        """Pass an item to the callback."""
        try:
            self.callback(item)
        except Exception:  # noqa: BLE001  # the callback boundary: the next item may succeed
            if not ENDING.is_set():
                _log.exception("the callback of the %s failed", self.what)

    def deliver_all(self) -> None:
        """Pass all items that are there."""
        begin, self.begin = self.begin, None
        if begin is not None:
            begin()
        while (item := self.take()) is not None:
            self.deliver(item)
            del item
        if self.idle is not None:
            self.idle()


class PullSubscriber(Declared):
    """A subscriber that keeps the newest samples until a thread receives them."""

    def __init__(self, key: str, entity: Any) -> None:
        super().__init__(f"subscriber of '{key}'", entity)
        self._recv = entity.handler.recv
        self._try_recv = entity.handler.try_recv

    def receive(self) -> Sample:
        """Wait for a sample and return the oldest one.

        Raises:
            ClosedError: The subscriber or the session was closed.
        """
        if ENDING.is_set():
            raise ClosedError(f"the {self._what} is closed")
        try:
            return Sample(self._recv())
        except zenoh.ZError as error:
            raise ClosedError(f"the {self._what} is closed") from error

    def take(self) -> list[Sample]:
        """Return the samples that wait, oldest first; none when it is closed."""
        samples: list[Sample] = []
        with suppress(zenoh.ZError):
            while not ENDING.is_set() and (raw := self._try_recv()) is not None:
                samples.append(Sample(raw))
        return samples


class QueueSubscriber:
    """A subscriber that keeps the newest samples, and has them handled in order, one at a time.

    While few samples come, the threads of Zenoh put them into a queue, and a thread is lent to
    handle them. When many come, Zenoh's link threads would often wait for the GIL there. So a busy
    subscriber keeps its thread, and receives from a channel of Zenoh until no more come. Such a
    channel has a fixed capacity: a smaller one replaces it when fewer samples may wait. At each
    change a second subscriber is declared before the first is undeclared. The samples of the first
    are handled first, and a sample that both have is handled once. Meanwhile the queue keeps all
    samples, since the channel may get one late that a newer one would have replaced in the queue.

    Arguments are those of `Session.queue_subscriber`, and a function that declares a subscriber
    with a handler. One with a history is never busy: each declaration would replay the history.
    """

    def __init__(
        self,
        key: str,
        declare: Callable[[Any], Any],
        depth: int,
        handle: Callable[[Sample], object],
        *,
        fit: Callable[[int], int] | None,
        history: bool,
    ) -> None:
        self._key = key
        self._declare = declare
        self._depth = depth
        self._fit = fit
        self._closed = False
        self._channel: PullSubscriber | None = None
        self._next_queue: tuple[Declared, CallbackQueue] | None = None
        self._idle = self._is_leaving = False
        self._waiting: deque[Sample] = deque()
        self._repeated: set[bytes | None] = set()
        self._unchecked = 0  # how many of the next samples may be repeated ones
        self._may_be_busy = not history
        self._counted_at = 0.0
        self._count = self._count_at_sweep = 0
        self._queue_declaration, self._queue = self._declare_queue()
        self._serial = Serial(partial(handle_all, self._receive, handle), keeps_thread=True)
        self._queue.handle_with(self._serial)

    def _declare_queue(self) -> tuple[Declared, CallbackQueue]:
        entity, queue = declare_callback(self._declare, self._depth)
        return Declared(f"subscriber '{self._key}'", entity), queue

    def _receive(self) -> Sample | None:
        """Return the oldest sample; if there is none, wait for one if busy, else return None."""
        while not self._waiting:
            if self._channel is None:
                if (raw := self._queue.take()) is None:
                    return None
                sample = Sample(raw)
                self._count_arrival()
            else:
                self._idle = True
                try:
                    sample = self._channel.receive()
                except ClosedError:
                    self._return_to_queue()
                    continue
                self._idle = False
                self._count += 1
            if self._unchecked:
                self._unchecked -= 1
                if sample.attachment in self._repeated:
                    continue
            if self._is_leaving:
                self._repeated.add(sample.attachment)
            if self._fit is not None and (depth := self._fit(sample.size)) < self._depth:
                self._depth = self._queue.depth = depth
                if self._channel is not None:
                    self._use_channel()
            return sample
        return self._waiting.popleft()

    def _count_arrival(self) -> None:
        """Count a sample, and become busy if they come often."""
        self._count += 1
        if self._count % _MANY or not self._may_be_busy:
            return
        before, self._counted_at = self._counted_at, time.monotonic()
        if self._counted_at - before < _OFTEN_SECONDS and self._use_channel():
            _busy.append(self)
            _sweeper.wake()

    def _use_channel(self) -> bool:
        """Receive from a new channel from now on; return whether it was declared."""
        self._queue.depth = None
        try:
            new = PullSubscriber(self._key, self._declare(zenoh.handlers.RingChannel(self._depth)))
        except RoszError as error:
            self._queue.depth = self._depth
            if not isinstance(error, ClosedError):
                _log.warning("what comes often on '%s' is received slowly: %s", self._key, error)
            return False
        before = self._repeated if self._unchecked or self._is_leaving else set[bytes | None]()
        if self._channel is None:
            self._queue_declaration.close()
            self._queue.ended.get()
            taken = [Sample(raw) for raw in iter(self._queue.take, None)]
        else:
            taken = self._channel.take()
            self._channel.close()
        self._waiting.extend(
            sample for sample in taken[-self._depth :] if sample.attachment not in before
        )
        self._repeated = before | {sample.attachment for sample in taken} - {None}
        self._unchecked = self._depth + len(self._repeated)
        self._channel = new
        if self._closed:  # meanwhile
            new.close()
        return True

    def leave_channel_if_idle(self) -> None:
        """Leave the channel in two idle calls: declare the queue beside it, then close the channel.

        A call is idle if no sample came since the last one. Samples that were on their way when the
        queue was declared are in the channel by the second call. Later ones are in both.
        """
        channel, count, self._count_at_sweep = self._channel, self._count_at_sweep, self._count
        if channel is None:
            return
        if not self._idle or count != self._count_at_sweep:
            queue, self._next_queue, self._is_leaving = self._next_queue, None, False
            if queue is not None:
                queue[0].close()
        elif self._next_queue is not None:
            channel.close()
        else:
            self._repeated, self._unchecked, self._is_leaving = set(), 0, True
            with suppress(RoszError):  # the session may close meanwhile
                self._next_queue = self._declare_queue()
            if self._closed:
                self.close()

    def _return_to_queue(self) -> None:
        """Receive from the next queue; without one the subscriber is closed."""
        _busy.remove(self)
        self._channel, self._idle = None, False
        queue, self._next_queue, self._is_leaving = self._next_queue, None, False
        if queue is not None:
            self._queue_declaration, self._queue = queue
            self._repeated.discard(None)
            self._unchecked = self._depth + len(self._repeated)
            self._queue.handle_with(self._serial)
            if self._closed:  # meanwhile
                self._queue_declaration.close()

    def close(self) -> None:
        """Undeclare it; a second call, or one after the end of the session, has no effect."""
        self._closed = True
        queue = self._next_queue or (None,)
        for declared in filter(None, (self._queue_declaration, self._channel, queue[0])):
            declared.close()


def _sweep() -> None:
    while _busy and not ENDING.wait(_IDLE_SECONDS):
        for subscriber in _busy.copy():
            subscriber.leave_channel_if_idle()


_busy: list[QueueSubscriber] = []
_sweeper = Serial(_sweep)


class RawPublisher(Declared):
    """A declared publisher of bytes.

    Attributes:
        key: The key expression that it publishes on.
    """

    def __init__(self, key: str, entity: Any) -> None:
        super().__init__(f"publisher '{key}'", entity)
        self.key = key
        self._entity = entity
        self._put = entity.put
        self._matched = False
        self._changes: Callable[[], Any] | None = None
        self._listener: Declared | None = None
        self._watching = threading.RLock()  # a signal handler may publish in between

    def put(self, payload: bytes, attachment: bytes | None = None) -> None:
        """Send one sample.

        Raises:
            ClosedError: The publisher or the session is closed.
            TransportError: Zenoh cannot send the sample.
        """
        try:  # as in `_call`, without the time that entering a context takes
            self._calls.append(None)
            if self._closed:
                raise ClosedError(  # noqa: TRY301
                    f"cannot publish on '{self.key}': the publisher is closed"
                )
            self._put(payload, attachment=attachment)
        except BaseException:
            with translate_errors(f"publish on '{self.key}'"):
                raise
        finally:
            self._calls.pop()
            if self._closed:
                self._undeclare()

    def forward(
        self, sample: Sample, payload: bytes | None = None, attachment: bytes | None = None
    ) -> None:
        """Send a sample that arrived on another session, at the time of its first sending.

        Args:
            sample: The sample; its payload is not copied.
            payload: The payload to send instead.
            attachment: The bytes to send beside the payload.

        Raises:
            ClosedError: The publisher or the session is closed.
            TransportError: Zenoh cannot send the sample.
        """
        with self._call(f"publish on '{self.key}'"):
            self._put(
                sample.raw.payload if payload is None else payload,
                attachment=attachment,
                timestamp=sample.raw.timestamp,
            )

    @property
    def matched(self) -> bool:
        """Whether a subscriber of this publisher is known; only for publishers without a cache.

        The first look costs as much as several samples, each further one next to nothing.

        Raises:
            ClosedError: The publisher or the session is closed.
        """
        changes = self._changes or self._watch()
        if self._closed or ENDING.is_set():
            raise ClosedError(f"cannot look for subscribers of '{self.key}': it is closed")
        try:
            change = changes()
        except zenoh.ZError:  # it is being closed
            change = None
        if change is not None:
            self._matched = bool(change.matching)
        return self._matched

    def _watch(self) -> Callable[[], Any]:
        """Begin to follow whether there are subscribers; return the source of changes."""
        with self._watching, self._call(f"look for subscribers of '{self.key}'"):
            if self._changes is None:
                listener = self._entity.declare_matching_listener(zenoh.handlers.RingChannel(1))
                self._listener = Declared(f"watch of subscribers of '{self.key}'", listener)
                self._matched = bool(self._entity.matching_status.matching)
                self._changes = listener.handler.try_recv
        if self._closed and self._listener is not None:  # closed meanwhile
            self._listener.close()
        return self._changes

    def close(self) -> None:
        """Undeclare it; see `Declared.close`."""
        if self._listener is not None:
            self._listener.close()
        super().close()
