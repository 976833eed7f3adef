"""The bags that commands read, and the options that choose of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Annotated

from rosz.cli import suggest
from rosz.cli.console import print_error
from rosz.cli.declare import Argument, Option, no_less_than_zero
from rosz.errors import NotFoundError, UsageError, near_miss

if TYPE_CHECKING:
    from rosz.bags import BagReader, Entry
    from rosz.errors import BagError

__all__ = ("BagArgument", "End", "Input", "Problems", "Start", "Topics", "check_times", "open_bags")

_NS = 1_000_000_000

BagArgument = Annotated[str, Argument("BAG", source=suggest.files)]
Topics = Annotated[
    list[str] | None, Option("--topics TOPIC", "Take these topics only; several may follow.")
]
Start = Annotated[float, Option("-s --start SECONDS", "Leave out the beginning.")]
End = Annotated[float | None, Option("--end SECONDS", "Leave out what is later in the bag.")]


class Problems:
    """Prints problems, and counts them."""

    def __init__(self) -> None:
        self.count = 0

    def report(self, problem: BagError | str) -> None:
        """Print a problem."""
        self.count += 1
        print_error(f"ERROR: {problem}")


class Input:
    """Bags that are read, and what is chosen of them."""

    def __init__(self, readers: Sequence[BagReader], problems: Problems) -> None:
        self.readers = readers
        self.problems = problems

    def entries(
        self, topics: Sequence[str] | None = None, start: float = 0.0, end: float | None = None
    ) -> Iterator[Entry]:
        """Return messages, merged by time.

        Args:
            topics: Names of topics; all if there are none.
            start: Seconds after the begin of the first bag.
            end: Last second after it.

        Raises:
            NotFoundError: The bags have no such topic.
        """
        from rosz.bags.editing import merged

        known = {channel.topic for one in self.readers for channel in one.channels}
        wanted = {one if one.startswith("/") else f"/{one}" for one in topics or ()}
        for one in sorted(wanted - known):
            raise NotFoundError(f"no topic '{one}' in the bag{near_miss(one, known)}")
        first = min((one.start for one in self.readers if one.count()), default=0)
        return merged(
            self.readers,
            self.problems.report,
            topics=wanted or None,
            start=first + int(start * _NS) if start else None,
            end=None if end is None else first + int(end * _NS),
        )


@contextmanager
def open_bags(bags: Sequence[str]) -> Iterator[Input]:
    """Open bags, and print what is damaged of them.

    Raises:
        BagError: One cannot be read at all.
    """
    from rosz.bags import open_reader

    with ExitStack() as stack:
        readers = [stack.enter_context(open_reader(bag)) for bag in bags]
        problems = Problems()
        for reader in readers:
            for problem in reader.problems:
                problems.report(problem)
        yield Input(readers, problems)


def check_times(start: float, end: float | None) -> None:
    """Check the values of ``--start`` and ``--end``.

    Raises:
        UsageError: One is negative, or the end is before the start.
    """
    no_less_than_zero("--start", start)
    no_less_than_zero("--end", end)
    if end is not None and end < start:
        raise UsageError(f"--end is {end:g}, before --start {start:g}")
