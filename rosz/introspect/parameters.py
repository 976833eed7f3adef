"""The parameters of all nodes as one tree: those of the store, and those of nodes of ROS 2."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, Any, TypeVar

from rosz.errors import NoReplica, ParamNotFound, RoszError
from rosz.introspect.nodes import follow_clock
from rosz.introspect.survey import read_keys, take_survey
from rosz.params import DELETED, MISSING, Change, Missing, Path, Value, joined, split
from rosz.params.replica import ParamClient
from rosz.session import Session
from rosz.wire import Kind, entities_key, is_rosz_id, parse_token

if TYPE_CHECKING:
    from rosz.msgs.rcl_interfaces.msg import ParameterValue
    from rosz.node.ros2 import RemoteParameters
    from rosz.params.replica import Outcome

T = TypeVar("T")
_SERVICE = "get_parameters"
_SIM_TIME = "use_sim_time"
_TOKENS_TIMEOUT = 2.0


class ParameterTree:
    """The parameters of all nodes, for a process without a replica of the store.

    Parameters of a node of ROS 2 are read and set by calls to that node. All others, and those that
    the node does not have, are in the store. Errors are those of `ParamClient` and
    `RemoteParameters`.

    Args:
        session: Session to ask with; it stays open.
        domain: ROS domain.
        warn: Function called with a sentence about each node that does not answer, and is left out.
        timeout: Time limit in seconds of each call.

    Attributes:
        store: The store alone.
    """

    def __init__(
        self, session: Session, domain: int, warn: Callable[[str], object], timeout: float = 5.0
    ) -> None:
        self._session = session
        self._domain = domain
        self._warn = warn
        self._timeout = timeout
        self.store: ParamClient = ParamClient(session, domain, timeout=timeout)
        # Started now, so that it runs while the store answers.
        key = entities_key(domain, Kind.SERVICE, _SERVICE)
        self._receive_tokens = session.query_tokens(key, _TOKENS_TIMEOUT)

    @cached_property
    def _nodes(self) -> dict[Path, RemoteParameters | None]:
        """The nodes by their paths: None for those of rosz, whose parameters are in the store."""
        nodes: dict[Path, RemoteParameters | None] = {}
        for token in read_keys(self._receive_tokens(), parse_token, []):
            path = split(token.node_name)
            if is_rosz_id(token.zid):
                nodes[path] = None
            elif token.name == f"{token.node_name}/{_SERVICE}":
                from rosz.node.ros2 import RemoteParameters

                nodes.setdefault(path, RemoteParameters(self._session, token, self._timeout))
        return nodes

    def _owner(self, path: Path) -> RemoteParameters | None:
        """Return the node of ROS 2 that a path belongs to."""
        names = (path[:end] for end in range(len(path), 0, -1))
        return next((self._nodes[name] for name in names if name in self._nodes), None)

    def get(self, name: str) -> Value:
        """Return the value of a global name; a dict if parameters lie below it."""
        path = split(name)
        stored: Value | Missing = MISSING
        not_found = ParamNotFound(name)
        try:
            stored = self._stored(lambda: self.store.get(name), MISSING)
        except ParamNotFound as error:
            not_found = error
        owner = self._owner(path)
        inside = (node for place, node in self._nodes.items() if place[: len(path)] == path)
        values = [] if owner is None else owner.read(path)
        values += self._read_all(node for node in inside if node not in {None, owner})
        if values:
            from rosz.node.ros2 import tree_of

            stored = _merged(stored, tree_of(path, values))
        if stored is MISSING:
            raise not_found
        return stored

    def names(self) -> list[str]:
        """Return the sorted global names of all parameters that are not dicts."""
        default: list[str] = []
        names = {*self._stored(self.store.names, default)}
        for paths in self._names_of(filter(None, self._nodes.values())).values():
            names.update(map(joined, paths))
        return sorted(names)

    def write(
        self,
        changes: Iterable[Change],
        on_progress: Callable[[int, list[str]], object] | None = None,
    ) -> Outcome:
        """Write changes: those of nodes of ROS 2 to each node, then all others to the store.

        Args:
            changes: Paths with normalised values or `DELETED`, as `condense` returns them.
            on_progress: As of `ParamClient.write`.
        """
        from rosz.params.replica import Outcome

        others: list[Change] = []
        by_node: dict[RemoteParameters, list[Change]] = {}
        for change in changes:
            owner = self._owner(change[0])
            (others if owner is None else by_node.setdefault(owner, [])).append(change)
        for node, own in by_node.items():
            node.write(own)
        outcome = self.store.write(others, on_progress) if others or not by_node else Outcome(0)
        # Nodes of rosz read `use_sim_time` when they start, and do not watch it.
        names = {joined(path[:-1]) for path, _ in others if path[1:] and path[-1] == _SIM_TIME}
        survey = take_survey(self._session, self._domain) if names else None
        for token in chain(*map(survey.nodes_named, names)) if survey else ():
            follow_clock(self._session, token)
        return outcome

    def delete(self, name: str) -> Outcome:
        """Delete a global name and everything below it."""
        path = split(name)
        if self._owner(path) is None and path[-1:] != (_SIM_TIME,):
            return self.store.delete(name)
        return self.write([(path, DELETED)])

    def _names_of(
        self, nodes: Iterable[RemoteParameters]
    ) -> dict[RemoteParameters, dict[Path, str]]:
        """Return the names of the parameters of nodes by their paths."""
        answers = self._query("list_parameters", {node: ([], 0) for node in nodes})
        return {node: node.paths(response.result.names) for node, response in answers}

    def _read_all(self, nodes: Iterable[RemoteParameters]) -> list[tuple[Path, ParameterValue]]:
        """Return all values of nodes."""
        names = self._names_of(nodes)
        answers = self._query(
            "get_parameters", {node: ([*names[node].values()],) for node in names}
        )
        values: list[tuple[Path, ParameterValue]] = []
        for node, response in answers:
            values += zip(names[node], response.values, strict=False)
        return values

    def _stored(self, ask: Callable[[], T], default: T) -> T:
        """Return the answer of the store; the default if there are only nodes of ROS 2."""
        try:
            return ask()
        except NoReplica:
            if not any(self._nodes.values()):
                raise
            return default

    def _query(
        self, service: str, requests: dict[RemoteParameters, tuple[Any, ...]]
    ) -> Iterator[tuple[RemoteParameters, Any]]:
        """Call a service of nodes at the same time; leave out those that do not answer."""
        calls = [(node, node.begin(service, *request)) for node, request in requests.items()]
        for node, wait in calls:
            try:
                yield node, wait()
            except RoszError as error:
                self._warn(f"the parameters of {node.node} are missing here: {error}")


def _merged(old: Value | Missing, new: Value | Missing) -> Value | Missing:
    """Merge two values, leaf by leaf; the new one wins."""
    if type(old) is not dict or type(new) is not dict:
        return old if new is MISSING else new
    return old | {key: _merged(old.get(key, MISSING), item) for key, item in new.items()}
