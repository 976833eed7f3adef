"""The end that has the settings."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Final, Self

from rosz.errors import ParamError
from rosz.msgs.dynamic_reconfigure.msg import Config as ConfigMessage
from rosz.msgs.dynamic_reconfigure.msg import ConfigDescription
from rosz.msgs.dynamic_reconfigure.srv import Reconfigure
from rosz.reconfigure.config import Config
from rosz.reconfigure.description import Description
from rosz.reconfigure.messages import (
    pack_config,
    pack_description,
    unpack_states,
    unpack_values,
)
from rosz.reconfigure.servers import DESCRIPTIONS, SET, UPDATES

if TYPE_CHECKING:
    from types import TracebackType

    from rosz.node import Node
    from rosz.params.replica import Changed

__all__ = ("ALL_LEVELS", "Server")

ALL_LEVELS: Final = ~0
"""What a callback is given for levels the first time: every bit is set."""

Callback = Callable[[Config, int], Mapping[str, Any] | None]
_UNSET: Final = object()


class Server:
    """Lets others change settings of a node while it runs.

    The first values are those of the parameter store, and defaults where it has none; all values
    are written there, so that a node that is started again goes on with them. Others find the
    server by the topics and the service of ROS 1's dynamic_reconfigure, in its namespace:
    ``parameter_descriptions``, ``parameter_updates`` and ``set_parameters``.

    Attributes:
        node: Whose settings they are.
        description: What there is to set.
        callback: Asked about changes; may be replaced.
        name: What clients know it by: its namespace.

    Args:
        node: Whose settings they are.
        description: What there is to set.
        callback: Gets a configuration that is about to hold, and the or-ed levels of what changes
            (`ALL_LEVELS` the first time, while the server is made). It may change the
            configuration, or return another one. What it raises refuses the change, and is told
            to whoever asked for it. One call at a time.
        namespace: Where settings, topics and service are: the node's own when empty, below it when
            relative.
        follow: Whether changes in the parameter store (``rosz param set``) hold as well; ROS 1
            takes no notice of them.

    Raises:
        ParamError: What the callback returned cannot be the values of settings.
        InvalidName: The namespace is not legal.
        ClosedError: The node is closed.
    """

    def __init__(
        self,
        node: Node,
        description: Description,
        callback: Callback | None = None,
        namespace: str = "",
        *,
        follow: bool = False,
    ) -> None:
        self.node = node
        self.description = description
        self.callback = callback
        self.name = node.resolve(_private(namespace)).rstrip("/")
        self._lock = threading.RLock()
        self._values = description.clamp(description.defaults() | self._stored())
        self._states = description.states()
        with ExitStack() as stack:
            descriptions = stack.enter_context(
                node.publisher(f"{self.name}/{DESCRIPTIONS}", ConfigDescription, latch=True)
            )
            self._updates = stack.enter_context(
                node.publisher(f"{self.name}/{UPDATES}", ConfigMessage, latch=True)
            )
            descriptions.publish(pack_description(description))
            self._apply(self._values, self._states, ALL_LEVELS)
            if follow:
                watch = node.params.watch(self.name, self._follow)
                stack.callback(watch.close)
            # Last: who finds the service finds all else.
            stack.enter_context(node.service(f"{self.name}/{SET}", Reconfigure, self._set))
            self._parts = stack.pop_all()
        node.keep(self)

    @property
    def config(self) -> Config:
        """The values that hold, a copy."""
        with self._lock:
            return self.description.config(self._values, self._states)

    def update(self, changes: Mapping[str, Any]) -> Config:
        """Change settings, as others do by the service.

        Args:
            changes: Name to value; converted to the setting's type, and brought within its bounds.
                ``groups`` holds states of groups by name.

        Returns:
            What holds then: the callback may have decided otherwise.

        Raises:
            ParamError: There is no such setting, or a value cannot be one of it.
            ClosedError: The node is closed.
        """
        values = self.description.convert(changes)
        states = self.description.read_states(changes["groups"]) if "groups" in changes else {}
        return self._change(values, states)

    def close(self) -> None:
        """Withdraw topics and service; the values stay in the store. Again is no error."""
        self._parts.close()
        self.node.forget(self)

    def _change(self, values: Mapping[str, Any], states: Mapping[int, bool]) -> Config:
        with self._lock:
            new = self._values | self.description.clamp(values)
            level = self.description.level(self._values, new)
            known = {number: shown for number, shown in states.items() if number in self._states}
            self._apply(new, self._states | known, level)
            return self.config

    def _apply(self, values: dict[str, Any], states: dict[int, bool], level: int) -> None:
        """Ask the callback, then make what it decides hold, and known."""
        with self._lock:
            description = self.description
            config = description.config(values, states)
            decided: Mapping[str, Any] | None = None
            if self.callback is not None:
                decided = self.callback(config, level)
            if decided is None:
                decided = config
            known = {name: one for name, one in decided.items() if name in description.settings}
            self._values = values | description.convert(known)
            if "groups" in decided:
                self._states = states | description.read_states(decided["groups"])
            self._store()
            self._updates.publish(pack_config(description, self._values, self._states))

    def _set(self, request: Any) -> Any:
        with self._lock:
            values = self.description.convert(unpack_values(request.config))
            self._change(values, unpack_states(request.config))
            return Reconfigure.Response(pack_config(self.description, self._values, self._states))

    def _stored(self) -> dict[str, Any]:
        """Return what the parameter store has, as far as it can be a value of its setting."""
        found: dict[str, Any] = {}
        params = self.node.params
        for name, setting in self.description.settings.items():
            full = f"{self.name}/{name}"
            value = params.get(full, _UNSET)
            if value is _UNSET:
                continue
            try:
                found[name] = setting.convert(value)
            except ParamError as error:
                self.node.log.warning(
                    "ignoring parameter '%s', set by %s: %s", full, params.origin(full), error
                )
        return found

    def _store(self) -> None:
        """Write what the store has otherwise, as one change."""
        params = self.node.params
        changed: dict[str, object] = {}
        for name, value in self._values.items():
            stored = params.get(f"{self.name}/{name}", _UNSET)
            if type(stored) is not type(value) or stored != value:
                changed[f"{self.name}/{name}"] = value
        if changed:
            params.update(changed)

    def _follow(self, _change: Changed) -> None:
        # The store is read anew: a change told late must not bring back an old value.
        with self._lock:
            stored = self._stored()
            differing = {n: value for n, value in stored.items() if value != self._values[n]}
            if differing:
                self._change(differing, {})

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
        return f"<Server {self.name} of {', '.join(self.description.settings)}>"


def _private(namespace: str) -> str:
    """Return a namespace as a name that the node resolves: relative ones are below the node."""
    if namespace.startswith(("/", "~")):
        return namespace
    return f"~{namespace}"
