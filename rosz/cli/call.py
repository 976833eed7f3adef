"""One call of a command: its settings, names and connections."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rosz import names, remap
from rosz.cli.console import until_stopped, warn
from rosz.cli.declare import App
from rosz.environment import Environment, package_index

if TYPE_CHECKING:
    from rosz.introspect import Survey
    from rosz.node import Context, Node
    from rosz.session import Session
    from rosz.typestore import TypeStore


class Call:
    """One call of a command.

    Attributes:
        environment: The settings of this machine.
        incomplete: Whether machines that should be reached are not, so that a list may lack what
            is there.
    """

    def __init__(self, argv: Sequence[str] = ()) -> None:
        self.argv = tuple(argv)
        self.environment = Environment.read()
        self.incomplete: bool = False
        self._remappings = remap.parse(argv)

    @property
    def domain(self) -> int:
        """The ROS domain."""
        return self.environment.domain

    def node_name(self, tool: str) -> str:
        """Return the full name of a tool's node, which private names belong to."""
        return self._remappings.node_name(tool, self.environment.namespace)

    def resolve(self, name: str, tool: str = "rosz") -> str:
        """Return the global name that a name means to a tool.

        Raises:
            InvalidName: The name is not valid.
        """
        node = self.node_name(tool)
        return names.resolve(name, node, self._remappings.resolved_remaps(node))

    @property
    def types(self) -> TypeStore:
        """The message and service types."""
        from rosz.typestore import TypeStore

        return TypeStore(package_index(self.environment), self.environment.home / "rosz")

    def session(self) -> Session:
        """Open a session for a short query; warn of machines that it does not reach."""
        from rosz.introspect import open_session

        session = open_session(self.environment)
        self._check_reached(session)
        return session

    def context(self, *, lasting: bool = False) -> Context:
        """Open the context of a node, which may belong to a command that runs until stopped."""
        from rosz.introspect import open_context

        context = open_context(self.environment, self.argv, lasting=lasting)
        if not lasting or self.environment.mode == "client":
            self._check_reached(context.session)
        return context

    def _check_reached(self, session: Session) -> None:
        from rosz.introspect import find_unreached

        for endpoint, dialler in find_unreached(session, self.environment).items():
            self.incomplete = True
            warn(
                f"{endpoint} is not reached {dialler}: what is there is missing here; 'rosz doctor'"
                " says why"
            )

    @contextmanager
    def lasting_node(self, tool: str) -> Iterator[Node]:
        """Open the node of a tool that runs until it is stopped."""
        from rosz.introspect import subscribe_samples  # noqa: F401  # later; Ctrl-C must not interrupt it
        from rosz.node import Node

        with (
            until_stopped() as ready,
            self.context(lasting=True) as context,
            Node(tool, anonymous=True, context=context) as node,
        ):
            ready()
            yield node

    @contextmanager
    def session_and_survey(self, nodes: Collection[str] = ()) -> Iterator[tuple[Session, Survey]]:
        """Open a session; take a survey of the domain with processes, and the nodes looked for."""
        from rosz.introspect import take_survey

        with self.session() as session:
            yield session, take_survey(session, self.domain, nodes=nodes, processes=True)

    def survey(self, *, processes: bool = False, dropped: bool = False) -> Survey:
        """Return the domain, with processes and counts of dropped samples if wanted."""
        from rosz.introspect import take_survey

        with self.session() as session:
            survey = take_survey(session, self.domain, processes=processes, dropped=dropped)
        for damage in survey.damaged:
            warn(f"ignoring an invalid name of a node or topic: {damage}")
        return survey


def new_group(text: str) -> App:
    """Return a described group of commands that take remappings anywhere, as ROS 1's tools do.

    So a command can be a node of a launch file.
    """
    return App(text, is_remapping=_is_remapping)


def _is_remapping(word: str) -> bool:
    left, separator, _ = word.partition(":=")
    return bool(separator and left) and names.is_valid(left.lstrip("_") or "x")
