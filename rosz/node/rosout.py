"""A node's log on its way to ``/rosout``."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue

from rosz.errors import ClosedError
from rosz.node.clock import Clock
from rosz.node.severity import severity
from rosz.session.starting import start

__all__ = ("PublishLine", "RosoutSink")

PublishLine = Callable[[int, str, str, str, str, int, int], object]
"""Called with severity, name, message, file, function, line and stamp in nanoseconds."""

_CAPACITY = 1000
_DRAIN_S = 1.0

_Line = tuple[int, str, str, str, str, int, int]


class RosoutSink(logging.Handler):
    """Hand records over to a thread that publishes them.

    Logging never waits for the network, nor for a lock of it that the caller may hold, and may
    happen in a signal handler. Up to a thousand records wait, from before there is a publisher on;
    what goes beyond is dropped, and how much is said in the next line. What publishing itself logs
    is not published.

    Args:
        name: Name of the node's logger as ROS 2 writes it, such as ``ns.talker``.
        base: Name of the node's logger in records.
        clock: What stamps the lines.
        on_trouble: Told, in a sentence, when publishing fails, once; it may log.
    """

    def __init__(
        self, name: str, base: str, clock: Clock, on_trouble: Callable[[str], object]
    ) -> None:
        super().__init__()
        self._ros_name = name
        self._base = base
        self._clock = clock
        self._on_trouble = on_trouble
        self._queue: SimpleQueue[_Line | threading.Event | None] = SimpleQueue()
        self._dropped = 0
        self._closed_for_good = False
        self._thread: threading.Thread | None = None

    def handle(self, record: logging.LogRecord) -> bool:
        """Queue a record, unless it comes from publishing one.

        No lock is held: the queue needs none, and who drains it may hold one.
        """
        if threading.current_thread() is self._thread:
            return False
        passed = self.filter(record)
        if passed:
            # From Python 3.12 on, a filter may put another record in its place.
            self.emit(passed if isinstance(passed, logging.LogRecord) else record)
        return bool(passed)

    def emit(self, record: logging.LogRecord) -> None:
        """Queue a record."""
        if self._closed_for_good:
            return
        if self._queue.qsize() >= _CAPACITY:
            self._dropped += 1
            return
        name = self._ros_name + record.name.removeprefix(self._base)
        self._queue.put(
            (
                severity(record.levelno),
                name,
                self.format(record),
                record.pathname,
                record.funcName or "",
                record.lineno,
                self._clock.now(),
            )
        )

    def publish_to(self, publish: PublishLine) -> None:
        """Begin to publish, with what has been logged so far.

        Args:
            publish: Called on a thread of the sink, one line at a time.
        """
        if self._thread is not None:
            raise RuntimeError("already publishing")
        thread = threading.Thread(
            target=self._run, args=(publish,), name=f"rosz-rosout {self._ros_name}", daemon=True
        )
        # Only one that has been started can be waited for, and `stop` may come at any moment.
        if start(thread):
            self._thread = thread

    def flush(self) -> None:
        """Wait, for a second at most, until all that was logged before is published.

        There is no `close` of its own: configuring logging anew closes all handlers of a process,
        also those that it does not know, and that shall be no end.
        """
        thread = self._thread
        if thread is None or thread is threading.current_thread() or not thread.is_alive():
            return
        drained = threading.Event()
        self._queue.put(drained)
        drained.wait(_DRAIN_S)

    def stop(self) -> None:
        """Publish what is left, for a second at most, and no more."""
        self._closed_for_good = True
        self._queue.put(None)
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(_DRAIN_S)
        super().close()

    def _run(self, publish: PublishLine) -> None:
        self._thread = threading.current_thread()
        told = False
        while (line := self._queue.get()) is not None:
            if isinstance(line, threading.Event):
                line.set()
                continue
            try:
                publish(*line)
                self._tell_dropped(publish)
            except ClosedError:
                continue  # the node ended before this began
            except Exception as error:  # noqa: BLE001  # whatever publishing may raise
                if not told and not self._closed_for_good:
                    told = True
                    self._on_trouble(f"cannot publish the log on /rosout: {error}")
        self._release_waiting()

    def _tell_dropped(self, publish: PublishLine) -> None:
        dropped, self._dropped = self._dropped, 0
        if dropped:
            text = f"{dropped} messages are missing here: more was logged than could be published"
            now = self._clock.now()
            publish(logging.WARNING, self._ros_name, text, __file__, "_tell_dropped", 0, now)

    def _release_waiting(self) -> None:
        """Wake who flushes while the thread ends."""
        try:
            while True:
                item = self._queue.get_nowait()
                if isinstance(item, threading.Event):
                    item.set()
        except Empty:
            return
