"""The models of the running system, which all pages share."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path

from rosz.access import PagePolicy
from rosz.doctor import Examination, Finding, examine
from rosz.environment import Environment
from rosz.errors import RoszError
from rosz.graph import View
from rosz.introspect import Survey
from rosz.lifecycle import SharedResource
from rosz.node import Node
from rosz.web.model.actions import Actions
from rosz.web.model.bags import Bags
from rosz.web.model.console import LogBook
from rosz.web.model.frames import Frames
from rosz.web.model.launches import Launches
from rosz.web.model.parameters import ParameterModel
from rosz.web.model.pictures import PictureSources
from rosz.web.model.traffic import Traffic
from rosz.worker import Worker, run_task

_PERIOD = 30.0
_LISTEN = 0.5
_log = logging.getLogger("rosz.web")


class GraphWatch:
    """Follows all nodes and entities of the domain, until closed."""

    def __init__(self, node: Node) -> None:
        self._domain = node.context.domain
        self._followed = node.context.graph.follow_all()
        self._known: tuple[View, Survey] | None = None

    @property
    def complete(self) -> bool:
        """Whether everything that existed at the start is known."""
        return self._followed.complete

    def survey(self) -> Survey:
        """Return the current state; the object stays the same while nothing changes."""
        view = self._followed.view()
        current = self._known
        if current is None or current[0] is not view:
            processes = {(token.zid, token.node_id): token for token in view.processes()}
            current = self._known = view, Survey(self._domain, view, processes)
        return current[1]

    def close(self) -> None:
        """Stop following the graph."""
        self._followed.close()


class Findings:
    """Examines the system repeatedly, with pauses of 30 seconds, until closed.

    Args:
        environment: Settings of this machine.

    Attributes:
        found: The findings, or None until the first examination has ended.
        fault: Why the last examination failed; empty if it succeeded.
    """

    def __init__(self, environment: Environment) -> None:
        self.found: tuple[Finding, ...] | None = None
        self.fault: str = ""
        self._environment = environment
        self._worker = Worker("rosz-web-doctor", run_task, logger=_log)
        self._worker.submit(self._look)

    def _look(self) -> None:
        findings: list[Finding] = []
        fault = ""
        try:
            for finding in examine(Examination(environment=self._environment, listen=_LISTEN)):
                findings.append(finding)
                if self._worker.closed:
                    return
        except RoszError as error:
            fault = str(error)
        self.found, self.fault = tuple(findings), fault
        self._worker.later(_PERIOD, self._look)

    def close(self) -> None:
        """Stop, without waiting for the end of a running examination."""
        self._worker.close(timeout=0)


class System:
    """The models that the pages share.

    Args:
        node: Node of the pages. It is not closed with the system.
        permission: The changes that pages may make.
        bags: Folder of the bags; the working directory when not given.

    Attributes:
        graph: All nodes and entities.
        traffic: Rates and bandwidths of topics.
        findings: Findings of the doctor.
        launches: Running launches.
        console: The log of all nodes.
        parameters: The parameters of all nodes.
        frames: All frames and their transforms.
        pictures: The sources of pictures.
        actions: The goals that pages have sent.
        bags: The bags in the folder, the recording and the playback.
        drawing: Lock that is held while a graph is laid out, so that pages share the layout.
    """

    def __init__(self, node: Node, permission: PagePolicy, bags: Path | None = None) -> None:
        self.node = node
        self.permission = permission
        self.graph = SharedResource(lambda: GraphWatch(node))
        self.traffic = SharedResource(lambda: Traffic(node, permission))
        self.findings = SharedResource(lambda: Findings(node.context.environment))
        self.frames = SharedResource(lambda: Frames(node, permission))
        self.launches = SharedResource(lambda: Launches(node, permission))
        self.pictures = PictureSources()
        self.drawing = asyncio.Lock()
        self.actions: Actions = node.keep(Actions(node, permission))
        self.bags: Bags = node.keep(Bags(bags or Path(), permission))
        self.console = SharedResource(lambda: LogBook(node))
        self.parameters = SharedResource(lambda: ParameterModel(node, permission))
