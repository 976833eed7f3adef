"""The end that reads and changes the settings of another node."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from copy import deepcopy
from typing import TYPE_CHECKING, Any, Final, Self

from rosz.errors import ClosedError, WaitTimeout, near_miss
from rosz.msgs.dynamic_reconfigure.msg import Config as ConfigMessage
from rosz.msgs.dynamic_reconfigure.msg import ConfigDescription, GroupState
from rosz.msgs.dynamic_reconfigure.srv import Reconfigure
from rosz.reconfigure.config import Config
from rosz.reconfigure.description import Description
from rosz.reconfigure.messages import (
    pack_values,
    unpack_description,
    unpack_states,
    unpack_values,
)
from rosz.reconfigure.servers import DESCRIPTIONS, SET, UPDATES, find_servers

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.node import Node

__all__ = ("Client",)

_ECHO_BY: Final = 0.5
"""Seconds that a change waits for its own announcement, so that older ones come before it."""

_SERVICE_BY: Final = 2.0
"""Seconds that a change waits for the service of a server that was heard of."""

_HEARD: Final = 20
"""Announcements remembered."""

_BUSY: Final = "the node is busy, stopped or out of reach"


class Client:
    """Reads and changes the settings of another node, and is told when they change.

    It may be made before the server is there, and outlives it: a server that is started again
    under the same name is followed on. No call waits longer than its timeout.

    Args:
        node: Who asks.
        name: Name of the server, mostly that of its node.
        timeout: Seconds that each call waits at most, unless it says otherwise.
        config_callback: Gets the configuration that holds, and each one that holds from then on.
        description_callback: Gets the description of what there is to set.

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
        self.name = node.resolve(name).rstrip("/")
        self.timeout = timeout
        self.config_callback = config_callback
        self.description_callback = description_callback
        self._changed = threading.Condition()
        self._turn = threading.Lock()
        self._teller = 0
        self._closed = False
        self._description: Description | None = None
        self._message: ConfigMessage | None = None
        self._config: Config | None = None
        self._heard: deque[Config] = deque(maxlen=_HEARD)
        with ExitStack() as stack:
            self._service = stack.enter_context(
                node.client(f"{self.name}/{SET}", Reconfigure, timeout=timeout)
            )
            for topic, kind, heard in (
                (DESCRIPTIONS, ConfigDescription, self._on_description),
                (UPDATES, ConfigMessage, self._on_update),
            ):
                stack.enter_context(node.subscription(f"{self.name}/{topic}", kind, heard))
            self._parts = stack.pop_all()
        node.keep(self)

    def wait(self, timeout: float | None = None) -> None:
        """Wait until the server is there.

        Args:
            timeout: Seconds; the client's own when not given.

        Raises:
            WaitTimeout: It did not come in time; the message names servers of a similar name.
            ClosedError: The node was closed meanwhile.
        """
        limit = self.timeout if timeout is None else timeout
        try:
            self._service.wait_for_service(limit)
        except WaitTimeout as error:
            raise self._nobody(limit) from error

    def description(self, timeout: float | None = None) -> Description:
        """Return what there is to set, waiting for the server to tell.

        Args:
            timeout: Seconds; the client's own when not given.

        Raises:
            WaitTimeout: It did not tell in time.
            ClosedError: The client was closed meanwhile.
        """
        self._wait_for(
            lambda: self._description is not None, "description of the settings", timeout
        )
        assert self._description is not None  # noqa: S101  # what was waited for
        return self._description

    def config(self, timeout: float | None = None) -> Config:
        """Return the configuration that holds, a copy, waiting for the server to tell.

        Args:
            timeout: Seconds; the client's own when not given.

        Raises:
            WaitTimeout: It did not tell in time.
            ClosedError: The client was closed meanwhile.
        """
        self._wait_for(lambda: self._config is not None, "configuration", timeout)
        assert self._config is not None  # noqa: S101  # what was waited for
        return deepcopy(self._config)

    def update(self, changes: Mapping[str, Any], timeout: float | None = None) -> Config:
        """Change settings.

        Args:
            changes: Name to value; converted to the setting's type, so that texts may be given,
                and names of choices. ``groups`` holds states of groups by name.
            timeout: Seconds for all of it; the client's own when not given.

        Returns:
            The configuration that holds then. The server brings values within their bounds, and
            may decide on others.

        Raises:
            ParamError: There is no such setting, or a value cannot be one of it.
            ServiceNotFound: The server is gone.
            ServiceError: The server refused.
            WaitTimeout: It did not answer in time.
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
        # The server told what it has; the way to its service may be a moment behind.
        with suppress(WaitTimeout):
            self._service.wait_for_service(min(limit, _SERVICE_BY))
        try:
            answer = self._service.call(
                Reconfigure.Request(request), max(deadline - time.monotonic(), 0.0)
            )
        except WaitTimeout as error:
            raise WaitTimeout(error.what, limit, _BUSY) from error
        return self._settle(_decoded(description, answer.config), deadline)

    def update_groups(self, states: Mapping[str, bool], timeout: float | None = None) -> Config:
        """Change which groups are shown, by name; see `update`."""
        return self.update({"groups": states}, timeout)

    def close(self) -> None:
        """Stop listening; again is no error."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._parts.close()
        self.node.forget(self)

    def _settle(self, config: Config, deadline: float) -> Config:
        """Take the answer to a change for what holds, once the announcements before it came."""
        with self._changed:
            if threading.get_ident() != self._teller:  # else it would wait for itself
                self._changed.wait_for(
                    lambda: config in self._heard or self._closed,
                    min(_ECHO_BY, max(deadline - time.monotonic(), 0.0)),
                )
            if config not in self._heard:
                self._config = config
        return deepcopy(config)

    def _wait_for(self, condition: Callable[[], bool], what: str, timeout: float | None) -> None:
        limit = self.timeout if timeout is None else timeout
        with self._changed:
            if condition():
                return
            self._changed.wait_for(lambda: condition() or self._closed, limit)
            if condition():
                return
            if self._closed:
                raise ClosedError(f"the client of '{self.name}' is closed")
        if self.name not in find_servers(self.node.context.graph.view()):
            raise self._nobody(limit)
        raise WaitTimeout(f"{what} from '{self.name}'", limit, _BUSY)

    def _nobody(self, seconds: float) -> WaitTimeout:
        known = find_servers(self.node.context.graph.view())
        listing = f"there are {', '.join(known)}" if known else "no node has any on this network"
        hint = near_miss(self.name, known).removeprefix("; ") or listing
        return WaitTimeout(f"node with settings under '{self.name}'", seconds, hint)

    def _on_description(self, message: ConfigDescription) -> None:
        description = unpack_description(message)
        with self._telling():
            with self._changed:
                self._description = description
                self._changed.notify_all()
            if self.description_callback is not None:
                self.description_callback(description)
            if self._message is not None:
                self._tell(description, self._message)

    def _on_update(self, message: ConfigMessage) -> None:
        with self._telling():
            self._message = message
            if self._description is not None:
                self._tell(self._description, message)

    @contextmanager
    def _telling(self) -> Iterator[None]:
        """Have callbacks run one at a time, whichever topic they come from."""
        with self._turn:
            self._teller = threading.get_ident()
            try:
                yield
            finally:
                self._teller = 0

    def _tell(self, description: Description, message: ConfigMessage) -> None:
        config = _decoded(description, message)
        with self._changed:
            self._config = config
            self._heard.append(config)
            self._changed.notify_all()
        if self.config_callback is not None:
            self.config_callback(deepcopy(config))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Client of {self.name}>"


def _decoded(description: Description, message: ConfigMessage) -> Config:
    known = {n: one for n, one in unpack_values(message).items() if n in description.settings}
    values = description.defaults() | description.convert(known)
    return description.config(values, unpack_states(message))
