"""rclpy.parameter_client: the parameters of another node."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from rosz.msgs.rcl_interfaces.msg import Parameter as ParameterMessage
from rosz.node.ros2 import SERVICES as _SERVICES
from rosz.ros2.rclpy.executors import Future
from rosz.ros2.rclpy.node import Node
from rosz.ros2.rclpy.parameter import Parameter, parameter_dict_from_yaml_file
from rosz.session import LONGEST_WAIT as _LONGEST_WAIT

_Done = Callable[[Future], object]


class AsyncParameterClient:
    """Read and write the parameters of a node by its services, without waiting.

    Each method returns a future of the response of a service of rcl_interfaces; ``callback`` is
    called with the future when it is done.

    Args:
        node: Node that calls.
        remote_node_name: Name of the node whose parameters they are.
        options: Options of `rclpy.node.Node.create_client`.
    """

    def __init__(self, node: Node, remote_node_name: str, *options: Any, **named: Any) -> None:
        self.node: Node = node
        self.remote_node_name: str = remote_node_name
        self._clients = {
            name: node.create_client(kind, f"{remote_node_name}/{name}", *options, **named)
            for name, kind in _SERVICES.items()
        }

    def services_are_ready(self) -> bool:
        """Return whether the node serves all of them."""
        return all(client.service_is_ready() for client in self._clients.values())

    def wait_for_services(self, timeout_sec: float | None = None) -> bool:
        """Wait until the node serves all of them; return whether it does.

        Args:
            timeout_sec: Time limit in seconds; none when not given.
        """
        end = time.monotonic() + (_LONGEST_WAIT if timeout_sec is None else timeout_sec)
        return all(
            client.wait_for_service(max(end - time.monotonic(), 0))
            for client in self._clients.values()
        )

    def _call(self, service: str, callback: _Done | None, **fields: Any) -> Future:
        future = self._clients[service].call_async(_SERVICES[service].Request(**fields))
        if callback is not None:
            future.add_done_callback(callback)
        return future

    def list_parameters(
        self,
        prefixes: Sequence[str] | None = None,
        depth: int | None = None,
        callback: _Done | None = None,
    ) -> Future:
        """List the names of parameters.

        Args:
            prefixes: Prefixes of the names; all names when not given.
            depth: Largest number of levels below a prefix; all when not given.
            callback: Function to call with the future.
        """
        return self._call(
            "list_parameters", callback, prefixes=list(prefixes or ()), depth=depth or 0
        )

    def get_parameters(self, names: Sequence[str], callback: _Done | None = None) -> Future:
        """Get the values of parameters."""
        return self._call("get_parameters", callback, names=list(names))

    def get_parameter_types(self, names: Sequence[str], callback: _Done | None = None) -> Future:
        """Get the types of parameters."""
        return self._call("get_parameter_types", callback, names=list(names))

    def describe_parameters(self, names: Sequence[str], callback: _Done | None = None) -> Future:
        """Get the descriptors of parameters."""
        return self._call("describe_parameters", callback, names=list(names))

    def set_parameters(
        self, parameters: Sequence[Parameter | ParameterMessage], callback: _Done | None = None
    ) -> Future:
        """Set parameters one by one."""
        return self._call("set_parameters", callback, parameters=list(map(_message, parameters)))

    def set_parameters_atomically(
        self, parameters: Sequence[Parameter | ParameterMessage], callback: _Done | None = None
    ) -> Future:
        """Set all parameters or none."""
        messages = list(map(_message, parameters))
        return self._call("set_parameters_atomically", callback, parameters=messages)

    def delete_parameters(self, names: Sequence[str], callback: _Done | None = None) -> Future:
        """Unset parameters, which have to be of dynamic type."""
        return self.set_parameters([Parameter(name) for name in names], callback)

    def load_parameter_file(
        self, parameter_file: str, use_wildcard: bool = False, callback: _Done | None = None
    ) -> Future:
        """Set the parameters of a file one by one; see `parameter_dict_from_yaml_file`."""
        parameters = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters(list(parameters.values()), callback)

    def load_parameter_file_atomically(
        self, parameter_file: str, use_wildcard: bool = False, callback: _Done | None = None
    ) -> Future:
        """Set all parameters of a file or none; see `parameter_dict_from_yaml_file`."""
        parameters = parameter_dict_from_yaml_file(parameter_file, use_wildcard)
        return self.set_parameters_atomically(list(parameters.values()), callback)


def _message(parameter: Parameter | ParameterMessage) -> ParameterMessage:
    return parameter.to_parameter_msg() if isinstance(parameter, Parameter) else parameter
