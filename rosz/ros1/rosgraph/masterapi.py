"""rosgraph.masterapi: ROS 1's Master and Parameter Server APIs as far as programs read them.

Answers have ROS 1's forms (ROS wiki, Master API); they come from liveliness tokens and from this
process's own copy of the parameters, so that nothing has to be registered anywhere.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any, NoReturn

from rosz.errors import ParamError, ParamNotFound, RoszError, TransportError
from rosz.names import short_type
from rosz.ros1.rosgraph import live
from rosz.ros1.rosgraph.names import make_caller_id
from rosz.ros1.rosgraph.rosenv import get_master_uri
from rosz.wire import Kind, Token

__all__ = (
    "Error",
    "Failure",
    "Master",
    "MasterError",
    "MasterException",
    "MasterFailure",
    "ROSMasterException",
    "is_online",
)

Pairs = list[list[str]]
"""Names, each with its type."""

Ends = list[list[Any]]
"""Names, each with the list of its nodes."""


class MasterException(Exception):
    """Root of the errors of the Master API."""


class MasterFailure(MasterException):
    """A question could not be answered."""


class MasterError(MasterException):
    """A question that has no answer: nothing of that name is there."""


ROSMasterException = MasterException
Failure = MasterFailure
Error = MasterError


def is_online(master_uri: str | None = None) -> bool:  # noqa: ARG001  # ROS 1's
    """Tell whether the graph can be reached; there is no master that could be missing."""
    try:
        live.context()
    except TransportError:
        return False
    return True


class Master:
    """The graph and the parameters, as a program sees them.

    Args:
        caller_id: Name of the program, for names that are not global.
        master_uri: Only shown by `getUri`.
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
        """Tell whether the graph can be reached."""
        return is_online()

    # Parameters.

    def deleteParam(self, key: str) -> int:  # noqa: N802  # ROS 1's
        """Delete a parameter.

        Raises:
            MasterError: It is not set.
        """
        try:
            live.params(self.caller_id).delete(key)
        except ParamNotFound as error:
            raise MasterError(f"parameter [{error.name}] is not set") from error
        return 0

    def setParam(self, key: str, value: Any) -> int:  # noqa: N802  # ROS 1's
        """Set a parameter; a dict replaces all that was below it.

        Raises:
            MasterError: The value is none that a parameter may have.
        """
        try:
            live.params(self.caller_id).set(key, value)
        except ParamError as error:
            raise MasterError(str(error)) from error
        return 0

    def getParam(self, key: str) -> Any:  # noqa: N802  # ROS 1's
        """Return a parameter, or all below a namespace.

        Raises:
            MasterError: It is not set.
        """
        try:
            return live.params(self.caller_id).get(key)
        except ParamNotFound as error:
            raise MasterError(f"Parameter [{error.name}] is not set") from error

    def searchParam(self, key: str) -> str:  # noqa: N802  # ROS 1's
        """Return the global name of the nearest parameter of a name, upwards from the caller.

        Raises:
            MasterError: There is none.
        """
        found = live.params(self.caller_id).search(key)
        if found is None:
            raise MasterError(f"Cannot find parameter [{key}] in an upwards search")
        return found

    def hasParam(self, key: str) -> bool:  # noqa: N802  # ROS 1's
        """Tell whether a parameter is set."""
        return live.params(self.caller_id).has(key)

    def getParamNames(self) -> list[str]:  # noqa: N802  # ROS 1's
        """Return the global names of all parameters."""
        return live.params(self.caller_id).names()

    # The graph.

    def getPid(self) -> int:  # noqa: N802  # ROS 1's
        """Return the process id of who answers: this process."""
        return os.getpid()

    def getUri(self) -> str:  # noqa: N802  # ROS 1's
        """Return where a master would be."""
        return self.master_uri or ""

    def lookupNode(self, node_name: str) -> str:  # noqa: N802  # ROS 1's
        """Return the address of a node; see `live.address`.

        Raises:
            MasterError: There is no such node.
        """
        found = live.survey()
        members = found.members(node_name)
        if not members:
            raise MasterError(f"unknown node [{node_name}]")
        return live.address(found, members[-1])

    def lookupService(self, service: str) -> str:  # noqa: N802  # ROS 1's
        """Return the address of the node that serves a service.

        Raises:
            MasterError: Nobody does.
        """
        found = live.survey()
        servers = found.view.servers(service)
        if not servers:
            raise MasterError("no provider")
        return live.address(found, servers[0])

    def getPublishedTopics(self, subgraph: str) -> Pairs:  # noqa: N802  # ROS 1's
        """Return the topics that somebody publishes, with their types.

        Args:
            subgraph: Only those in this namespace; all when empty.
        """
        space = f"{subgraph.rstrip('/')}/"
        if not space.startswith("/"):
            space = f"/{space}"
        published = live.survey().view.entities(Kind.PUBLISHER)
        return [pair for pair in _types(published) if pair[0].startswith(space)]

    def getTopicTypes(self) -> Pairs:  # noqa: N802  # ROS 1's
        """Return the topics that somebody publishes or subscribes to, with their types."""
        return _types(live.survey().view.entities(Kind.PUBLISHER, Kind.SUBSCRIPTION))

    def getSystemState(self) -> list[Ends]:  # noqa: N802  # ROS 1's
        """Return publishers, subscribers and services: names, each with the names of its nodes."""
        try:
            view = live.survey().view
        except RoszError as error:
            raise MasterFailure(str(error)) from error
        kinds = Kind.PUBLISHER, Kind.SUBSCRIPTION, Kind.SERVICE
        return [_ends(view.entities(kind)) for kind in kinds]


def _types(tokens: Iterable[Token]) -> Pairs:
    found = {token.name: short_type(token.type_name) for token in tokens}
    return [[name, type_name] for name, type_name in sorted(found.items())]


def _ends(tokens: Iterable[Token]) -> Ends:
    found: dict[str, dict[str, None]] = {}
    for token in tokens:
        found.setdefault(token.name, {})[token.node_name] = None
    return [[name, list(nodes)] for name, nodes in sorted(found.items())]
