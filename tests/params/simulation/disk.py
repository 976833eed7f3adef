"""The disk of a machine, with the file of its replica."""

from __future__ import annotations

from rosz.params.paths import Path
from rosz.params.replica.core.effects import Compact, Save
from rosz.params.replica.core.events import Saved
from rosz.params.writes import Write

FULL = "No space left on device"


class Disk:
    """A disk; `finish` carries out what was asked of it, `crash` loses the rest.

    Attributes:
        content: What a reader of the file sees.
        horizon: Horizon in the file.
        full: Whether nothing can be written.
        lies: Whether it says that writes are safe which a crash loses.
        slow: Seconds that it takes.
    """

    def __init__(self) -> None:
        self.content: dict[Path, Write] = {}
        self.horizon = 0
        self.full = False
        self.lies = False
        self.slow = 0.0
        self.pending: list[Save | Compact] = []
        self._safe: tuple[dict[Path, Write], int] = ({}, 0)

    def finish(self, count: int) -> Saved:
        """Carry out the oldest saves as one transaction; return what became of it."""
        done, self.pending = self.pending[:count], self.pending[count:]
        if self.full:
            return Saved(done[-1].number, FULL)
        content, horizon = dict(self.content), self.horizon
        for effect in done:
            if isinstance(effect, Compact):
                content, horizon = {}, effect.horizon
            for write in effect.writes:
                known = content.get(write.path)
                if known is None or known.order < write.order:
                    content[write.path] = write
        self.content, self.horizon = content, horizon
        if not self.lies:
            self._safe = content, horizon
        return Saved(done[-1].number)

    def crash(self) -> None:
        """Lose what is not safe."""
        self.pending = []
        self.content, self.horizon = self._safe

    def wipe(self) -> None:
        """Replace the disk by an empty one."""
        self.pending = []
        self.content, self.horizon = {}, 0
        self._safe = {}, 0

    def holds(self, write: Write) -> bool:
        """Tell whether the file has a write, or a newer one at its path or above."""
        for depth in range(len(write.path) + 1):
            found = self.content.get(write.path[:depth])
            if found is not None and found.order >= write.order:
                return True
        return write.time <= self.horizon
