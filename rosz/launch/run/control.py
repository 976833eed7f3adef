"""Questions and orders to a running launch, from another terminal.

A launch answers on ``@rosz/<domain>/launch/<run id>/<session>``; requests and answers are JSON.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from typing import Literal

import msgspec

from rosz.errors import LaunchError, NotFoundError, RoszError, WaitTimeout, near_miss
from rosz.launch.run.family import Usage
from rosz.launch.run.loop import Loop, Timer
from rosz.launch.run.process import Process
from rosz.launch.run.summary import exit_reason
from rosz.launch.run.supervisor import Supervisor
from rosz.lifecycle import Closable
from rosz.session import Query, Reply, Session
from rosz.wire import own_key

__all__ = ("LaunchStatus", "NodeStatus", "Order", "Panel", "order", "statuses")

_STATUS_SECONDS = 2.0
_ORDER_SECONDS = 60.0
_MEASURE_SECONDS = 1.0


class Order(msgspec.Struct, frozen=True):
    """What is asked of a launch.

    Attributes:
        action: ``status``, or ``restart`` or ``stop`` of a node.
        node: Full name of the node.
    """

    action: Literal["status", "restart", "stop"]
    node: str = ""


class NodeStatus(msgspec.Struct, frozen=True):
    """One node of a running launch.

    Attributes:
        name: Full name.
        type: ``package/type``, or the command.
        state: ``waiting``, ``running``, ``stopping``, ``respawning``, ``ended`` or ``failed``.
        detail: Why it ended or failed; empty while it runs.
        pid: Process id; 0 when it does not run.
        restarts: How often it was started again.
        uptime: Seconds since its latest start; 0 when it does not run.
        cpu: Seconds of processor time that it and its descendants have used.
        memory: Bytes that they hold.
        machine: Where it runs: the address of another machine, or the name of the launch's own.
    """

    name: str
    type: str
    state: str
    detail: str
    pid: int
    restarts: int
    uptime: float
    cpu: float
    memory: int
    machine: str = ""


class LaunchStatus(msgspec.Struct, frozen=True):
    """A running launch.

    Attributes:
        run_id: Id of the run; launches that share a parameter store share it.
        host: Name of the machine.
        pid: Process id of the launch.
        files: Launch files, as absolute paths.
        sampled: When the figures were taken, in seconds of that machine's monotonic clock.
        nodes: Its nodes, in order.
    """

    run_id: str
    host: str
    pid: int
    files: tuple[str, ...]
    sampled: float
    nodes: tuple[NodeStatus, ...]


class Panel:
    """The answering side.

    Args:
        session: Where questions come from.
        domain: The ROS domain.
        run_id: Id of the run.
        loop: Where orders are carried out.
        supervisor: Who carries them out.
        files: Launch files.
    """

    def __init__(
        self,
        session: Session,
        domain: int,
        run_id: str,
        loop: Loop,
        supervisor: Supervisor,
        *,
        files: tuple[str, ...],
    ) -> None:
        self._run_id = run_id
        self._loop = loop
        self._supervisor = supervisor
        self._files = files
        self._key = own_key(domain, "launch", run_id, session.zid)
        self._queryable: Closable = session.queryable(
            self._key, lambda query: loop.post(lambda: self._serve(query))
        )

    def _serve(self, query: Query) -> None:
        try:
            asked = msgspec.json.decode(query.payload or b"", type=Order)
            self._carry_out(asked, lambda: self._measure(lambda used: self._answer(query, used)))
        except (msgspec.MsgspecError, RoszError) as error:
            with query:
                query.reply_error(str(error))

    def _carry_out(self, asked: Order, done: Callable[[], None]) -> None:
        if asked.action == "status":
            done()
        elif self._supervisor.closing:
            raise LaunchError("this launch is ending")
        elif asked.action == "restart":
            self._supervisor.restart(self._supervisor.find(asked.node), done)
        else:
            self._supervisor.stop(self._supervisor.find(asked.node), done)

    def _measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Have all machines count what is used there; those that take too long are left out."""
        total: dict[int, Usage] = {}
        waiting = len(self._supervisor.hosts)
        timer: Timer | None = None

        def finish() -> None:
            nonlocal waiting
            waiting = 0
            if timer is not None:
                timer.cancel()
            done(total)

        def add(used: dict[int, Usage]) -> None:
            nonlocal waiting
            total.update(used)
            waiting -= 1
            if waiting == 0:
                finish()

        if not waiting:
            done(total)
            return
        timer = self._loop.later(_MEASURE_SECONDS, finish)
        for host in self._supervisor.hosts:
            host.measure(add)

    def _answer(self, query: Query, used: dict[int, Usage]) -> None:
        with query:
            query.reply(self._key, msgspec.json.encode(self._status(used)))

    def _status(self, used: dict[int, Usage]) -> LaunchStatus:
        return LaunchStatus(
            run_id=self._run_id,
            host=socket.gethostname(),
            pid=os.getpid(),
            files=self._files,
            sampled=time.monotonic(),
            nodes=tuple(
                self._node(process, used.get(process.owner, Usage()))
                for process in self._supervisor.processes
            ),
        )

    def _node(self, process: Process, used: Usage) -> NodeStatus:
        node = process.node
        detail = process.error
        if process.over and not detail:
            detail = exit_reason(process.code)
        return NodeStatus(
            name=node.full_name,
            type=f"{node.package}/{node.type}" if node.package else " ".join(node.command),
            state=process.state.value,
            detail=detail,
            pid=process.child.pid if process.child and process.alive else 0,
            restarts=max(0, process.starts - 1),
            uptime=self._loop.now() - process.began if process.alive else 0.0,
            cpu=used.cpu,
            memory=used.memory,
            machine=process.place or socket.gethostname(),
        )

    def close(self) -> None:
        """Answer no more; again is no error."""
        self._queryable.close()


