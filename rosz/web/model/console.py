"""The log of all nodes while a page shows it, bounded in lines and bytes."""

from __future__ import annotations

import itertools
import logging
import math
import threading
from collections.abc import Iterator

from rosz.errors import DecodeError
from rosz.introspect import LogFilter, LogLine, read_line, subscribe_samples
from rosz.msgs.rcl_interfaces.msg import Log
from rosz.node import Node
from rosz.queue import BoundedQueue
from rosz.session import Sample

_MOST_LINES = 10_000
_MOST_BYTES = 8 << 20
_log = logging.getLogger("rosz.web")


class LogBook:
    """The newest lines of the log, until it is closed.

    Args:
        node: The node that subscribes to ``/rosout``.

    Attributes:
        received: Number of lines that have come.
    """

    def __init__(self, node: Node) -> None:
        self.received: int = 0
        self._lock = threading.Lock()
        self._samples: BoundedQueue[tuple[int, bytes]] = BoundedQueue(_MOST_LINES, _MOST_BYTES)
        self._entity = subscribe_samples(
            node, "/rosout", Log._type_name, Log._type_hash, self._receive
        )

    def _receive(self, sample: Sample) -> None:
        payload = sample.payload
        with self._lock:
            self.received += 1
            self._samples.put((self.received, payload), len(payload))

    def clear(self) -> None:
        """Forget all lines."""
        with self._lock:
            self._samples.clear()

    def newest(
        self,
        wanted: LogFilter,
        nodes: list[str],
        most: int,
        until: int | None = None,
        between: tuple[float, float] = (0.0, math.inf),
    ) -> list[tuple[int, LogLine]]:
        """Return the newest lines that pass a filter, each with its number, the newest first.

        Args:
            wanted: The filter.
            nodes: Full names of the known nodes.
            most: Largest number of lines.
            until: Number of the newest line to return; the last one when not given.
            between: Times in seconds since the Unix epoch; lines before and after are left out.
        """
        with self._lock:
            samples = list(self._samples)
        passing = (
            (number, line)
            for number, line in _lines(samples, nodes, until)
            if between[0] <= line.stamp <= between[1] and wanted.accepts(line)
        )
        return list(itertools.islice(passing, most))

    def close(self) -> None:
        """Unsubscribe."""
        self._entity.close()


def _lines(
    samples: list[tuple[int, bytes]], nodes: list[str], until: int | None
) -> Iterator[tuple[int, LogLine]]:
    for number, payload in reversed(samples):
        if until is not None and number > until:
            continue
        try:
            yield number, read_line(Log.from_cdr(payload), nodes)
        except DecodeError as error:
            _log.debug("a message on /rosout is not a log message: %s", error)
