"""What a ROS master would answer, told from the graph that every process here sees."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

from rosz.graph import View
from rosz.ros1.rospy.absent import attribute
from rosz.ros1.rospy.params import (
    delete_param,
    get_param,
    get_param_names,
    has_param,
    search_param,
    set_param,
)
from rosz.ros1.rospy.state import context
from rosz.wire import Token

__all__ = ("MasterProxy",)


class MasterProxy:
    """Answers to the calls of the master's API that programs make (ROS wiki, ROS/Master_API).

    Each is a list of 1 or -1, a text, and the value. As a container it holds the parameters.
    """

    @property
    def target(self) -> str:
        """Where a master would be: nowhere."""
        return str(self.getUri()[2])

    def getPid(self) -> list[Any]:  # noqa: N802  # the master's names
        """Return the id of this process, which answers for itself."""
        return [1, "", os.getpid()]

    def getUri(self) -> list[Any]:  # noqa: N802
        """Return where processes of this machine meet."""
        return [1, "", context().environment.rendezvous]

    def getSystemState(self) -> list[Any]:  # noqa: N802
        """Return publishers, subscribers and services, each by name with the nodes."""
        view = _view()
        topics, services = view.topics(), view.services()
        published = [[n, _nodes(view.publishers(n))] for n in topics if view.publishers(n)]
        heard = [[n, _nodes(view.subscriptions(n))] for n in topics if view.subscriptions(n)]
        served = [[name, _nodes(view.servers(name))] for name in services]
        return [1, "current system state", [published, heard, served]]

    def getTopicTypes(self) -> list[Any]:  # noqa: N802
        """Return all topics with their types."""
        topics = _view().topics()
        return [1, "current system state", [[n, _ros1(types[0])] for n, types in topics.items()]]

    def getPublishedTopics(self, subgraph: str = "/") -> list[Any]:  # noqa: N802
        """Return the topics that somebody publishes on, with their types."""
        found: defaultdict[str, list[str]] = defaultdict(list)
        view = _view()
        below = subgraph.rstrip("/") + "/"
        for name in view.topics():
            for publisher in view.publishers(name):
                if name.startswith(below):
                    found[name].append(_ros1(publisher.type_name))
        return [1, "current topics", [[name, types[0]] for name, types in found.items()]]

    def lookupNode(self, node_name: str) -> list[Any]:  # noqa: N802
        """Return what identifies the process of a node."""
        for process in _view().processes(node_name):
            return [1, "node api", f"rosz://{process.host}:{process.pid}/"]
        if node_name in _view().nodes():
            return [1, "node api", ""]
        return [-1, f"unknown node [{node_name}]", ""]

    def lookupService(self, service: str) -> list[Any]:  # noqa: N802
        """Return what identifies a server of a service."""
        servers = _view().servers(service)
        if not servers:
            return [-1, "no provider", ""]
        return [1, "rosrpc URI", f"rosz://{servers[0].node_name}{service}"]

    def getParam(self, key: str) -> list[Any]:  # noqa: N802
        """Return a parameter."""
        try:
            return [1, f"Parameter [{key}]", get_param(key)]
        except KeyError:
            return [-1, f"Parameter [{key}] is not set", 0]

    def setParam(self, key: str, value: Any) -> list[Any]:  # noqa: N802
        """Set a parameter."""
        set_param(key, value)
        return [1, f"parameter {key} set", 0]

    def hasParam(self, key: str) -> list[Any]:  # noqa: N802
        """Tell whether a parameter is set."""
        return [1, key, has_param(key)]

    def deleteParam(self, key: str) -> list[Any]:  # noqa: N802
        """Delete a parameter."""
        try:
            delete_param(key)
        except KeyError:
            return [-1, f"parameter [{key}] is not set", 0]
        return [1, f"parameter {key} deleted", 0]

    def searchParam(self, key: str) -> list[Any]:  # noqa: N802
        """Look for a parameter in the node's namespace and above."""
        found = search_param(key)
        return [1, "Found", found] if found else [-1, f"Cannot find parameter [{key}]", ""]

    def getParamNames(self) -> list[Any]:  # noqa: N802
        """Return the names of all parameters."""
        return [1, "Parameter names", get_param_names()]

    def search_param(self, key: str) -> str | None:
        """Look for a parameter in the node's namespace and above."""
        return search_param(key)

    def __getitem__(self, key: str) -> Any:
        return get_param(key)

    def __setitem__(self, key: str, value: Any) -> None:
        set_param(key, value)

    def __delitem__(self, key: str) -> None:
        delete_param(key)

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str) and has_param(key)

    def __iter__(self) -> Iterator[str]:
        return iter(get_param_names())

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(
            f"there is no master here, and nothing stands in for its '{name}'; what"
            f" it would tell is in {', '.join(sorted(n for n in vars(MasterProxy) if n[0] != '_'))}"
        )


def _view() -> View:
    """Return the graph as it is at this moment, this node's newest parts included."""
    return context().graph.refresh()


def _nodes(tokens: list[Token]) -> list[str]:
    return list(dict.fromkeys(token.node_name for token in tokens))


def _ros1(type_name: str) -> str:
    return type_name.replace("/msg/", "/")


__getattr__ = attribute(__name__)
