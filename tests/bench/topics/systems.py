"""The systems that are compared, each behind the same few functions.

Imports happen as a system opens: the Python of each has only its own.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from importlib import import_module
from typing import Any, Protocol

__all__ = ("IMAGE_BYTES", "System", "open_system")

IMAGE_BYTES = 1_000_000
RENDEZVOUS = "ROSZ_RENDEZVOUS"
Publish = Callable[[Any], object]
_PAUSE = 0.0005


class System(Protocol):
    """One node of a system; ``kind`` is ``Twist`` or ``Image``."""

    def message(self, kind: str) -> Any:
        """Return a message, an image with `IMAGE_BYTES` of pixels."""

    def publisher(self, topic: str, kind: str) -> Publish:
        """Return what publishes on a topic."""

    def wait_for_subscriber(self) -> None:
        """Wait until somebody subscribes to what was given a publisher last."""

    def subscribe(self, topic: str, kind: str, callback: Callable[[Any], object]) -> None:
        """Have a function called with each message."""

    def serve(self, name: str) -> None:
        """Serve std_srvs/SetBool."""

    def client(self, name: str) -> Callable[[], object]:
        """Return what calls the service once, as soon as somebody serves it."""

    def every(self, seconds: float, callback: Callable[[], object]) -> None:
        """Have a function called by a timer."""

    def close(self) -> None:
        """End the node."""


class Rosz:
    def __init__(self, name: str) -> None:
        self._node = import_module("rosz").Node(name)

    def _type(self, kind: str) -> Any:
        package = "geometry_msgs" if kind == "Twist" else "sensor_msgs"
        return getattr(import_module(f"rosz.msgs.{package}.msg"), kind)

    def message(self, kind: str) -> Any:
        return self._type(kind)(**({} if kind == "Twist" else {"data": bytes(IMAGE_BYTES)}))

    def publisher(self, topic: str, kind: str) -> Publish:
        self._publisher = self._node.publisher(topic, self._type(kind), queue_size=10)
        publish: Publish = self._publisher.publish
        return publish

    def wait_for_subscriber(self) -> None:
        self._publisher.wait_for_subscribers(timeout=30)

    def subscribe(self, topic: str, kind: str, callback: Callable[[Any], object]) -> None:
        self._node.subscription(topic, self._type(kind), callback, queue_size=10)

    def serve(self, name: str) -> None:
        service = import_module("rosz.msgs.std_srvs.srv").SetBool
        self._node.service(name, service, lambda request: (request.data, "done"))

    def client(self, name: str) -> Callable[[], object]:
        module = import_module("rosz.msgs.std_srvs.srv")
        client = self._node.client(name, module.SetBool)
        client.wait_for_service(30)
        return lambda: client(data=True)

    def every(self, seconds: float, callback: Callable[[], object]) -> None:
        self._node.timer(seconds, lambda _: callback())

    def close(self) -> None:
        self._node.close()


class Rospy:
    """Real rospy.

    Args:
        name: Of the node.
        queue_size: Of its publishers; without one, ``publish`` sends before it returns.
    """

    def __init__(self, name: str, queue_size: int | None = 10) -> None:
        self._rospy = import_module("rospy")
        self._queue_size = queue_size
        self._rospy.init_node(name, anonymous=True, disable_signals=True)

    def _type(self, kind: str) -> Any:
        package = "geometry_msgs" if kind == "Twist" else "sensor_msgs"
        return getattr(import_module(f"{package}.msg"), kind)

    def message(self, kind: str) -> Any:
        return self._type(kind)(**({} if kind == "Twist" else {"data": bytes(IMAGE_BYTES)}))

    def publisher(self, topic: str, kind: str) -> Publish:
        self._publisher = self._rospy.Publisher(
            topic, self._type(kind), queue_size=self._queue_size
        )
        publish: Publish = self._publisher.publish
        return publish

    def wait_for_subscriber(self) -> None:
        while not self._publisher.get_num_connections():
            self._rospy.rostime.wallsleep(_PAUSE)

    def subscribe(self, topic: str, kind: str, callback: Callable[[Any], object]) -> None:
        # What images need by rospy's own documentation: a buffer that one fits in.
        buffer = {"buff_size": 2**24} if kind == "Image" else {}
        self._rospy.Subscriber(topic, self._type(kind), callback, queue_size=10, **buffer)

    def serve(self, name: str) -> None:
        service = import_module("std_srvs.srv").SetBool
        self._rospy.Service(name, service, lambda request: (request.data, "done"))

    def client(self, name: str) -> Callable[[], object]:
        self._rospy.wait_for_service(name, 30)
        proxy = self._rospy.ServiceProxy(name, import_module("std_srvs.srv").SetBool)
        return lambda: proxy(data=True)

    def every(self, seconds: float, callback: Callable[[], object]) -> None:
        self._rospy.Timer(self._rospy.Duration(seconds), lambda _: callback())

    def close(self) -> None:
        self._rospy.signal_shutdown("done")


class Zenoh:
    """Bare zenoh-python: bytes as long as the messages, nothing encoded, nothing decoded.

    Args:
        name: Ignored; sessions have none.
        indirect: Whether callbacks run on a Python thread, as is zenoh-python's default, or on
            Zenoh's receiving thread.
    """

    def __init__(self, name: str, *, indirect: bool = True) -> None:
        del name
        self._zenoh = import_module("zenoh")
        self._indirect = indirect
        endpoints = {"endpoints": [os.environ[RENDEZVOUS]], "exit_on_failure": False}
        settings = {
            "mode": "peer",
            "listen": endpoints,
            "connect": {**endpoints, "timeout_ms": 0},
            "scouting": {"multicast": {"enabled": False}},
            "transport": {"shared_memory": {"enabled": False}},
        }
        self._session = self._zenoh.open(self._zenoh.Config.from_json5(json.dumps(settings)))

    def _handler(self, callback: Callable[[Any], object]) -> Any:
        return self._zenoh.handlers.Callback(callback, indirect=self._indirect)

    def message(self, kind: str) -> Any:
        return bytes(52 if kind == "Twist" else IMAGE_BYTES)

    def publisher(self, topic: str, kind: str) -> Publish:
        del kind
        self._publisher = self._session.declare_publisher(topic)
        publish: Publish = self._publisher.put
        return publish

    def wait_for_subscriber(self) -> None:
        pause = import_module("time").sleep
        while not self._publisher.matching_status.matching:
            pause(_PAUSE)

    def subscribe(self, topic: str, kind: str, callback: Callable[[Any], object]) -> None:
        del kind
        handler = self._handler(lambda sample: callback(sample.payload.to_bytes()))
        self._subscriber = self._session.declare_subscriber(topic, handler)

    def serve(self, name: str) -> None:
        def answer(query: Any) -> None:
            query.payload.to_bytes()
            query.reply(name, bytes(16))
            query.drop()

        self._queryable = self._session.declare_queryable(name, self._handler(answer))

    def client(self, name: str) -> Callable[[], object]:
        def call() -> object:
            return [
                reply.ok.payload.to_bytes() for reply in self._session.get(name, payload=bytes(5))
            ]

        while not call():
            pass
        return call

    def every(self, seconds: float, callback: Callable[[], object]) -> None:
        raise NotImplementedError

    def close(self) -> None:
        self._session.close()


def open_system(system: str, name: str) -> System:
    """Return a node of a system by the name of that."""
    if system == "rospy, queue_size=None":
        return Rospy(name, None)
    if system == "zenoh, direct":
        return Zenoh(name, indirect=False)
    if system.startswith("rosz"):
        return Rosz(name)
    return Rospy(name) if system == "rospy" else Zenoh(name)
