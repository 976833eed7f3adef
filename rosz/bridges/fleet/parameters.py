"""The parameters of a robot, which have the prefix of the robot beyond its machine.

Each side has a replica, and a write to the one is written to the other with its time. So
of two writes to one parameter the later one stays on both sides, whichever passes first.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from rosz.bridges.fleet.plan import FleetPlan
from rosz.bridges.fleet.relays import log
from rosz.errors import ClosedError, DecodeError, ParamError
from rosz.lifecycle import Lifecycle
from rosz.params import DELETED, MISSING, Change, Path, Value, condense, joined, leaves, split
from rosz.params.replica import Changed, Replica
from rosz.session import Stamp

_ORIGIN = "the crossing of"


class ParameterCrossing:
    """Keeps the parameters of two replicas the same, until closed.

    At the start, a parameter that both have keeps the value that it has on the machine.
    """

    def __init__(self, plan: FleetPlan, inside: Replica, outside: Replica) -> None:
        self._plan = plan
        self._origin = f"{_ORIGIN} {plan.prefix}"
        self._lifecycle = Lifecycle(f"the parameters of '{plan.prefix}'", log=log)
        ways = ((inside, outside, self._outside), (outside, inside, self._inside))
        for source, target, rename in ways:
            pass_on = partial(self._pass, source, target, rename)
            self._lifecycle.keep(source.watch("/", pass_on))
        self._pass_all(inside, outside, self._outside, replace=True)
        self._pass_all(outside, inside, self._inside, replace=False)

    def close(self) -> None:
        """End it; a second call has no effect."""
        self._lifecycle.close()

    def _outside(self, path: Path) -> Path | None:
        name = joined(path)
        outside = self._plan.outside(name) if self._plan.shares(name) else None
        return None if outside is None else split(outside)

    def _inside(self, path: Path) -> Path | None:
        name = self._plan.inside(joined(path))
        return split(name) if name and self._plan.takes(name) else None

    def _pass_all(
        self,
        source: Replica,
        target: Replica,
        rename: Callable[[Path], Path | None],
        *,
        replace: bool,
    ) -> None:
        changes: list[Change] = []
        for path, value in leaves(source.root):
            there = rename(path) if path else None
            if there is None:
                continue
            present = target.lookup(there)
            if present is MISSING or (replace and present != value):
                changes.append((there, value))
        self._write(target, changes, None)

    def _pass(
        self,
        source: Replica,
        target: Replica,
        rename: Callable[[Path], Path | None],
        changed: Changed,
    ) -> None:
        """Write a change to the other side, one leaf at a time; on the thread of a replica."""
        if changed.origin == self._origin:
            return
        base = split(changed.name)
        old, new = _leaves(changed.old, base), _leaves(changed.new, base)
        changes: list[Change] = []
        for path in old.keys() | new.keys():
            there = rename(path) if path else None
            if there is None:
                continue
            if path in new:
                changes.append((there, new[path]))
            elif target.lookup(there) is not MISSING:
                changes.append((there, DELETED))
        # A leaf that became a dict is deleted before the values below it are set.
        changes.sort(key=lambda change: (change[1] is not DELETED, len(change[0])))
        self._write(target, changes, Stamp(changed.time, source.zid))

    def _write(self, target: Replica, changes: list[Change], stamp: Stamp | None) -> None:
        if not changes:
            return
        try:
            target.write(condense(changes), origin=self._origin, stamp=stamp)
        except ClosedError:
            return
        except (ParamError, DecodeError) as error:
            log.warning("parameters do not pass: %s", error)


def _leaves(value: Value | None, base: Path) -> dict[Path, Value]:
    return {} if value is None else dict(leaves(value, base))
