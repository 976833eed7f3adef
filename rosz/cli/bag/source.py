"""The group of bag commands, the bags that they read, and the options that choose of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Annotated

from msgspec import Struct

from rosz import names
from rosz.cli import suggest
from rosz.cli.call import new_group
from rosz.cli.console import print_error
from rosz.cli.declare import Argument, Option, no_less_than_zero
from rosz.errors import BagError, NotFoundError, UsageError, near_miss

if TYPE_CHECKING:
    from rosz.bags import BagReader, Compression, Entry

app = new_group("Record and play bags, show, change and repair them.")

_NS = 1_000_000_000

BagArgument = Annotated[str, Argument("BAG", source=suggest.files)]
Start = Annotated[float, Option("-s --start SECONDS", "Leave out the beginning.")]
End = Annotated[float | None, Option("--end SECONDS", "Leave out what is later in the bag.")]


class Part(Struct, frozen=True, kw_only=True):
    """The options that choose some messages of a bag."""

    topics: Annotated[
        list[str] | None, Option("--topics TOPIC", "Take these topics only; several may follow.")
    ] = None
    start: Start = 0.0
    end: End = None


class BagInput:
    """Bags that are read, and their chosen messages.

    Attributes:
        problems: Number of problems that were printed.
    """

    def __init__(self, readers: Sequence[BagReader]) -> None:
        self.readers = readers
        self.problems = 0

    def report(self, problem: BagError | str) -> None:
        """Print a problem."""
        self.problems += 1
        print_error(f"ERROR: {problem}")

    def entries(self, part: Part) -> Iterator[Entry]:
        """Return the messages of a part, merged by time; its times begin with the first bag.

        Raises:
            NotFoundError: The bags have no such topic.
        """
        from rosz.bags.edit import merged

        topics = {channel.topic for reader in self.readers for channel in reader.channels}
        wanted = {names.join("/", topic) for topic in part.topics or ()}
        for topic in sorted(wanted - topics):
            raise NotFoundError(f"no topic '{topic}' in the bag{near_miss(topic, topics)}")
        first = min((reader.start for reader in self.readers if reader.count()), default=0)
        return merged(
            self.readers,
            self.report,
            topics=wanted or None,
            start=first + int(part.start * _NS) if part.start else None,
            end=None if part.end is None else first + int(part.end * _NS),
        )


def compression_of(*, bz2: bool, lz4: bool, zstd: bool) -> Compression | None:
    """Return the compression that options name, of which only one may be given."""
    if bz2 + lz4 + zstd > 1:
        raise UsageError("--bz2, --lz4 and --zstd exclude each other")
    return "bz2" if bz2 else "lz4" if lz4 else "zstd" if zstd else None


@contextmanager
def open_bags(bags: Sequence[str]) -> Iterator[BagInput]:
    """Open bags, and print their damage.

    Raises:
        BagError: One cannot be read at all.
    """
    from rosz.bags import open_reader

    with ExitStack() as stack:
        source = BagInput([stack.enter_context(open_reader(bag)) for bag in bags])
        for reader in source.readers:
            for problem in reader.problems:
                source.report(problem)
        yield source


def check_times(start: float, end: float | None) -> None:
    """Check the values of ``--start`` and ``--end``.

    Raises:
        UsageError: One is negative, or the end is before the start.
    """
    no_less_than_zero("--start", start)
    no_less_than_zero("--end", end)
    if end is not None and end < start:
        raise UsageError(f"--end is {end:g}, before --start {start:g}")
