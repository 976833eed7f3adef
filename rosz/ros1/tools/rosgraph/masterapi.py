"""rosgraph.masterapi: the reading part of ROS 1's Master API, and its Parameter Server API.

The values have the forms of ROS 1 (ROS wiki, Master API). They come from the liveliness tokens of
the network and from this process's replica of the parameters, so nothing has to be registered.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any, NoReturn

from rosz.errors import ParamError, ParamNotFound, RoszError, TransportError
from rosz.names import is_of_action, ros1_type
from rosz.params.replica import Params
from rosz.ros1.exceptions import raised_as
from rosz.ros1.state import params_of, ready_context, survey, token_uri
from rosz.ros1.tools.rosgraph.names import get_master_uri, make_caller_id, make_global_ns
from rosz.wire import Kind, Token

Pairs = list[list[str]]
"""Names with their types."""

NamesWithNodes = list[list[Any]]
"""Names with the lists of their nodes."""


class MasterException(Exception):
    """Base class of the errors of the Master API."""


class MasterFailure(MasterException):
    """A call could not be made."""


class MasterError(MasterException):
    """A call failed, since there is nothing of that name."""


ROSMasterException = MasterException
Failure = MasterFailure
Error = MasterError


def is_online(master_uri: str | None = None) -> bool:  # noqa: ARG001  # ROS 1's
    """Return whether the network can be reached; there is no master."""
    try:
        ready_context()
    except TransportError:
        return False
    return True


class Master:
    """The Master API, from the graph and the parameters.

    Args:
        caller_id: Name of the program, which relative names are resolved by.
        master_uri: URI that `getUri` returns.
    """

    def __init__(self, caller_id: str, master_uri: str | None = None) -> None:
        self.caller_id = make_caller_id(caller_id).rstrip("/")
        self.master_uri = master_uri or get_master_uri()

    def __getattr__(self, name: str) -> NoReturn:
        raise AttributeError(
            f"rosgraph.Master has no '{name}' in rosz: there is no master to register with or to"
            " subscribe at; nodes, topics and services declare themselves"
        )

    def is_online(self) -> bool:
        """Return whether the network can be reached."""
        return is_online()

    @property
    def _params(self) -> Params:
        return params_of(self.caller_id)

    def deleteParam(self, key: str) -> int:  # noqa: N802  # ROS 1's
        """Delete a parameter.

        Raises:
            MasterError: The parameter is not set, or is the root.
        """
        try:
            self._params.delete(key)
        except ParamNotFound as error:
            raise MasterError(f"parameter [{error.name}] is not set") from error
        except ParamError as error:
            raise MasterError(str(error)) from error
        return 0

    def setParam(self, key: str, value: Any) -> int:  # noqa: N802  # ROS 1's
        """Set a parameter; a dict replaces everything below the name.

        Raises:
            MasterError: A parameter cannot have this value.
        """
        with raised_as(MasterError, ParamError):
            self._params.set(key, value)
        return 0

    def getParam(self, key: str) -> Any:  # noqa: N802  # ROS 1's
        """Return a parameter, or all parameters in a namespace.

        Raises:
            MasterError: The parameter is not set.
        """
        try:
            return self._params.get(key)
        except ParamNotFound as error:
            raise MasterError(f"Parameter [{error.name}] is not set") from error

    def searchParam(self, key: str) -> str:  # noqa: N802  # ROS 1's
        """Search a parameter in the namespace of the caller and those above; return its full name.

        Raises:
            MasterError: The parameter is not set in any of them.
        """
        name = self._params.search(key)
        if name is None:
            raise MasterError(f"Cannot find parameter [{key}] in an upwards search")
        return name

    def hasParam(self, key: str) -> bool:  # noqa: N802  # ROS 1's
        """Return whether a parameter is set."""
        return self._params.has(key)

    def getParamNames(self) -> list[str]:  # noqa: N802  # ROS 1's
        """Return the global names of all parameters."""
        return self._params.names()

    def getPid(self) -> int:  # noqa: N802  # ROS 1's
        """Return the id of this process, which answers all calls."""
        return os.getpid()

    def getUri(self) -> str:  # noqa: N802  # ROS 1's
        """Return the URI of the master, at which nothing listens."""
        return self.master_uri or ""

    def lookupNode(self, node_name: str) -> str:  # noqa: N802  # ROS 1's
        """Return the URI of a node.

        Raises:
            MasterError: The node does not exist.
        """
        alive = survey()
        members = alive.nodes_named(node_name)
        if not members:
            raise MasterError(f"unknown node [{node_name}]")
        return token_uri(alive, members[-1])

    def lookupService(self, service: str) -> str:  # noqa: N802  # ROS 1's
        """Return the URI of the node that serves a service.

        Raises:
            MasterError: No node serves it.
        """
        alive = survey()
        servers = alive.view.servers(service)
        if not servers:
            raise MasterError("no provider")
        return token_uri(alive, servers[0])

    def getPublishedTopics(self, subgraph: str) -> Pairs:  # noqa: N802  # ROS 1's
        """Return the topics that have publishers, with their types.

        Args:
            subgraph: Namespace of the topics; empty for all.
        """
        space = make_global_ns(subgraph.rstrip("/"))
        published = survey().view.entities(Kind.PUBLISHER)
        return [pair for pair in _types(published) if pair[0].startswith(space)]

    def getTopicTypes(self) -> Pairs:  # noqa: N802  # ROS 1's
        """Return all topics with their types."""
        return _types(survey().view.entities(Kind.PUBLISHER, Kind.SUBSCRIPTION))

    def getSystemState(self) -> list[NamesWithNodes]:  # noqa: N802  # ROS 1's
        """Return the publishers, subscribers and services: names with the names of their nodes."""
        with raised_as(MasterFailure, RoszError):
            view = survey().view
        kinds = Kind.PUBLISHER, Kind.SUBSCRIPTION, Kind.SERVICE
        return [_with_nodes(view.entities(kind)) for kind in kinds]


def _types(tokens: Iterable[Token]) -> Pairs:
    types = {
        token.name: ros1_type(token.name, token.type_name)
        for token in tokens
        if not is_of_action(token.name)
    }
    return [[name, type_name] for name, type_name in sorted(types.items())]


def _with_nodes(tokens: Iterable[Token]) -> NamesWithNodes:
    names: dict[str, dict[str, None]] = {}
    for token in tokens:
        if not is_of_action(token.name):
            names.setdefault(token.name, {})[token.node_name] = None
    return [[name, list(nodes)] for name, nodes in sorted(names.items())]
