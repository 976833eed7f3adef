"""The states of single machines, each with what is on its way to it.

A state of a world is a combination of few of these. They have numbers, and so have the results of
what changes one of them: a process that makes a move, things that are sent to it, and tokens of
others that show that looking at them is in vain.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from .copies import Form
from .exploration import Exploration
from .stage import next_due, serves
from .tables import Array, Facts, Index, Numbers, looked_up

NOTHING = 0
"""The local state of a machine on which no process runs."""


class Local(NamedTuple):
    """A local state.

    Attributes:
        process: Number of the state of the process; 0 if none runs.
        items: Numbers of what is on its way to it, sorted.
    """

    process: int = 0
    items: tuple[int, ...] = ()


class Face(NamedTuple):
    """What others may see of a process."""

    zid: str
    token: bool
    seed: bool
    start: int


class LocalStates:
    """The local states of a small world, and facts about them.

    Args:
        exploration: Explores the world.

    Attributes:
        facts: ``process``; ``face``, the number of what others see; ``serves``, whether it takes
            calls; ``due``, the time of the next timer; ``waits``, ``own``, ``loses`` and ``looks``,
            whether there is anything on its way, what the machine finds out about itself, a message
            that can be lost, and something to look at; ``asks``, the numbers of queries that are
            on their way to it or back to it, as bits, for each session; ``judged``, the number of
            what promises to others depend on.
    """

    def __init__(self, exploration: Exploration) -> None:
        script = exploration.script
        self._exploration = exploration
        self._numbers = Numbers()
        self._zids, self._faces, self._judged = Numbers(""), Numbers(None), Numbers(None)
        self._bundles = Numbers(())
        self._of_process: dict[int, dict[str, Any]] = {}
        lives = 2 + script.crashes + len(script.steps)
        self._sessions = 1 + lives * len(exploration.machines)
        self.facts = Facts(
            process=(np.int32, 0),
            zid=(np.int64, 0),
            face=(np.int64, 0),
            serves=(bool, 0),
            due=(np.float64, 0),
            waits=(bool, 0),
            own=(bool, 0),
            loses=(bool, 0),
            looks=(bool, 0),
            asks=(np.uint64, self._sessions),
            judged=(np.int64, 0),
        )
        self._with_more, self._without_looks = Index(), Index()
        self.of(0, ())

    def __getitem__(self, number: int) -> Local:
        local: Local = self._numbers.things[number]
        return local

    @property
    def size(self) -> int:
        """Number of local states."""
        return self.facts.size

    def bundle(self, items: Iterable[int]) -> int:
        """Return the number of some things that are sent together; 0 if there are none."""
        return self._bundles.of(tuple(items))

    def of(self, process: int, items: Iterable[int]) -> int:
        """Return the number of a local state, without what cannot reach its process."""
        exploration = self._exploration
        every, zid = exploration.items, exploration.stage.states[process].zid if process else ""
        kept: list[int] = []
        for number in items:
            item = every[number]
            if item.zid == zid and (item.kind == "deliver" or number not in kept):
                kept.append(number)
        local = Local(process, tuple(sorted(kept)))
        number = self._numbers.of(local)
        if number == self.facts.size:
            self._note(local)
        return number

    def _note(self, local: Local) -> None:
        exploration = self._exploration
        items = [exploration.items[number] for number in local.items]
        asks = [0] * self._sessions
        for zid, query in (item.query for item in items if item.query):
            asks[self._zids.of(zid)] |= 1 << query
        if not local.process:
            self.facts.add(process=0, face=0, due=np.inf, asks=asks)
            return
        self.facts.add(
            **self._facts_of(local.process),
            waits=bool(items),
            own=any(item.is_own for item in items),
            loses=any(item.can_be_lost for item in items),
            looks=any(item.kind == "look" for item in items),
            asks=asks,
        )

    def _facts_of(self, number: int) -> dict[str, Any]:
        """Return the facts that follow from the process alone."""
        facts = self._of_process.get(number)
        if facts is None:
            process = self._exploration.stage.states[number]
            due = next_due(process, urgent=True)
            closes = process.joined and not serves(process)
            form = Form().of((process.core.history, process.disk))
            face = Face(process.zid, process.token, process.seed, process.member.start)
            facts = self._of_process[number] = {
                "process": number,
                "zid": self._zids.of(process.zid),
                "face": self._faces.of(face),
                "serves": serves(process),
                "due": due[0] if due else np.inf,
                "judged": self._judged.of((process.zid, closes, form)),
            }
        return facts

    def asked_by(self, zids: Array, locals_: Array) -> Array:
        """Return the numbers of the queries of a session that are on their way, as bits."""
        asked: Array = self.facts["asks"][locals_, zids]
        return asked

    def with_more(self, locals_: Array, bundles: Array) -> Array:
        """Return local states after things were sent to them."""

        def made(key: int) -> int:
            process, items = self[key >> 32]
            return self.of(process, (*items, *self._bundles.things[key & 0xFFFFFFFF]))

        return looked_up(self._with_more, locals_.astype(np.int64) << 32 | bundles, made)

    def without_looks(self, locals_: Array, faces: list[Array], cuts: Array) -> Array:
        """Return local states without looks that show nothing new; see `Exploration.freeze`.

        Args:
            locals_: Local states.
            faces: Faces of the processes of all machines.
            cuts: For each machine, as bits, whether its link is cut.
        """
        key = locals_.astype(np.int64) << 32 | cuts
        for index, face in enumerate(faces):
            key |= face << 8 * (index + 1)
        return looked_up(self._without_looks, key, self._unlooked)

    def _unlooked(self, key: int) -> int:
        exploration = self._exploration
        number, items = self[key >> 32]
        process = exploration.stage.states[number]
        kept: list[int] = []
        for place in items:
            item = exploration.items[place]
            if item.kind == "look":
                index = exploration.machines.index(item.source[0])
                face = self._faces.things[key >> 8 * (index + 1) & 0xFF]
                is_there = face and face.zid == item.source and not key >> index & 1
                seed, token = (face.seed, face.token) if is_there else (False, False)
                watched = process.watching and token != (item.source in process.members)
                if seed == (item.source in process.seeds) and not watched:
                    continue
            kept.append(place)
        return self.of(number, kept)
