"""The events of a node's parameters on ``/parameter_events``, as nodes of ROS 2 publish them.

An event has what one call has set, changed and deleted. As the store tells only of changes, there
is none for a parameter that is set to the value that it has, where rclpy publishes one.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from itertools import groupby
from typing import TYPE_CHECKING

from rosz.errors import ClosedError
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.rcl_interfaces.msg import Parameter, ParameterEvent, ParameterValue
from rosz.node.core import NodeCore
from rosz.node.publisher import Publisher
from rosz.node.ros2.values import to_ros2
from rosz.params import Path, Value, leaves, split
from rosz.qos import PARAMETERS
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.params.replica import Changed

_TOPIC = "/parameter_events"
_SECOND = 1_000_000_000


class ParameterEvents:
    """Publishes the events of a node until it is closed.

    Args:
        node: The node.
        announce: Whether the first event has the parameters that are set already, for those that
            were there before the node.

    Raises:
        ClosedError: The node is closed.
    """

    def __init__(self, node: NodeCore, *, announce: bool) -> None:
        self._node = node
        self._base = split(node.name)
        self._lock = threading.Lock()
        self._changes: list[Changed] = []
        self._worker: Worker[Callable[[], object]] = Worker(f"rosz-events{node.name}")
        with self._lock:  # changes wait until it is known what they change
            self._watch = node.params.watch(node.name, self._changed)
            self._watch.on_end = self._end_call
            try:
                top = node.params.get(node.name, None)
                self._known = dict(_parameters(self._base, top, self._base))
                topic = node.resolve(_TOPIC)
                self._publisher = Publisher(node, topic, ParameterEvent, PARAMETERS)
                if announce:
                    sim_time = {"use_sim_time": to_ros2(node.clock.simulated)}
                    self._publish(sim_time | self._known, {}, {})
            except ClosedError:
                self._watch.close()
                raise

    def close(self) -> None:
        """Publish what has changed, and nothing more; a second call has no effect."""
        self._watch.close()
        self._worker.close()
        self._publisher.close()

    def _changed(self, change: Changed) -> None:
        with self._lock:
            self._changes.append(change)

    def _end_call(self) -> None:
        if self._changes:
            self._worker.submit(self._publish_gathered)

    def _publish_gathered(self) -> None:
        with self._lock:
            changes, self._changes = self._changes, []
        with suppress(ClosedError):  # the node ends
            for _, group in groupby(changes, lambda change: (change.origin, change.time)):
                self._publish_changes(group)

    def _publish_changes(self, changes: Iterable[Changed]) -> None:
        """Publish the changes of one call."""
        known = self._known
        new: dict[str, ParameterValue] = {}
        changed: dict[str, ParameterValue] = {}
        deleted: dict[str, ParameterValue] = {}
        for change in changes:
            path = split(change.name)
            values = dict(_parameters(self._base, change.new, path))
            for name, _ in _parameters(self._base, change.old, path):
                if name not in values and known.pop(name, None) is not None:
                    deleted[name] = ParameterValue()
            for name, value in values.items():
                before = known.get(name)
                if before != value:
                    (new if before is None else changed)[name] = known[name] = value
        if new or changed or deleted:
            self._publish(new, changed, deleted)

    def _publish(self, *groups: dict[str, ParameterValue]) -> None:
        """Publish what is new, what has changed and what is deleted."""
        rows = [[Parameter(*item) for item in group.items()] for group in groups]
        stamp = Time(*divmod(self._node.clock.now(), _SECOND))
        self._publisher.publish(ParameterEvent(stamp, self._node.name, *rows))


def _parameters(
    base: Path, value: Value | None, path: Path
) -> Iterator[tuple[str, ParameterValue]]:
    """Yield the parameters of a node at a path of the store and below it, by their names."""
    for place, item in leaves(value, path):
        if item is not None and len(place) > len(base):
            yield ".".join(place[len(base) :]), to_ros2(item)
