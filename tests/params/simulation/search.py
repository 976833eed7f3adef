"""The search of a small world, depth first: quick to find what does not hold."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import msgspec

from .exploration import Exploration
from .scripts import Script
from .states import State, Told, story_of
from .violation import Violation


class Result(msgspec.Struct):
    """What an exploration found.

    Attributes:
        states: Number of states of the world.
        moves: Number of moves between them.
        ends: Number of states in which nothing was left to happen.
        finals: Hashes of these states, the same for each search of a world.
        processes: Number of different states of processes, those of quiet times among them.
        locals: Number of these with what is on its way to them, if that was counted.
        steps: Steps of cores that were made; the others were known.
        finished: Whether all states were explored.
        seconds: How long it took.
        finding: What did not hold.
    """

    states: int = 0
    moves: int = 0
    ends: int = 0
    finals: set[int] = set()
    processes: int = 0
    locals: int = 0
    steps: int = 0
    finished: bool = True
    seconds: float = 0.0
    finding: str = ""

    def __str__(self) -> str:
        end = "all" if self.finished else "not all"
        return (
            f"{self.states} states ({end}), {self.moves} moves, {self.ends} ends,"
            f" {self.processes} states of processes, {self.locals} local states,"
            f" {self.steps} steps, {self.seconds:.1f} s\n{self.finding}"
        ).rstrip()


def explore(
    script: Script, most: int = 1_000_000, tell: Callable[[Result, int], object] = lambda *_: None
) -> Result:
    """Explore all that may happen in a small world, up to a number of states.

    Args:
        script: The small world.
        most: Number of states to stop at.
        tell: Function called from time to time, with the result so far and the number of states
            that wait.
    """
    begun, result = time.monotonic(), Result()
    path: Any = None
    exploration = Exploration(script)
    try:
        first = exploration.first()
        met = {hash(first)}
        stack: list[tuple[State, Any]] = [(first, None)]
        while stack:
            if result.states >= most:
                result.finished = False
                break
            state, path = stack.pop()
            result.states += 1
            if not result.states % 10_000:
                result.seconds = time.monotonic() - begun
                tell(result, len(stack))
            is_end = True
            for _, successor, told in exploration.successors(state):
                is_end = False
                result.moves += 1
                form = hash(successor)
                if form not in met:
                    met.add(form)
                    stack.append((successor, (path, told)))
            if is_end:
                result.ends += 1
                result.finals.add(exploration.form_of(state))
                exploration.finish(state)
    except Violation as violation:
        steps: list[Told] = []
        while path is not None:
            path, told = path
            steps.append(told)
        story = story_of([line for told in reversed(steps) for line in told])
        result.finding = f"{violation}\nafter:\n{story}"
        result.finished = False
    result.processes = len(exploration.stage.states)
    result.steps = exploration.stage.steps
    result.seconds = time.monotonic() - begun
    return result
