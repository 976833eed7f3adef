"""The client of dynamic_reconfigure: it reads and changes the settings of another node."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from copy import deepcopy
from typing import TYPE_CHECKING, Any, Final, TypeVar

from rosz.errors import ClosedError, WaitTimeout, near_miss
from rosz.lifecycle import Closing
from rosz.msgs.dynamic_reconfigure.msg import Config as ConfigMessage
from rosz.msgs.dynamic_reconfigure.msg import ConfigDescription, GroupState
from rosz.msgs.dynamic_reconfigure.srv import Reconfigure
from rosz.reconfigure.description import Config, Description
from rosz.reconfigure.messages import (
    DESCRIPTIONS,
    SET,
    UPDATES,
    pack_values,
    unpack_description,
    unpack_states,
    unpack_values,
)

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.node import Node

_T = TypeVar("_T")

_UPDATE_TIMEOUT: Final = 0.5
"""Seconds that a change waits to receive its own update, so that older ones come before it."""

_SERVICE_TIMEOUT: Final = 2.0
"""Seconds that a change waits for the service of a server whose description was received."""

_MAX_RECEIVED: Final = 20
"""Configurations remembered as received."""

_BUSY: Final = "the node is busy, stopped or out of reach"


def find_servers(view: View) -> list[str]:
    """Return the sorted names of all servers, which are mostly those of their nodes.

    A service ``set_parameters`` of another type, which every ROS 2 node has, is not a server.
    """
    return sorted(
        name.removesuffix(f"/{SET}")
        for name, types in view.services().items()
        if name.endswith(f"/{SET}") and Reconfigure._type_name in types
    )


class Client(Closing):
    """Reads and changes the settings of another node, and is notified when they change.

    It may be created before the server, and outlives it: it goes on with a server that is started
    again under the same name. No call waits longer than its timeout.

    Args:
        node: Node of the client.
        name: Name of the server, mostly that of its node.
        timeout: Default time limit in seconds of each call.
        config_callback: Function called with the current configuration, and with each later one.
        description_callback: Function called with the description of the settings.

    Raises:
        InvalidName: The name is not legal.
        ClosedError: The node is closed.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        *,
        timeout: float = 10.0,
        config_callback: Callable[[Config], object] | None = None,
        description_callback: Callable[[Description], object] | None = None,
    ) -> None:
        self.node = node
        self.name: str = node.resolve(name).rstrip("/")
        self.timeout = timeout
        self.config_callback = config_callback
        self.description_callback = description_callback
        self._changed = threading.Condition()
        self._turn = threading.Lock()
        self._notifying_thread = 0
        self._closed = False
        self._description: Description | None = None
        self._message: ConfigMessage | None = None
        self._config: Config | None = None
        self._received: deque[Config] = deque(maxlen=_MAX_RECEIVED)
        with ExitStack() as stack:
            self._service = stack.enter_context(
                node.client(f"{self.name}/{SET}", Reconfigure, timeout=timeout)
            )
            for topic, kind, callback in (
                (DESCRIPTIONS, ConfigDescription, self._on_description),
                (UPDATES, ConfigMessage, self._on_update),
            ):
                stack.enter_context(node.subscription(f"{self.name}/{topic}", kind, callback))
            self._parts = stack.pop_all()
        node.keep(self)

    def wait(self, timeout: float | None = None) -> None:
        """Wait for the server.

        Args:
            timeout: Time limit in seconds; that of the client by default.

        Raises:
            WaitTimeout: It did not appear in time; the message names servers with similar names.
            ClosedError: The node was closed meanwhile.
        """
        limit = self.timeout if timeout is None else timeout
        try:
            self._service.wait_for_service(limit)
        except WaitTimeout as error:
            raise self._no_server(limit) from error

    def description(self, timeout: float | None = None) -> Description:
        """Return the description of the settings; wait for it if it has not been received.

        Args:
            timeout: Time limit in seconds; that of the client by default.

        Raises:
            WaitTimeout: The server did not send it in time.
            ClosedError: The client was closed meanwhile.
        """
        return self._wait_for(lambda: self._description, "description of the settings", timeout)

    def config(self, timeout: float | None = None) -> Config:
        """Return a copy of the current configuration; wait for it if it has not been received.

        Args:
            timeout: Time limit in seconds; that of the client by default.

        Raises:
            WaitTimeout: The server did not send it in time.
            ClosedError: The client was closed meanwhile.
        """
        return deepcopy(self._wait_for(lambda: self._config, "configuration", timeout))

    def update(self, changes: Mapping[str, Any], timeout: float | None = None) -> Config:
        """Change settings.

        Args:
            changes: New values by name. They are converted to the type of the setting, so texts and
                names of choices are accepted. ``groups`` holds states of groups by name.
            timeout: Time limit in seconds of the whole call; that of the client by default.

        Returns:
            The configuration after the change. The server limits values to their bounds, and may
            choose other values.

        Raises:
            ParamError: The setting does not exist, or a value cannot be converted.
            ServiceNotFound: The server is gone.
            ServiceError: The server refused the change.
            WaitTimeout: The server did not reply in time.
            ClosedError: The client was closed meanwhile.
        """
        limit = self.timeout if timeout is None else timeout
        deadline = time.monotonic() + limit
        description = self.description(limit)
        request = pack_values(description.convert(changes))
        if "groups" in changes:
            states = description.read_states(changes["groups"])
            request.groups = [
                GroupState(group.name, states[group.id], group.id, parent)
                for group, parent in description.groups
                if group.id in states
            ]
        # The server has sent its description; its service may be discovered a moment later.
        with suppress(WaitTimeout):
            self._service.wait_for_service(min(limit, _SERVICE_TIMEOUT))
        try:
            response = self._service.call(
                Reconfigure.Request(request), max(deadline - time.monotonic(), 0.0)
            )
        except WaitTimeout as error:
            raise WaitTimeout(error.what, limit, _BUSY) from error
        return self._accept(_decode(description, response.config), deadline)

    def update_groups(self, states: Mapping[str, bool], timeout: float | None = None) -> Config:
        """Change whether groups are shown, by name; see `update`."""
        return self.update({"groups": states}, timeout)

    def close(self) -> None:
        """Stop receiving; a second call has no effect."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._parts.close()
        self.node.forget(self)

    def _accept(self, config: Config, deadline: float) -> Config:
        """Make the response to a change current, after the updates that were sent before it."""
        with self._changed:
            if threading.get_ident() != self._notifying_thread:  # which would wait for itself
                self._changed.wait_for(
                    lambda: config in self._received or self._closed,
                    min(_UPDATE_TIMEOUT, max(deadline - time.monotonic(), 0.0)),
                )
            if config not in self._received:
                self._config = config
        return deepcopy(config)

    def _wait_for(self, get: Callable[[], _T | None], what: str, timeout: float | None) -> _T:
        limit = self.timeout if timeout is None else timeout
        with self._changed:
            self._changed.wait_for(lambda: self._closed or get() is not None, limit)
            value = get()
            if value is not None:
                return value
            if self._closed:
                raise ClosedError(f"the client of '{self.name}' is closed")
        if self.name not in find_servers(self.node.context.graph.refresh()):
            raise self._no_server(limit)
        raise WaitTimeout(f"{what} from '{self.name}'", limit, _BUSY)

    def _no_server(self, timeout: float) -> WaitTimeout:
        servers = find_servers(self.node.context.graph.refresh())
        listing = (
            f"there are {', '.join(servers)}" if servers else "no node has any on this network"
        )
        hint = near_miss(self.name, servers).removeprefix("; ") or listing
        return WaitTimeout(f"node with settings under '{self.name}'", timeout, hint)

    def _on_description(self, message: ConfigDescription) -> None:
        description = unpack_description(message)
        with self._one_callback():
            with self._changed:
                self._description = description
                self._changed.notify_all()
            if self.description_callback is not None:
                self.description_callback(description)
            if self._message is not None:
                self._notify(description, self._message)

    def _on_update(self, message: ConfigMessage) -> None:
        with self._one_callback():
            self._message = message
            if self._description is not None:
                self._notify(self._description, message)

    @contextmanager
    def _one_callback(self) -> Iterator[None]:
        """Call callbacks one at a time, whichever topic they belong to."""
        with self._turn:
            self._notifying_thread = threading.get_ident()
            try:
                yield
            finally:
                self._notifying_thread = 0

    def _notify(self, description: Description, message: ConfigMessage) -> None:
        config = _decode(description, message)
        with self._changed:
            self._config = config
            self._received.append(config)
            self._changed.notify_all()
        if self.config_callback is not None:
            self.config_callback(deepcopy(config))

    def __repr__(self) -> str:
        return f"<Client of {self.name}>"


def _decode(description: Description, message: ConfigMessage) -> Config:
    described = {
        n: value for n, value in unpack_values(message).items() if n in description.settings
    }
    values = description.defaults() | description.convert(described)
    return description.config(values, unpack_states(message))
