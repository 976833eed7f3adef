"""The server of dynamic_reconfigure: it lets other nodes change the settings of its node."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any, Final

from rosz.errors import ParamError
from rosz.lifecycle import Closing
from rosz.msgs.dynamic_reconfigure.msg import Config as ConfigMessage
from rosz.msgs.dynamic_reconfigure.msg import ConfigDescription
from rosz.msgs.dynamic_reconfigure.srv import Reconfigure
from rosz.reconfigure.description import Config, Description
from rosz.reconfigure.messages import (
    DESCRIPTIONS,
    SET,
    UPDATES,
    encode_config,
    pack_description,
    unpack_states,
    unpack_values,
)

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.params.replica import Changed

ALL_LEVELS: Final = ~0
"""The level that a callback is called with the first time: every bit is set."""

Callback = Callable[[Config, int], Mapping[str, Any] | None]
_UNSET: Final = object()


class Server(Closing):
    """Lets others change the settings of a node while it runs.

    The first values are those in the parameter store, or defaults. All values are written to the
    store, so a node that is started again goes on with them. Clients find the server by the topics
    and the service of dynamic_reconfigure in its namespace: ``parameter_descriptions``,
    ``parameter_updates`` and ``set_parameters``.

    Attributes:
        callback: Function called before a change; may be replaced.
        name: Namespace of the server, which is its name for clients.

    Args:
        node: Node that has the settings.
        description: Description of the settings.
        callback: Function called with the new configuration before it takes effect, and with the
            bitwise or of the levels of the settings that change (`ALL_LEVELS` the first time, in
            the constructor). It may change the configuration, or return another one. An exception
            refuses the change and is reported to the client. Calls do not overlap.
        namespace: Namespace of settings, topics and service: that of the node if empty, below it if
            relative.
        follow: Whether changes in the parameter store (``rosz param set``) take effect as well,
            which they do not in dynamic_reconfigure.

    Raises:
        ParamError: The callback returned values that the settings cannot have.
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
        below = "" if namespace.startswith(("/", "~")) else "~"
        self.name: str = node.resolve(f"{below}{namespace}").rstrip("/")
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
            # The service comes last: a client that finds it finds everything else.
            stack.enter_context(node.service(f"{self.name}/{SET}", Reconfigure, self._set))
            self._parts = stack.pop_all()
        node.keep(self)

    @property
    def config(self) -> Config:
        """A copy of the current configuration."""
        with self._lock:
            return self.description.config(self._values, self._states)

    def update(self, changes: Mapping[str, Any]) -> Config:
        """Change settings, as clients do by the service.

        Args:
            changes: New values by name. They are converted to the type of the setting and limited
                to its bounds. ``groups`` holds states of groups by name.

        Returns:
            The configuration after the change; the callback may have chosen other values.

        Raises:
            ParamError: The setting does not exist, or a value cannot be converted.
            ClosedError: The node is closed.
        """
        values = self.description.convert(changes)
        states = self.description.read_states(changes["groups"]) if "groups" in changes else {}
        return self._change(values, states)

    def close(self) -> None:
        """Close topics and service; the values stay in the store. A second call has no effect."""
        self._parts.close()
        self.node.forget(self)

    def _change(self, values: Mapping[str, Any], states: Mapping[int, bool]) -> Config:
        with self._lock:
            new = self._values | self.description.clamp(values)
            level = self.description.level(self._values, new)
            shown_groups = {
                number: shown for number, shown in states.items() if number in self._states
            }
            self._apply(new, self._states | shown_groups, level)
            return self.config

    def _apply(self, values: dict[str, Any], states: dict[int, bool], level: int) -> None:
        """Call the callback, then make the result current and publish it."""
        with self._lock:
            description = self.description
            config = description.config(values, states)
            chosen: Mapping[str, Any] | None = None
            if self.callback is not None:
                chosen = self.callback(config, level)
            if chosen is None:
                chosen = config
            described = {
                name: value for name, value in chosen.items() if name in description.settings
            }
            self._values = values | description.convert(described)
            if "groups" in chosen:
                self._states = states | description.read_states(chosen["groups"])
            self._store()
            self._updates.publish(encode_config(self.config))

    def _set(self, request: Any) -> Any:
        with self._lock:
            values = self.description.convert(unpack_values(request.config))
            config = self._change(values, unpack_states(request.config))
            return Reconfigure.Response(encode_config(config))

    def _stored(self) -> dict[str, Any]:
        """Return the values in the parameter store that can be converted for their settings."""
        converted: dict[str, Any] = {}
        params = self.node.params
        for name, setting in self.description.settings.items():
            full = f"{self.name}/{name}"
            value = params.get(full, _UNSET)
            if value is _UNSET:
                continue
            try:
                converted[name] = setting.convert(value)
            except ParamError as error:
                self.node.log.warning(
                    "ignoring parameter '%s', set by %s: %s", full, params.origin(full), error
                )
        return converted

    def _store(self) -> None:
        """Write the values that differ from those in the store, as one change."""
        params = self.node.params
        changed: dict[str, object] = {}
        for name, value in self._values.items():
            stored = params.get(f"{self.name}/{name}", _UNSET)
            if type(stored) is not type(value) or stored != value:
                changed[f"{self.name}/{name}"] = value
        if changed:
            params.update(changed)

    def _follow(self, _change: Changed) -> None:
        # The store is read again: a late notification must not bring back an old value.
        with self._lock:
            stored = self._stored()
            differing = {n: value for n, value in stored.items() if value != self._values[n]}
            if differing:
                self._change(differing, {})

    def __repr__(self) -> str:
        return f"<Server {self.name} of {', '.join(self.description.settings)}>"
