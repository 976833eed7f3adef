"""smach_ros.introspection: shows containers to smach_viewer, and lets it set where they begin.

Below the name of a server there are the topics ``smach/container_structure``,
``smach/container_status`` and ``smach/container_init``. User data travels as in ROS 1: a pickled
dictionary in base64. A program that reads a pickle executes the code in it.
"""

from __future__ import annotations

import base64
import pickle
import threading
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from rosz.msgs.smach_msgs import msg
from rosz.msgs.std_msgs.msg import Header
from rosz.ros1.client import rospy
from rosz.ros1.libraries.smach import Container, UserData
from rosz.ros1.tools import rostopic

STATUS_TOPIC = "/smach/container_status"
INIT_TOPIC = "/smach/container_init"
STRUCTURE_TOPIC = "/smach/container_structure"

_PICKLE_PROTOCOL = 2
_UPDATE_SECONDS = 2.0
_RETRY_SECONDS = 0.3
_CHECK_SECONDS = 0.1


def _packed(userdata: UserData) -> str:
    """Return user data as text; values that cannot be pickled are left out."""
    values = dict(userdata._data)  # noqa: SLF001  # its keys need not be names
    try:
        data = pickle.dumps(values, _PICKLE_PROTOCOL)
    except (pickle.PicklingError, TypeError, AttributeError):
        data = pickle.dumps({k: v for k, v in values.items() if _is_plain(v)}, _PICKLE_PROTOCOL)
    return base64.b64encode(data).decode()


def _is_plain(value: Any) -> bool:
    try:
        pickle.dumps(value, _PICKLE_PROTOCOL)
    except (pickle.PicklingError, TypeError, AttributeError):
        return False
    return True


def _unpacked(text: str) -> UserData:
    """Return the user data of a message."""
    userdata = UserData()
    values = pickle.loads(base64.b64decode(text))  # noqa: S301  # smach's own format
    for key, value in values.items():
        userdata[key] = value
    return userdata


class IntrospectionClient:
    """See and set the initial states of containers of other nodes."""

    def get_servers(self) -> list[str]:
        """Return the names of all introspection servers."""
        topics = rostopic.find_by_type("smach_msgs/SmachContainerStatus")
        return [topic.removesuffix(STATUS_TOPIC) for topic in topics]

    def set_initial_state(
        self,
        server: str,
        path: str,
        initial_states: Sequence[str],
        initial_userdata: UserData | None = None,
        timeout: Any = None,
    ) -> bool | None:
        """Set where a container begins.

        Args:
            server: Name of its introspection server.
            path: Path of the container, such as ``/TOP/INNER``.
            initial_states: Label of the state to begin with.
            initial_userdata: Values to take over.
            timeout: Longest time to wait until the container confirms.

        Returns:
            Whether it confirmed; None without a timeout.
        """
        values = UserData() if initial_userdata is None else initial_userdata
        command = msg.SmachContainerInitialStatusCmd(path, list(initial_states), _packed(values))
        confirmed = threading.Event()

        def receive(status: msg.SmachContainerStatus) -> None:
            if status.path == path and set(initial_states) <= set(status.initial_states):
                there = _unpacked(status.local_data)
                if all(key in there and there[key] == values[key] for key in values.keys()):  # noqa: SIM118
                    confirmed.set()

        subscriber = rospy.Subscriber(server + STATUS_TOPIC, msg.SmachContainerStatus, receive)
        publisher = rospy.Publisher(
            server + INIT_TOPIC, msg.SmachContainerInitialStatusCmd, queue_size=1
        )
        publisher.publish(command)
        if timeout is None:
            return None
        limit = rospy.Time.now() + timeout
        while not confirmed.wait(_RETRY_SECONDS) and rospy.Time.now() < limit:
            publisher.publish(command)
        subscriber.unregister()
        return confirmed.is_set()


