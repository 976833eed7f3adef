"""bondpy: two processes that notice when the other one ends (ROS wiki, bondpy).

Both ends publish bond/Status on one topic: every second that they live, and then that they die. One
thread of a bond publishes and watches the time limits.
"""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable
from time import monotonic
from types import ModuleType
from typing import Any

from rosz.msgs.bond.msg import Constants, Status
from rosz.ros1.client import rospy

__all__ = ("bondpy",)

bondpy: ModuleType  # built by the importer

Callback = Callable[[], Any]

_WAITING = "SM.WaitingForSister"
_ALIVE = "SM.Alive"
_DYING = "SM.AwaitSisterDeath"
_DEAD = "SM.Dead"

# For a state and an event, the actions of the bond and its next state. Other pairs change nothing.
_TRANSITIONS: dict[tuple[str, str], tuple[tuple[str, ...], str]] = {
    (_WAITING, "connect timeout"): (("die",), _DEAD),
    (_WAITING, "break"): (("die",), _DEAD),
    (_WAITING, "other alive"): (("connect",), _ALIVE),
    (_WAITING, "other dead"): (("connect", "answer", "die"), _DEAD),
    (_ALIVE, "break"): (("start dying",), _DYING),
    (_ALIVE, "heartbeat timeout"): (("die",), _DEAD),
    (_ALIVE, "other alive"): (("hear",), _ALIVE),
    (_ALIVE, "other dead"): (("answer", "die"), _DEAD),
    (_DYING, "disconnect timeout"): (("die",), _DEAD),
    (_DYING, "other dead"): (("die",), _DEAD),
}
_LOOK = 0.1
"""Seconds between two looks at whether the node is shut down."""


def as_ros_duration(d: Any) -> Any:
    """Return seconds as a Duration."""
    return d if isinstance(d, rospy.Duration) else rospy.Duration.from_sec(d)


def as_float_duration(d: Any) -> float:
    """Return a Duration as seconds."""
    return d.to_sec() if isinstance(d, rospy.Duration) else float(d)


def _limit(name: str) -> Any:
    """Return a property for a time; it is set before the start, and is seconds or a Duration."""

    def get(self: Bond) -> Any:
        return self._times[name]

    def put(self: Bond, value: Any) -> None:
        if self.sub is not None:
            raise AssertionError(f"{name} is set before start(); bond {self.id} has started")
        self._times[name] = value

    return property(get, put)


def _setter(name: str) -> Callable[[Bond, Any], None]:
    def put(self: Bond, dur: Any) -> None:
        setattr(self, name, dur)

    put.__doc__ = f"Set ``{name}``, before the bond has started."
    return put


