"""rospy.msproxy: ROS 1's Master API as rospy returns it: a status code, a text and a value."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from rosz.ros1.client.rospy.names import get_name, resolve_name
from rosz.ros1.exceptions import raised_as
from rosz.ros1.tools.rosgraph.masterapi import Master, MasterError


class MasterProxy:
    """The Master API for the node of this process (ROS wiki, ROS/Master_API).

    Each method returns a list of 1 or -1, a text, and the value. As a container the object holds
    the parameters.
    """

    def __init__(self) -> None:
        self._master = Master(get_name())

    @property
    def target(self) -> str:
        """The URI of the master, at which nothing listens."""
        return self._master.getUri()

    def getPid(self) -> list[Any]:  # noqa: N802  # the master's names
        """Return the id of this process, which answers all calls."""
        return _reply("", self._master.getPid)

    def getUri(self) -> list[Any]:  # noqa: N802
        """Return the URI of the master, at which nothing listens."""
        return _reply("", self._master.getUri)

    def getSystemState(self) -> list[Any]:  # noqa: N802
        """Return the publishers, subscribers and services: names with the names of their nodes."""
        return _reply("current system state", self._master.getSystemState)

    def getTopicTypes(self) -> list[Any]:  # noqa: N802
        """Return all topics with their types."""
        return _reply("current system state", self._master.getTopicTypes)

    def getPublishedTopics(self, subgraph: str = "/") -> list[Any]:  # noqa: N802
        """Return the topics that have publishers, with their types."""
        return _reply("current topics", self._master.getPublishedTopics, subgraph)

    def lookupNode(self, node_name: str) -> list[Any]:  # noqa: N802
        """Return the URI of a node."""
        return _reply("node api", self._master.lookupNode, node_name)

    def lookupService(self, service: str) -> list[Any]:  # noqa: N802
        """Return the URI of the node that serves a service."""
        return _reply("rosrpc URI", self._master.lookupService, service)

    def getParam(self, key: str) -> list[Any]:  # noqa: N802
        """Return a parameter."""
        return _reply(f"Parameter [{key}]", self._master.getParam, key, failed=0)

    def setParam(self, key: str, value: Any) -> list[Any]:  # noqa: N802
        """Set a parameter."""
        return _reply(f"parameter {key} set", self._master.setParam, key, value, failed=0)

    def hasParam(self, key: str) -> list[Any]:  # noqa: N802
        """Return whether a parameter is set."""
        return _reply(key, self._master.hasParam, key)

    def deleteParam(self, key: str) -> list[Any]:  # noqa: N802
        """Delete a parameter."""
        return _reply(f"parameter {key} deleted", self._master.deleteParam, key, failed=0)

    def searchParam(self, key: str) -> list[Any]:  # noqa: N802
        """Search a parameter in the node's namespace and those above."""
        return _reply("Found", self._master.searchParam, key)

    def getParamNames(self) -> list[Any]:  # noqa: N802
        """Return the names of all parameters."""
        return _reply("Parameter names", self._master.getParamNames)

    def search_param(self, key: str) -> str | None:
        """Search a parameter in the node's namespace and those above; None if it is not set."""
        try:
            return self._master.searchParam(key)
        except MasterError:
            return None

    def __getitem__(self, key: str) -> Any:
        try:
            return self._master.getParam(resolve_name(key))
        except MasterError:
            raise KeyError(key) from None

    def __setitem__(self, key: str, value: Any) -> None:
        with raised_as(TypeError, MasterError):
            self._master.setParam(resolve_name(key), value)

    def __delitem__(self, key: str) -> None:
        try:
            self._master.deleteParam(resolve_name(key))
        except MasterError:
            raise KeyError(key) from None

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str) and self._master.hasParam(resolve_name(key))

    def __iter__(self) -> Iterator[str]:
        return iter(self._master.getParamNames())

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(
            f"there is no master here, and nothing replaces its '{name}'; what there is:"
            f" {', '.join(sorted(n for n in vars(MasterProxy) if n[0] != '_'))}"
        )


def _reply(text: str, call: Callable[..., Any], *args: Any, failed: Any = "") -> list[Any]:
    """Call a method of the master, and return a reply with a text, or one that it failed."""
    try:
        return [1, text, call(*args)]
    except MasterError as error:
        return [-1, str(error), failed]