class ContainerProxy:
    """Publishes the structure and the state of one container.

    The state is published again after each ``update_rate``, a duration; 2 s when not given.
    """

    def __init__(
        self, server_name: str, container: Container, path: str, update_rate: Any = None
    ) -> None:
        self._path, self._container = path, container
        self._update_seconds = _UPDATE_SECONDS if update_rate is None else update_rate.to_sec()
        self._status_pub_lock = threading.Lock()
        self._stopped = threading.Event()
        self._structure_pub = rospy.Publisher(
            server_name + STRUCTURE_TOPIC, msg.SmachContainerStructure, queue_size=1
        )
        self._status_pub = rospy.Publisher(
            server_name + STATUS_TOPIC, msg.SmachContainerStatus, queue_size=1
        )
        self._init_cmd = rospy.Subscriber(
            server_name + INIT_TOPIC, msg.SmachContainerInitialStatusCmd, self._init_cmd_cb
        )
        container.register_transition_cb(self._transition_cb)

    def start(self) -> None:
        """Publish from time to time, on threads."""
        for publish in self._publish_status, self._publish_structure:
            threading.Thread(target=partial(self._repeat, publish), daemon=True).start()

    def stop(self) -> None:
        """Stop publishing."""
        self._stopped.set()
        self._init_cmd.unregister()

    def _repeat(self, publish: Callable[[str], None]) -> None:
        while not self._stopped.is_set() and not rospy.is_shutdown():
            publish("HEARTBEAT")
            limit = rospy.Time.now() + rospy.Duration.from_sec(self._update_seconds)
            while rospy.Time.now() < limit and not rospy.is_shutdown():
                if self._stopped.wait(_CHECK_SECONDS):
                    return

    def _publish_structure(self, _info: str = "") -> None:
        edges = [tuple(map(str, edge)) for edge in self._container.get_internal_edges()]
        self._structure_pub.publish(
            msg.SmachContainerStructure(
                Header(stamp=rospy.Time.now()),
                self._path,
                list(self._container.get_children()),
                [outcome for outcome, _, _ in edges],
                [source for _, source, _ in edges],
                [target for _, _, target in edges],
                list(self._container.get_registered_outcomes()),
            )
        )

    def _publish_status(self, info: str = "") -> None:
        with self._status_pub_lock:
            self._status_pub.publish(
                msg.SmachContainerStatus(
                    Header(stamp=rospy.Time.now()),
                    self._path,
                    self._container.get_initial_states(),
                    self._container.get_active_states(),
                    _packed(self._container.userdata),
                    info,
                )
            )

    def _transition_cb(self, *args: Any, **kwargs: Any) -> None:
        self._publish_status(f"{args}, {kwargs}")

    def _init_cmd_cb(self, message: msg.SmachContainerInitialStatusCmd) -> None:
        if message.path != self._path:
            return
        children = self._container.get_children()
        if not set(message.initial_states) <= children.keys():
            rospy.logerr(
                f"container '{self._path}' cannot begin with {message.initial_states}: it has"
                f" {list(children)}"
            )
            return
        self._container.set_initial_state(message.initial_states, _unpacked(message.local_data))
        self._publish_status("REMOTE_INIT")


class IntrospectionServer:
    """Shows a container, and all containers in it.

    Args:
        server_name: Name of the server, below which its topics are.
        state: The outermost container.
        path: Path of that container, such as ``/TOP``.
    """

    def __init__(self, server_name: str, state: Container, path: str) -> None:
        self._server_name, self._state, self._path = server_name, state, path
        self._proxies: list[ContainerProxy] = []

    def start(self) -> None:
        """Begin to publish."""
        self.construct(self._server_name, self._state, self._path)

    def stop(self) -> None:
        """Stop publishing."""
        for proxy in self._proxies:
            proxy.stop()

    def construct(self, server_name: str, state: Container, path: str) -> None:
        """Show a container at a path, and all containers in it."""
        proxy = ContainerProxy(server_name, state, path)
        for label, child in state.get_children().items():
            if isinstance(child, Container):
                self.construct(server_name, child, f"{path.removesuffix('/')}/{label}")
        proxy._publish_status("Initial state")  # noqa: SLF001  # of this module
        proxy.start()
        self._proxies.append(proxy)

    def clear(self) -> None:
        """Forget all containers."""
        self._proxies = []
