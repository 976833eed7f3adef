"""The status of running launches, the output of their nodes, and requests to restart or stop them.

A launch replies on ``@rosz/<domain>/launch/<run id>/<session>``; requests and replies are JSON.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from typing import Literal, TypeVar

import msgspec

from rosz.errors import LaunchError, NotFoundError, RoszError, WaitTimeout, near_miss
from rosz.launch.run.excerpt import Excerpt, Position
from rosz.launch.run.loop import Loop, LoopTimer
from rosz.launch.run.process_tree import Usage
from rosz.launch.run.supervisor import LaunchProcess, Supervisor, describe_exit
from rosz.lifecycle import Closable
from rosz.session import Query, Reply, Session
from rosz.wire import own_key

_STATUS_TIMEOUT = 2.0
_ACTION_TIMEOUT = 60.0
_MEASURE_TIMEOUT = 1.0
_OUTPUT_TIMEOUT = 15.0

T = TypeVar("T")


class StatusRequest(msgspec.Struct, frozen=True):
    """A request to a launch.

    Attributes:
        action: ``status``, or ``restart``, ``stop`` or ``output`` for a node.
        after: Position of the output that is known already.
    """

    action: Literal["status", "restart", "stop", "output"]
    node: str = ""
    after: Position | None = None


class NodeStatus(msgspec.Struct, frozen=True):
    """One node of a running launch.

    Attributes:
        type: ``package/type``, or the command.
        state: ``waiting``, ``running``, ``stopping``, ``respawning``, ``ended`` or ``failed``.
        detail: Reason why it ended or failed, or "" while it runs.
        pid: Process id, or 0 if it does not run.
        uptime: Time since its latest start in seconds, or 0 if it does not run.
        cpu: Processor time that it and its descendants have used in seconds.
        memory: Memory that they hold in bytes.
        machine: Address of the other machine, or the name of the launch's own.
        members: Names of the nodes in it, if it is a container.
        required: Whether its end by itself ends the launch.
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
    members: tuple[str, ...] = ()
    required: bool = False


class LaunchStatus(msgspec.Struct, frozen=True):
    """A running launch.

    Attributes:
        run_id: Id of the run; launches that share a parameter store share it.
        files: Launch files, as absolute paths.
        sampled: Time of the figures in seconds of that machine's monotonic clock.
    """

    run_id: str
    host: str
    pid: int
    files: tuple[str, ...]
    sampled: float
    nodes: tuple[NodeStatus, ...]


class StatusServer:
    """Replies to requests about one launch."""

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
            self._key, lambda query: loop.post(lambda: self._handle(query))
        )

    def _handle(self, query: Query) -> None:
        try:
            request = msgspec.json.decode(query.payload or b"", type=StatusRequest)
            if request.action == "output":
                process = self._supervisor.find(request.node)
                process.host.read_output(
                    process.owner, request.after, lambda excerpt: self._send(query, excerpt)
                )
            else:
                self._run(
                    request,
                    lambda: self._measure(lambda used: self._send(query, self._status(used))),
                )
        except (msgspec.MsgspecError, RoszError) as error:
            with query:
                query.reply_error(str(error))

    def _run(self, request: StatusRequest, done: Callable[[], None]) -> None:
        if request.action == "status":
            done()
        elif self._supervisor.closing:
            raise LaunchError("this launch is ending")
        elif request.action == "restart":
            self._supervisor.restart(self._supervisor.find(request.node), done)
        else:
            self._supervisor.stop(self._supervisor.find(request.node), done)

    def _measure(self, done: Callable[[dict[int, Usage]], None]) -> None:
        """Collect the resources used on all machines, except those that take too long."""
        total: dict[int, Usage] = {}
        waiting = len(self._supervisor.hosts)
        timer: LoopTimer | None = None

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
        timer = self._loop.later(_MEASURE_TIMEOUT, finish)
        for host in self._supervisor.hosts:
            host.measure(add)

    def _send(self, query: Query, reply: msgspec.Struct) -> None:
        with query:
            query.reply(self._key, msgspec.json.encode(reply))

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

    def _node(self, process: LaunchProcess, used: Usage) -> NodeStatus:
        node = process.node
        detail = process.error
        if process.over and not detail:
            detail = describe_exit(process.code, lost=process.lost)
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
            machine=process.host.place or socket.gethostname(),
            members=tuple(member.full_name for member in node.members),
            required=node.required,
        )

    def close(self) -> None:
        """Reply no more; a second call has no effect."""
        self._queryable.close()