class Bond:
    """A bond with another process.

    Args:
        topic: Topic of the messages, the same at both ends.
        id: Name of the bond, the same at both ends.
        on_broken: Function that is called when the bond is broken.
        on_formed: Function that is called when both ends have heard of each other.

    Attributes:
        connect_timeout: Seconds or Duration that the other end has to appear; 10.
        heartbeat_timeout: Seconds or Duration of silence after which the other end is dead; 4.
        disconnect_timeout: Seconds or Duration that the other end has to answer a break; 2.
        heartbeat_period: Seconds or Duration between two messages; 1.
        instance_id: Identifier of this end.
        sister_instance_id: Identifier of the other end; None until it is heard.
        sister_died_first: Whether the other end broke the bond; it is answered each time.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
    """

    connect_timeout = _limit("connect_timeout")
    heartbeat_timeout = _limit("heartbeat_timeout")
    disconnect_timeout = _limit("disconnect_timeout")
    heartbeat_period = _limit("heartbeat_period")
    set_connect_timeout = _setter("connect_timeout")
    set_heartbeat_timeout = _setter("heartbeat_timeout")
    set_disconnect_timeout = _setter("disconnect_timeout")
    set_heartbeat_period = _setter("heartbeat_period")

    def __init__(
        self,
        topic: str,
        id: str,  # noqa: A002  # ROS 1's
        on_broken: Callback | None = None,
        on_formed: Callback | None = None,
    ) -> None:
        self.topic = topic
        self.id = id
        self.instance_id = str(uuid.uuid4())
        self.sister_instance_id: str | None = None
        self.on_broken = on_broken
        self.on_formed = on_formed
        self.is_shutdown = False
        self.sister_died_first = False
        self.lock = threading.RLock()
        self.condition = threading.Condition(self.lock)
        self.sub: Any = None
        self.pub = rospy.Publisher(topic, Status, queue_size=1)
        self._times: dict[str, Any] = {
            "connect_timeout": Constants.DEFAULT_CONNECT_TIMEOUT,
            "heartbeat_timeout": Constants.DEFAULT_HEARTBEAT_TIMEOUT,
            "disconnect_timeout": Constants.DEFAULT_DISCONNECT_TIMEOUT,
            "heartbeat_period": Constants.DEFAULT_HEARTBEAT_PERIOD,
        }
        self._state = _WAITING
        self._deadlines: dict[str, float] = {}
        self._callbacks: list[Callback] = []

    def start(self) -> None:
        """Begin to publish, and to listen for the other end."""
        with self.lock:
            self._set_deadline("connect timeout")
            self.sub = rospy.Subscriber(self.topic, Status, self._on_bond_status)
            self.thread = threading.Thread(target=self._run, name=f"bond {self.id}", daemon=True)
            self.thread.start()

    def shutdown(self) -> None:
        """Break the bond, and stop to publish and to listen."""
        with self.lock:
            if self.is_shutdown:
                return
            if self._state != _DEAD:
                self._happens("break")
                self._publish(active=False)
            self.is_shutdown = True
            self.pub.unregister()
            self.condition.notify_all()
        if self.sub is not None:
            self.sub.unregister()
        self._call()

    def break_bond(self) -> None:
        """Break the bond; the other end is told."""
        with self.lock:
            if not self.is_shutdown:
                self._happens("break")
                self._publish(active=False)
        self._call()

    def is_broken(self) -> bool:
        """Return whether the bond is broken."""
        with self.lock:
            return self._state == _DEAD

    def set_formed_callback(self, on_formed: Callback | None) -> None:
        """Set the function that is called when the bond is formed."""
        with self.lock:
            self.on_formed = on_formed

    def set_broken_callback(self, on_broken: Callback | None) -> None:
        """Set the function that is called when the bond is broken."""
        with self.lock:
            self.on_broken = on_broken

    def wait_until_formed(self, timeout: Any = None) -> bool:
        """Wait until the bond was formed; return whether it was, or is broken.

        Args:
            timeout: Time limit as a Duration or seconds; none when not given.
        """
        return self._wait(lambda: self._state != _WAITING, timeout)

    def wait_until_broken(self, timeout: Any = None) -> bool:
        """Wait until the bond is broken; return whether it is; see `wait_until_formed`."""
        return self._wait(lambda: self._state == _DEAD, timeout)

    def __repr__(self) -> str:
        return f"[Bond {self.id}, Instance {self.instance_id} ({self._state})]"

    def _wait(self, condition: Callable[[], bool], timeout: Any) -> bool:
        end = monotonic() + as_float_duration(timeout) if timeout else None
        with self.lock:
            while not condition() and not rospy.is_shutdown():
                left = _LOOK if end is None else min(_LOOK, end - monotonic())
                if left <= 0:
                    break
                self.condition.wait(left)
            return condition()

    def _on_bond_status(self, msg: Status) -> None:
        if msg.id != self.id or msg.instance_id == self.instance_id:
            return
        with self.lock:
            if self.is_shutdown:
                return
            self.sister_instance_id = self.sister_instance_id or msg.instance_id
            if msg.instance_id != self.sister_instance_id:
                rospy.logerr(
                    "bond %s on %s has a third end, %s; a bond has two",
                    *(self.id, self.topic, msg.instance_id),
                )
                return
            self._happens("other alive" if msg.active else "other dead")
            if self.sister_died_first and not msg.active:
                self._publish(active=False)
        self._call()

    def _happens(self, event: str) -> None:
        """Take the transition of an event; the lock is held."""
        actions, self._state = _TRANSITIONS.get((self._state, event), ((), self._state))
        for action in actions:
            if action == "connect":
                self._deadlines.clear()
                self._set_deadline("heartbeat timeout")
                self._note(self.on_formed)
            elif action == "hear":
                self._set_deadline("heartbeat timeout")
            elif action == "answer":
                self.sister_died_first = True
            elif action == "start dying":
                self._deadlines.clear()
                self._set_deadline("disconnect timeout")
            else:
                self._deadlines.clear()
                self._note(self.on_broken)
        self.condition.notify_all()

    def _set_deadline(self, event: str) -> None:
        seconds = as_float_duration(self._times[event.replace(" ", "_")])
        self._deadlines[event] = monotonic() + seconds

    def _note(self, callback: Callback | None) -> None:
        if callback is not None:
            self._callbacks.append(callback)

    def _call(self) -> None:
        """Call the callbacks that are due; the lock is not held."""
        with self.lock:
            callbacks, self._callbacks = self._callbacks, []
        for callback in callbacks:
            callback()

    def _publish(self, *, active: bool) -> None:
        status = Status(
            id=self.id,
            instance_id=self.instance_id,
            active=active,
            heartbeat_timeout=as_float_duration(self.heartbeat_timeout),
            heartbeat_period=as_float_duration(self.heartbeat_period),
        )
        status.header.stamp = rospy.Time.now()
        self.pub.publish(status)

    def _run(self) -> None:
        """Publish, and watch the time limits, until the bond is broken."""
        publish_at, state = 0.0, ""
        while True:
            with self.lock:
                if self.is_shutdown or self._state == _DEAD or rospy.is_shutdown():
                    return
                now = monotonic()
                if now >= publish_at or state != self._state:
                    state, dying = self._state, self._state == _DYING
                    period = Constants.DEAD_PUBLISH_PERIOD if dying else self.heartbeat_period
                    publish_at = now + as_float_duration(period)
                    self._publish(active=not dying)
                due = min((at, event) for event, at in self._deadlines.items())
                if now < due[0]:
                    self.condition.wait(min(publish_at, due[0]) - now)
                    continue
                del self._deadlines[due[1]]
            self._expire(due[1])

    def _expire(self, event: str) -> None:
        if event == "heartbeat timeout" and rospy.get_param(
            Constants.DISABLE_HEARTBEAT_TIMEOUT_PARAM, default=False
        ):
            rospy.logwarn(
                "bond %s on %s is silent, and stays since %s is set",
                *(self.id, self.topic, Constants.DISABLE_HEARTBEAT_TIMEOUT_PARAM),
            )
            with self.lock:
                if event not in self._deadlines and self._state == _ALIVE:
                    self._set_deadline(event)
            return
        with self.lock:
            if event not in self._deadlines:  # it was not heard in the meantime
                self._happens(event)
        self._call()
