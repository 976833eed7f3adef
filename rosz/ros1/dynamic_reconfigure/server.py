"""``dynamic_reconfigure.server``: what a node lets others set (ROS wiki, dynamic_reconfigure)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rosz import reconfigure
from rosz.errors import ParamError
from rosz.ros1 import state
from rosz.ros1.dynamic_reconfigure.cfgfile import describe
from rosz.ros1.dynamic_reconfigure.encoding import Config, encode_description
from rosz.ros1.dynamic_reconfigure.exceptions import (
    DynamicReconfigureCallbackException,
    DynamicReconfigureParameterException,
)

__all__ = ("Server",)

_NOTHING = "Reconfigure callback should return a possibly updated configuration."


class Server:
    """Lets others change parameters of this node while it runs; see `rosz.reconfigure.Server`.

    Args:
        type: A generated module, such as ``my_pkg.cfg.TutorialsConfig``.
        callback: Gets a configuration that is about to hold, and the or-ed levels of what changes
            (-1 the first time), and returns the one that is to hold.
        namespace: Where parameters, topics and service are: the node's own when empty, below it
            when relative.

    Attributes:
        type: The module.
        callback: The callback; may be replaced.
        config: The configuration that holds.
        description: The message that describes the parameters.
        ns: The namespace, with a slash at its end.

    Raises:
        ROSInitException: ``init_node`` has not been called.
        DynamicReconfigureCallbackException: The callback returned nothing.
        DynamicReconfigureParameterException: What it returned cannot be the parameters' values.
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
        try:
            self._server = reconfigure.Server(
                self._node, describe(type.config_description), self._decide, namespace
            )
        except ParamError as error:
            raise DynamicReconfigureParameterException(str(error)) from error
        self.config = self._server.config
        self.ns = f"{self._server.name}/"

    def update_configuration(self, changes: Mapping[str, Any]) -> Config:
        """Change parameters, as others do by the service.

        Args:
            changes: Name to value.

        Returns:
            What holds then.

        Raises:
            DynamicReconfigureCallbackException: The callback returned nothing.
            DynamicReconfigureParameterException: There is no such parameter, or a value cannot be
                one of it.
        """
        try:
            self.config = self._server.update(changes)
        except ParamError as error:
            raise DynamicReconfigureParameterException(str(error)) from error
        return self.config

    def _decide(self, config: Config, level: int) -> Config:
        decided = self.callback(config, level)
        if decided is None:
            self._node.log.error(_NOTHING)
            raise DynamicReconfigureCallbackException(_NOTHING)
        self.config = decided
        return decided
