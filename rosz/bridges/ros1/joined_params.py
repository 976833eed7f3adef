"""The parameters of a master that a bridge has joined: both sides keep the same."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rosz.access import NamePattern, matches_any
from rosz.bridges.ros1.shared import BRIDGE, BridgeResources
from rosz.bridges.ros1.sockets import log
from rosz.errors import EncodeError, ParamNotFound, RoszError
from rosz.params import DELETED, MISSING, Deleted, Draft, Value, leaves, lookup, normalise, split
from rosz.params.replica import Changed
from rosz.worker import Worker

RUN_ID = "/run_id"
"""The parameter that tells one run of a master from the next."""

_OWN_PARAMS = (RUN_ID, "/rosdistro", "/rosversion", "/roslaunch")
"""Parameters that tell of one master, and belong to it alone."""


class JoinedParameters:
    """Keeps the parameters of a master and of the network the same.

    The values that both had last tell which side has changed since: the master may tell a change
    late, when the network has a newer value. Everything but `changed` and `update` runs on the
    thread of the worker.

    Args:
        worker: Thread on which the master is called.
        call: Function that calls a method of the master.
        patterns: Patterns of the parameters of ROS 1 that cross; all if there is none.

    Attributes:
        active: Whether this bridge is the one that works, of several to one master.
    """

    def __init__(
        self,
        shared: BridgeResources,
        worker: Worker[Callable[[], object]],
        call: Callable[..., Any],
        patterns: tuple[NamePattern, ...],
    ) -> None:
        self.active = False
        self._shared = shared
        self._worker = worker
        self._call = call
        self._patterns = patterns
        self._agreed: dict[str, Value] = {}

    def join(self, uri: str) -> None:
        """Make the parameters of both equal; where they differ, the master's count.

        Args:
            uri: URI of the bridge, which the master tells changes to.

        Raises:
            RoszError: The master cannot be reached.
        """
        theirs = self._call("subscribeParam", uri, "/")
        params, shared = self._shared.context.params, self._shared
        tree = theirs if isinstance(theirs, dict) else {}
        values = {f"/{'/'.join(path)}": value for path, value in leaves(tree) if path}
        changes = []
        for name, value in values.items():
            if self._crosses(name):
                path = split(shared.here(name))
                if params.lookup(path) != value:
                    changes.append((path, normalise(value, name)))
        params.write(changes, origin=shared.name)
        self._agreed = normalise(tree)
        for name in params.names():
            there = shared.there(name)
            if there is not None and there not in values and self._crosses(there):
                self._send(there, params.peek(name))

    def _crosses(self, name: str) -> bool:
        own = any(name == each or name.startswith(f"{each}/") for each in _OWN_PARAMS)
        return not own and matches_any(self._patterns, name)

    def _send(self, name: str, value: Value | None) -> None:
        try:
            if value is None:
                self._call("deleteParam", name)
            else:
                self._call("setParam", name, value)
        except EncodeError as error:
            log.warning("parameter '%s' stays here: %s", name, error)
        except RoszError as error:
            log.info("parameter '%s' is not set at the master: %s", name, error)
        else:
            self._agree(name, DELETED if value is None else value)

    def _agree(self, name: str, value: Value | Deleted) -> None:
        draft = Draft(self._agreed)
        draft.change(split(name), value)
        self._agreed = draft.root

    def changed(self, changed: Changed) -> None:
        """Pass a change on to the master; runs on the thread for watches."""
        name = self._shared.there(changed.name)
        if changed.origin != self._shared.name and name is not None and self._crosses(name):
            self._worker.submit(partial(self._pass_on, name, changed))

    def _pass_on(self, name: str, changed: Changed) -> None:
        present = self._shared.context.params.lookup(split(changed.name))
        if not self.active or not _same(present, MISSING if changed.new is None else changed.new):
            return  # a newer change is told next; the master may have it already
        if changed.origin.startswith(BRIDGE):  # nothing crosses two bridges
            self._agree(name, DELETED if changed.new is None else changed.new)
        else:
            self._send(name, changed.new)

    def update(self, key: str, _value: Any) -> None:
        """Take a change of the master; runs on a thread of the server."""
        self._worker.submit(partial(self._take, f"/{key.strip('/')}"))

    def _take(self, name: str) -> None:
        """Set a parameter to the master's present value, which may be newer than the one told."""
        if not self.active or not self._crosses(name):
            return
        params, here = self._shared.context.params, self._shared.here(name)
        try:
            there: Value | Deleted = DELETED
            if self._call("hasParam", name):
                there = normalise(self._call("getParam", name), name)
            if _same(lookup(self._agreed, split(name)), MISSING if there is DELETED else there):
                return
            self._agree(name, there)
            if there is DELETED:
                params.delete(here, origin=self._shared.name)
            elif not _same(params.lookup(split(here)), there):  # else it could go round a ring
                params.set(here, there, origin=self._shared.name)
        except ParamNotFound:
            return
        except RoszError as error:
            log.warning("parameter '%s' of ROS 1 is not set here: %s", name, error)


def _same(value: Any, other: Any) -> bool:
    return type(value) is type(other) and bool(value == other)
