"""``dynamic_reconfigure.client``: reads and changes parameters of another node (ROS wiki)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from rosz import reconfigure
from rosz.errors import ClosedError, ParamError, ServiceError, WaitTimeout
from rosz.reconfigure import Config, Description
from rosz.reconfigure.messages import (
    SET,
    decode_description,
    extract_params,
    in_groups,
    pack_description,
)
from rosz.ros1 import state
from rosz.ros1.client.dynamic_reconfigure import (
    DynamicReconfigureCallbackException,
    DynamicReconfigureParameterException,
)
from rosz.ros1.client.rospy.service import wait_for_service
from rosz.ros1.exceptions import ROSException, ROSInterruptException

__all__ = ("Client",)

T = TypeVar("T")
_WARN_AFTER = 1.0
"""Seconds after which a wait without a timeout prints a line about it, as in ROS 1."""

_REPLY_TIMEOUT = 10.0
"""Default time limit in seconds of the wait for a reply of a server that is there."""

_NOW = 0.0
_TYPES: dict[str, type] = {"bool": bool, "int": int, "str": str, "double": float}


class Client:
    """Reads and changes parameters of another node; see `rosz.reconfigure.Client`.

    Args:
        name: Name of the server, mostly that of its node.
        timeout: Time limit in seconds of the wait for the server; none if not given.
        config_callback: Function called with the current configuration, and with each later one.
        description_callback: Function called with the descriptions of the parameters, as
            `get_parameter_descriptions` returns them.

    Attributes:
        name: Name of the server.

    Raises:
        ROSInitException: ``init_node`` has not been called.
        ROSException: The server did not appear in time.
        ROSInterruptException: The node was shut down meanwhile.
    """

    def __init__(
        self,
        name: str,
        timeout: float | None = None,
        config_callback: Callable[[Config], object] | None = None,
        description_callback: Callable[[list[dict[str, Any]]], object] | None = None,
    ) -> None:
        self.name = name
        node = state.node()
        _wait_for_server(node.resolve(f"{name}/{SET}"), timeout)
        self._config_callback = config_callback
        self._description_callback = description_callback
        self._decoded: tuple[Description, Config] | None = None
        self._client = reconfigure.Client(
            node,
            name,
            timeout=_REPLY_TIMEOUT,
            config_callback=self._on_config,
            description_callback=self._on_description,
        )

    @property
    def config(self) -> Config | None:
        """The current configuration, or ``None`` before it is known."""
        return self._configuration(_NOW)

    @property
    def param_description(self) -> list[dict[str, Any]] | None:
        """The descriptions of the parameters, or ``None`` before they are known."""
        return self._parameters(_NOW)

    @property
    def group_description(self) -> Config | None:
        """The root group, or ``None`` before it is known."""
        return self._groups(_NOW)

    def get_configuration(self, timeout: float | None = None) -> Config | None:
        """Return the current configuration.

        Args:
            timeout: Time limit in seconds of the wait for the server; 10 by default.

        Returns:
            Values by name, and the groups; ``None`` if the server did not send them.
        """
        return self._wait_for(self._configuration, timeout, "configuration")

    def get_parameter_descriptions(
        self, timeout: float | None = None
    ) -> list[dict[str, Any]] | None:
        """Return the descriptions of the parameters; see `get_configuration`."""
        return self._wait_for(self._parameters, timeout, "descriptions")

    def get_group_descriptions(self, timeout: float | None = None) -> Config | None:
        """Return the root group; see `get_configuration`."""
        return self._wait_for(self._groups, timeout, "descriptions")

    def update_configuration(self, changes: Mapping[str, Any]) -> Config:
        """Change parameters.

        Args:
            changes: New values by name; ``groups`` holds states of groups by name.

        Returns:
            The configuration after the change.

        Raises:
            DynamicReconfigureParameterException: The parameter does not exist, or a value cannot be
                converted.
            DynamicReconfigureCallbackException: The server refused, is gone, or did not reply
                within 10 seconds.
            ROSInterruptException: The node was shut down meanwhile.
        """
        try:
            _check(self._client.description(), changes)
            updated = self._client.update(changes)
        except ParamError as error:
            raise DynamicReconfigureParameterException(str(error)) from error
        except (ServiceError, WaitTimeout) as error:
            raise DynamicReconfigureCallbackException(f"service call failed: {error}") from error
        except ClosedError as error:
            raise ROSInterruptException("rospy shutdown") from error
        return in_groups(updated, self._decode(self._client.description()))

    def update_groups(self, changes: Mapping[str, bool]) -> Config | None:
        """Change whether groups are shown, by name, and return the root group."""
        self.update_configuration({"groups": changes})
        return self.get_group_descriptions()

    def close(self) -> None:
        """Stop receiving from the server."""
        self._client.close()

    def get_config_callback(self) -> Callable[[Config], object] | None:
        """Return the function that is called with configurations."""
        return self._config_callback

    def set_config_callback(self, value: Callable[[Config], object] | None) -> None:
        """Call a function with configurations, first with the current one."""
        self._config_callback = value
        current = self.config
        if value is not None and current is not None:
            value(current)

    config_callback = property(get_config_callback, set_config_callback)

    def get_description_callback(self) -> Callable[[list[dict[str, Any]]], object] | None:
        """Return the function that is called with descriptions."""
        return self._description_callback

    def set_description_callback(
        self, value: Callable[[list[dict[str, Any]]], object] | None
    ) -> None:
        """Call a function with descriptions, first with those that are known."""
        self._description_callback = value
        current = self.param_description
        if value is not None and current is not None:
            value(current)

    description_callback = property(get_description_callback, set_description_callback)

    def _wait_for(
        self, ask: Callable[[float], T | None], timeout: float | None, what: str
    ) -> T | None:
        """Return the reply of ``ask``; without a timeout, print a line if it takes long."""
        reply = ask(timeout or _WARN_AFTER)
        if reply is None and not timeout and not state.node().is_shutdown:
            sys.stderr.write(f"Waiting for {what}...\n")
            reply = ask(_REPLY_TIMEOUT)
        return reply

    def _configuration(self, timeout: float) -> Config | None:
        try:
            config = self._client.config(timeout)
            return in_groups(config, self._decode(self._client.description(_NOW)))
        except (WaitTimeout, ClosedError):
            return None

    def _groups(self, timeout: float) -> Config | None:
        try:
            return self._decode(self._client.description(timeout))
        except (WaitTimeout, ClosedError):
            return None

    def _parameters(self, timeout: float) -> list[dict[str, Any]] | None:
        groups = self._groups(timeout)
        return None if groups is None else extract_params(groups)

    def _decode(self, description: Description) -> Config:
        """Return the root group of a description."""
        if self._decoded is None or self._decoded[0] is not description:
            self._decoded = (description, decode_description(pack_description(description)))
        return self._decoded[1]

    def _on_config(self, config: Config) -> None:
        if self._config_callback is not None:
            self._config_callback(in_groups(config, self._decode(self._client.description())))

    def _on_description(self, description: Description) -> None:
        if self._description_callback is not None:
            self._description_callback(extract_params(self._decode(description)))


def _wait_for_server(service: str, timeout: float | None) -> None:
    """Wait for the server; without a timeout for ever, which launch files rely on."""
    if timeout:
        wait_for_service(service, timeout)
        return
    try:
        wait_for_service(service, _WARN_AFTER)
    except ROSException as error:
        if isinstance(error, ROSInterruptException):
            raise
        sys.stderr.write(f"Waiting for service {service}...\n")
        wait_for_service(service)


def _check(description: Description, changes: Mapping[str, Any]) -> None:
    """Refuse changes with the messages of ROS 1."""
    for name, value in changes.items():
        if name == "groups":
            continue
        setting = description.settings.get(name)
        if setting is None:
            raise DynamicReconfigureParameterException(f"don't know parameter: {name}")
        try:
            setting.convert(value)
        except ParamError as error:
            kind = _TYPES[setting.kind or "str"]
            text = f"can't set parameter '{name}' of {kind}: {error}"
            raise DynamicReconfigureParameterException(text) from error
