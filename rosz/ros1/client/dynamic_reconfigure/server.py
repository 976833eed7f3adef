"""``dynamic_reconfigure.server``: parameters that others may change (ROS wiki)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rosz import reconfigure
from rosz.errors import ParamError
from rosz.reconfigure import Config
from rosz.reconfigure.messages import describe, encode_description
from rosz.ros1 import state
from rosz.ros1.client.dynamic_reconfigure import (
    DynamicReconfigureCallbackException,
    DynamicReconfigureParameterException,
)
from rosz.ros1.exceptions import raised_as

_RETURNED_NOTHING = "Reconfigure callback should return a possibly updated configuration."


class Server:
    """Lets others change parameters of this node while it runs; see `rosz.reconfigure.Server`.

    Args:
        type: Generated module, such as ``my_pkg.cfg.TutorialsConfig``.
        callback: Function called with a new configuration and the bitwise or of the levels of what
            changes (-1 the first time). It returns the configuration that takes effect.
        namespace: Namespace of parameters, topics and service: that of the node if empty, below it
            if relative.

    Attributes:
        type: Generated module.
        callback: Function called before a change; may be replaced.
        config: Current configuration.
        description: Message that describes the parameters.
        ns: Namespace, with a slash at its end.

    Raises:
        ROSInitException: ``init_node`` has not been called.
        DynamicReconfigureCallbackException: The callback returned nothing.
        DynamicReconfigureParameterException: The parameters cannot have the values that the
            callback returned.
    """

    def __init__(
        self,
        type: Any,  # noqa: A002  # ROS 1's name
        callback: Callable[[Config, int], Config],
        namespace: str = "",
    ) -> None:
        self.type = type
        self.callback = callback
        self.description = encode_description(type)
        self.config = Config(type.defaults)
        self._node = state.node()
        with raised_as(DynamicReconfigureParameterException, ParamError):
            self._server = reconfigure.Server(
                self._node, describe(type.config_description), self._choose, namespace
            )
        self.config = self._server.config
        self.ns = f"{self._server.name}/"

    def update_configuration(self, changes: Mapping[str, Any]) -> Config:
        """Change parameters, as clients do by the service.

        Args:
            changes: New values by name.

        Returns:
            The configuration after the change.

        Raises:
            DynamicReconfigureCallbackException: The callback returned nothing.
            DynamicReconfigureParameterException: The parameter does not exist, or a value cannot be
                converted.
        """
        with raised_as(DynamicReconfigureParameterException, ParamError):
            self.config = self._server.update(changes)
        return self.config

    def _choose(self, config: Config, level: int) -> Config:
        chosen = self.callback(config, level)
        if chosen is None:
            self._node.log.error(_RETURNED_NOTHING)
            raise DynamicReconfigureCallbackException(_RETURNED_NOTHING)
        self.config = chosen
        return chosen
