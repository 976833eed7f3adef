"""The system that the pages show: what they observe together, and what they change."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

from rosz.introspect.survey import Survey
from rosz.web.model.actions import Actions
from rosz.web.model.bags import Bags
from rosz.web.model.console import LogBook
from rosz.web.model.findings import Findings
from rosz.web.model.frames import Frames
from rosz.web.model.launches import Launches
from rosz.web.model.parameters import Parameters
from rosz.web.model.permission import Permission
from rosz.web.model.pictures import Pictures
from rosz.web.model.sharing import Shared
from rosz.web.model.traffic import Traffic

if TYPE_CHECKING:
    from rosz.graph import View
    from rosz.node import Node

__all__ = ("GraphWatch", "System")


class GraphWatch:
    """All nodes and entities of the domain, followed until it is closed.

    Args:
        node: The node that follows them.
    """

    def __init__(self, node: Node) -> None:
        self._domain = node.context.domain
        self._followed = node.context.graph.follow_all()
        self._known: tuple[View, Survey] | None = None

    @property
    def complete(self) -> bool:
        """Whether all is known that existed when it began."""
        return self._followed.complete

    def survey(self) -> Survey:
        """Return what is known at this moment; the same object while nothing changes."""
        view = self._followed.view()
        known = self._known
        if known is None or known[0] is not view:
            processes = {(one.zid, one.node_id): one for one in view.processes()}
            known = self._known = view, Survey(self._domain, view, processes)
        return known[1]

    def close(self) -> None:
        """Follow them no longer."""
        self._followed.close()


class System:
    """The models that the pages share.

    Args:
        node: Node of the page. It is not closed with the system.
        permission: What the pages may change.
        bags: Folder of the bags; the working directory when not given.

    Attributes:
        node: Node of the page.
        permission: What the pages may change.
        graph: All nodes and entities.
        traffic: Rates and bandwidths of topics.
        findings: Findings of the doctor.
        launches: Running launches.
        console: The log of all nodes.
        parameters: The parameters of all nodes.
        frames: All frames and their transforms.
        pictures: The sources of pictures.
        actions: The goals that pages have sent.
        bags: The bags of the folder, a recording, and one that plays.
        drawing: Held while a graph is drawn: pages that show the same share its layout.
    """

    def __init__(self, node: Node, permission: Permission, bags: Path | None = None) -> None:
        self.node = node
        self.permission = permission
        self.graph: Shared[GraphWatch] = Shared(lambda: GraphWatch(node))
        self.traffic: Shared[Traffic] = Shared(lambda: Traffic(node, permission))
        self.findings: Shared[Findings] = Shared(lambda: Findings(node.context.environment))
        self.frames: Shared[Frames] = Shared(lambda: Frames(node, permission))
        self.launches: Shared[Launches] = Shared(lambda: Launches(node, permission))
        self.pictures = Pictures()
        self.drawing = asyncio.Lock()
        self.actions: Actions = node.keep(Actions(node, permission))
        self.bags: Bags = node.keep(Bags(bags or Path(), permission))
        self.console: Shared[LogBook] = Shared(lambda: LogBook(node))
        self.parameters: Shared[Parameters] = Shared(lambda: Parameters(node, permission))

    @property
    def observed(self) -> int:
        """Number of uses that pages have open."""
        shared = (
            self.graph,
            self.traffic,
            self.findings,
            self.frames,
            self.launches,
            self.console,
            self.parameters,
        )
        return sum(one.users for one in shared)