class StatusClient:
    """Sends requests to running launches."""

    def __init__(self, session: Session, domain: int) -> None:
        self._session = session
        self._domain = domain

    def running(self) -> dict[str, LaunchStatus]:
        """Return all running launches of the domain, by the keys that they reply on.

        Raises:
            LaunchError: If a launch sends a reply that is not valid.
            WaitTimeout: If a launch runs but does not reply.
        """
        replies = self._session.get(
            own_key(self._domain, "launch", "*", "*"),
            payload=msgspec.json.encode(StatusRequest("status")),
            timeout=_STATUS_TIMEOUT,
        )
        launches = [(reply.key, _decode(reply, LaunchStatus)) for reply in replies if reply.ok]
        if replies and not launches:
            raise WaitTimeout("answer from a running launch", _STATUS_TIMEOUT)
        return dict(sorted(launches, key=lambda pair: (pair[1].host, pair[1].pid)))

    def request(self, action: Literal["restart", "stop"], node: str) -> None:
        """Restart or stop a node, and wait until that is done.

        Raises:
            NotFoundError: If no running launch has such a node.
            LaunchError: If the launch refuses, or the node could not be started again.
            WaitTimeout: If the launch does not reply.
        """
        name, keys = self._launches_of(node)
        for key in keys:
            self.act(key, action, name)

    def newest_output(self, node: str) -> list[Excerpt]:
        """Return the newest output of a node, from each launch that runs one of that name.

        Raises:
            NotFoundError: If no running launch has such a node.
            LaunchError: If the launch has ended.
            WaitTimeout: If the launch does not reply.
        """
        name, keys = self._launches_of(node)
        return [self.read_output(key, name) for key in keys]

    def act(self, key: str, action: Literal["restart", "stop"], node: str) -> None:
        """Restart or stop a node, by its full name, of one launch, and wait until that is done.

        Raises:
            LaunchError: If the launch refuses, or the node could not be started again.
        """
        reply = self._send(key, StatusRequest(action, node), _ACTION_TIMEOUT)
        status = _decode(reply, LaunchStatus)
        after = next(entry for entry in status.nodes if entry.name == node)
        if action == "restart" and after.state != "running":
            raise LaunchError(f"'{node}' did not start again: {after.detail}")

    def read_output(self, key: str, node: str, after: Position | None = None) -> Excerpt:
        """Return output of a node, by its full name, of one launch.

        It is the output after a position that is known already, or the newest.

        Raises:
            LaunchError: If the launch has no such node, or has ended.
        """
        reply = self._send(key, StatusRequest("output", node, after), _OUTPUT_TIMEOUT)
        return _decode(reply, Excerpt)

    def _launches_of(self, node: str) -> tuple[str, list[str]]:
        """Return the full name of a node, and the keys of the launches that run it."""
        name = f"/{node.strip('/')}"
        running = self.running()
        names = [entry.name for status in running.values() for entry in status.nodes]
        for entry in (entry for status in running.values() for entry in status.nodes):
            if name in entry.members:
                raise NotFoundError(
                    f"node '{name}' has no process of its own: it is in container '{entry.name}',"
                    f" which can be restarted or stopped; 'rosz node kill {name}' ends the node"
                )
        if name not in names:
            listing = f"; there are {', '.join(sorted(names))}" if names else ""
            hint = near_miss(name, names) or listing or "; no launch is running"
            raise NotFoundError(f"no launch runs a node '{name}'{hint}")
        return name, [
            key
            for key, status in running.items()
            if any(entry.name == name for entry in status.nodes)
        ]

    def _send(self, key: str, request: StatusRequest, timeout: float) -> Reply:
        payload = msgspec.json.encode(request)
        replies = self._session.get(key, payload=payload, timeout=timeout)
        if not replies:
            raise LaunchError(f"the launch of '{request.node}' ended without a reply")
        if not replies[0].ok:
            raise LaunchError(replies[0].payload.decode(errors="replace"))
        return replies[0]


def _decode(reply: Reply, kind: type[T]) -> T:
    try:
        return msgspec.json.decode(reply.payload, type=kind)
    except msgspec.MsgspecError as error:
        raise LaunchError(
            f"the reply of a launch at '{reply.key}' is not valid: {error}; does it run another"
            " version of rosz?"
        ) from error
