"""The small worlds that are explored."""

from __future__ import annotations

import msgspec

from rosz.params.paths import Path
from rosz.params.writes import DELETED, Deleted

from .world import Setting


class Step(msgspec.Struct, frozen=True):
    """One call of a process: a value to set, or ``DELETED``.

    Attributes:
        machine: Machine of the process.
        path: Path that is written; if empty, the process ends.
        value: Value.
    """

    machine: str
    path: Path
    value: int | Deleted = 0


class Script(msgspec.Struct, frozen=True):
    """A small world.

    Attributes:
        setting: What it is made of.
        steps: Calls, those of one machine in this order.
        cuts: How often a link may be cut.
        crashes: How often a process may crash.
        losses: How many messages may be lost.
        advances: How many timers may fire early.
    """

    setting: Setting
    steps: tuple[Step, ...]
    cuts: int = 0
    crashes: int = 0
    losses: int = 0
    advances: int = 1


A, B = ("a",), ("a", "b")
_TWO = Setting(machines=2)
_TWO_STORED = Setting(machines=2, stored=3)
_THREE = Setting(machines=3)
_THREE_STORED = Setting(machines=3, stored=1)
_END = Step("a", ())

_FOUR = (Step("a", A, 1), Step("a", A, DELETED), Step("b", B, 2), Step("b", A, 3))

SCRIPTS: dict[str, Script] = {
    "two": Script(_TWO, (Step("a", A, 1), Step("b", B, 2))),
    "two, cut": Script(_TWO, (Step("a", A, 1), Step("b", A, 2)), cuts=1),
    "two, crash": Script(_TWO, (Step("a", A, 1), Step("b", B, 2)), crashes=1),
    "two, one, cut, crash": Script(_TWO, (Step("a", A, 1),), cuts=1, crashes=1),
    "two, stored": Script(_TWO_STORED, (Step("a", A, 1), Step("b", B, 2))),
    "two, stored, crash": Script(_TWO_STORED, (Step("a", A, 1), Step("b", B, 2)), crashes=1),
    "two, loss": Script(_TWO, (Step("a", A, 1), Step("b", B, 2)), losses=1, advances=2),
    "two, end": Script(_TWO, (Step("a", A, 1), _END), cuts=1, losses=1),
    "two, four": Script(_TWO, _FOUR),
    "two, four, cut, crash": Script(_TWO, _FOUR, cuts=1, crashes=1),
    "three": Script(_THREE, (Step("a", A, 1), Step("b", B, 2))),
    "three, one, cut": Script(_THREE, (Step("a", A, 1),), cuts=1),
    "three, one, crash": Script(_THREE, (Step("a", A, 1),), crashes=1),
    "three, one, cut, crash": Script(_THREE, (Step("a", A, 1),), cuts=1, crashes=1),
    "three, cut": Script(_THREE, (Step("a", A, 1), Step("b", B, 2)), cuts=1),
    "three, crash": Script(_THREE, (Step("a", A, 1), Step("a", B, 2)), crashes=1),
    "three, stored": Script(_THREE_STORED, (Step("a", A, 1), Step("b", B, 2)), crashes=1),
    "three, four": Script(_THREE, _FOUR),
    "three, four, cut, crash": Script(_THREE, _FOUR, cuts=1, crashes=1),
}