def statuses(session: Session, domain: int) -> list[LaunchStatus]:
    """Return all running launches of a domain.

    Raises:
        LaunchError: What a launch answers makes no sense.
        WaitTimeout: A launch is there but does not answer.
    """
    return [status for _, status in _running(session, domain)]


def order(session: Session, domain: int, action: Literal["restart", "stop"], node: str) -> None:
    """Have a node restarted or stopped by the launch that runs it.

    Args:
        session: The network.
        domain: The ROS domain.
        action: What to do.
        node: Name of the node.

    Raises:
        NotFoundError: No running launch has such a node.
        LaunchError: The launch refuses, or the node could not be started again.
        WaitTimeout: The launch does not answer.
    """
    name = f"/{node.strip('/')}"
    running = _running(session, domain)
    known = [entry.name for _, status in running for entry in status.nodes]
    if name not in known:
        listing = f"; there are {', '.join(sorted(known))}" if known else "; no launch is running"
        raise NotFoundError(f"no launch runs a node '{name}'{near_miss(name, known) or listing}")
    for key, status in running:
        if any(entry.name == name for entry in status.nodes):
            _order(session, key, Order(action, name))


def _order(session: Session, key: str, asked: Order) -> None:
    replies = session.get(key, payload=msgspec.json.encode(asked), timeout=_ORDER_SECONDS)
    if not replies:
        raise LaunchError(f"the launch of '{asked.node}' ended without an answer")
    if not replies[0].ok:
        raise LaunchError(replies[0].payload.decode(errors="replace"))
    status = _read(replies[0])
    after = next(entry for entry in status.nodes if entry.name == asked.node)
    if asked.action == "restart" and after.state != "running":
        raise LaunchError(f"'{asked.node}' did not start again: {after.detail}")


def _running(session: Session, domain: int) -> list[tuple[str, LaunchStatus]]:
    replies = session.get(
        own_key(domain, "launch", "*", "*"),
        payload=msgspec.json.encode(Order("status")),
        timeout=_STATUS_SECONDS,
    )
    found = [(reply.key, _read(reply)) for reply in replies if reply.ok]
    if replies and not found:
        raise WaitTimeout("answer from a running launch", _STATUS_SECONDS)
    return sorted(found, key=lambda pair: (pair[1].host, pair[1].pid))


def _read(reply: Reply) -> LaunchStatus:
    try:
        return msgspec.json.decode(reply.payload, type=LaunchStatus)
    except msgspec.MsgspecError as error:
        raise LaunchError(
            f"what a launch answers at '{reply.key}' makes no sense: {error}; is it of another"
            " version of rosz?"
        ) from error
