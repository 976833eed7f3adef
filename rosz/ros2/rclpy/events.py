"""rclpy.event_handler and rclpy.guard_condition: callbacks for what is not data.

The events are those of rmw_zenoh: who is matched, samples that were lost, and types that differ.
It has no deadlines and no liveliness policies, and all QoS profiles are compatible there.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import msgspec

from rosz.errors import RoszError
from rosz.lifecycle import Registration
from rosz.node import Publisher, Subscription
from rosz.ros2.rclpy.executors import CallbackGroup
from rosz.wire import Token

_KINDS = ("matched", "incompatible_type", "incompatible_qos", "deadline", "liveliness")


class UnsupportedEventTypeError(RoszError):
    """The middleware has no such event."""


class GuardCondition:
    """A callback that a program triggers; made by ``Node.create_guard_condition``."""

    def __init__(
        self, callback: Callable[[], Any] | None, group: CallbackGroup, wake: Callable[[], None]
    ) -> None:
        self.callback: Callable[[], Any] | None = callback
        self.callback_group: CallbackGroup = group
        self._wake = wake
        self._triggered = False

    def trigger(self) -> None:
        """Let the executor call the callback; any thread may call this."""
        self._triggered = True
        self._wake()

    def take(self) -> Callable[[], Any] | None:
        """Return the callback if the condition was triggered."""
        if not self._triggered:
            return None
        self._triggered = False
        return self.callback

    def destroy(self) -> None:
        """Forget the callback."""
        self._triggered, self.callback = False, None


class MatchedInfo(msgspec.Struct, frozen=True):
    """The other ends of a publisher or subscription.

    Attributes:
        total_count: Number of those that there have been.
        total_count_change: Growth of that number since the last callback.
        current_count: Number of those that there are.
        current_count_change: Change of that number since the last callback.
    """

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


class MessageLostInfo(msgspec.Struct, frozen=True):
    """The messages that a subscription missed.

    Attributes:
        total_count: Number of lost messages.
        total_count_change: Growth of that number since the last callback.
    """

    total_count: int
    total_count_change: int


class IncompatibleTypeInfo(MessageLostInfo, frozen=True):
    """The other ends whose types differ."""


class EventHandler:
    """Call a function with the counts of an event.

    Args:
        callback: Function that gets an instance of ``kind``.
        kind: `MatchedInfo`, `MessageLostInfo` or `IncompatibleTypeInfo`.
        group: Group of the callback.
        wake: Function that makes the executor look for ready callbacks.
    """

    def __init__(
        self,
        callback: Callable[[Any], Any],
        kind: type[Any],
        group: CallbackGroup,
        wake: Callable[[], None],
    ) -> None:
        self.callback: Callable[[Any], Any] = callback
        self.callback_group: CallbackGroup = group
        self._kind = kind
        self._wake = wake
        self._lock = threading.Lock()
        self._total = self._current = 0
        self._reported = 0, 0

    def count(self, change: int) -> None:
        """Count ends or messages that came, or, below 0, ends that went; on any thread."""
        with self._lock:
            self._total += max(change, 0)
            self._current += change
        self._wake()

    def take(self) -> Callable[[], Any] | None:
        """Return a function that calls the callback if there was an event since the last time."""
        with self._lock:
            counts = self._total, self._current
            total, current = (
                now - before for now, before in zip(counts, self._reported, strict=True)
            )
            if not total and not current:
                return None
            self._reported = counts
        values = (counts[0], total, counts[1], current)
        info = self._kind(*values[: len(self._kind.__struct_fields__)])
        return lambda: self.callback(info)


class _EventCallbacks:
    """Callbacks by the names of events; each may be None.

    Args:
        use_default_callbacks: Not used: rosz logs types that differ in any case.
        callbacks: Callbacks of ``matched``, ``incompatible_type``, ``incompatible_qos``,
            ``deadline`` and ``liveliness``, and of a subscription's ``message_lost``.

    Raises:
        TypeError: There is no such event.
    """

    _kinds: tuple[str, ...] = _KINDS

    def __init__(
        self, *, use_default_callbacks: bool = True, **callbacks: Callable[[Any], Any] | None
    ) -> None:
        unknown = callbacks.keys() - set(self._kinds)
        if unknown:
            raise TypeError(
                f"{type(self).__name__} has no '{min(unknown)}'; expected {', '.join(self._kinds)}"
            )
        self.use_default_callbacks: bool = use_default_callbacks
        for name in self._kinds:
            setattr(self, name, callbacks.get(name))


class PublisherEventCallbacks(_EventCallbacks):
    """The callbacks for the events of a publisher."""


class SubscriptionEventCallbacks(_EventCallbacks):
    """The callbacks for the events of a subscription."""

    _kinds = (*_KINDS, "message_lost")


def handlers_of(
    entity: Publisher[Any] | Subscription[Any],
    callbacks: _EventCallbacks | None,
    group: CallbackGroup,
    wake: Callable[[], None],
) -> dict[str, EventHandler]:
    """Return the handlers of an entity's events by their names; all but lost messages count.

    Raises:
        UnsupportedEventTypeError: There is a callback for deadlines or liveliness; the entity is
            closed.
    """
    given = {} if callbacks is None else vars(callbacks)
    for name in ("deadline", "liveliness"):
        if given.get(name) is not None:
            entity.close()
            raise UnsupportedEventTypeError(
                f"'{entity.name}' has no {name} events: Zenoh, as with rmw_zenoh, reports none"
            )
    handlers = {
        name: EventHandler(given[name], kind, group, wake)
        for name, kind in _INFOS.items()
        if given.get(name) is not None
    }

    def changed(token: Token, alive: bool) -> None:
        if entity.matches(token):
            if "matched" in handlers:
                handlers["matched"].count(1 if alive else -1)
        elif alive and "incompatible_type" in handlers:
            handlers["incompatible_type"].count(1)

    if handlers:
        entity.keep(Registration(entity.others.listen(changed)))
    return handlers


_INFOS = {
    "matched": MatchedInfo,
    "incompatible_type": IncompatibleTypeInfo,
    "message_lost": MessageLostInfo,
}
