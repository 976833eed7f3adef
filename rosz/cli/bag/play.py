"""``rosz bag play``."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Annotated

from msgspec import Struct, convert
from msgspec.structs import asdict

from rosz.cli import suggest
from rosz.cli.bag.source import app
from rosz.cli.call import Call
from rosz.cli.console import print_error, print_lines, takes_escapes, warn
from rosz.cli.declare import Argument, Option, at_least, no_less_than_zero, per_second
from rosz.errors import ClosedError, UsageError

if TYPE_CHECKING:
    from rosz.bags import BagReader
    from rosz.bags.play import Player, PlayOptions, Progress

_TOOL = "play"
_LISTS = ("--topics", "--pause-topics")
_FASTER = 1.1
_SWITCH_SECONDS = 0.0001
"""The thread that reads ahead must not keep the one that publishes waiting for longer."""
_DEFAULT_CLOCK = 100.0
_MOST_TIMES = 1_000_000


def list_topics(words: list[str]) -> list[str]:
    """Return the words with lists of topics, and ``--clock HZ``, as options of one value each.

    As rosbag does, ``--topics`` takes all words up to the next option; ``--bags`` ends the list.
    """
    arranged: list[str] = []
    left = iter([*words, ""])
    word = next(left)
    while word:
        if word in _LISTS:
            option, word = word, next(left)
            while word and not word.startswith("-"):
                arranged.append(f"{option}={word}")
                word = next(left)
            continue
        if word == "--clock":
            arranged.append(word)
            word = next(left)
            if _is_number(word):
                arranged.append(f"--hz={word}")
                word = next(left)
            continue
        if word != "--bags":
            arranged.append(word.removeprefix("--bags="))
        word = next(left)
    return arranged


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


class PlayLine(Struct, frozen=True, kw_only=True):
    """The command line of a player."""

    bags: Annotated[list[str], Argument("BAG", source=suggest.files)]
    prefix: Annotated[str, Option("-p --prefix PREFIX", "Put this before all topics.")] = ""
    quiet: Annotated[bool, Option("-q --quiet", "Print problems only.")] = False
    immediate: Annotated[bool, Option("-i --immediate", "Publish without waiting.")] = False
    pause: Annotated[bool, Option("--pause", "Begin with a pause.")] = False
    queue: Annotated[
        int, Option("--queue SIZE", "Depth of queues where the bag has none; 0 for no limit.")
    ] = 100
    clock: Annotated[bool, Option("--clock", "Publish /clock; a rate in hertz may follow.")] = False
    hz: Annotated[float, Option("--hz HZ", "Rate of /clock.")] = _DEFAULT_CLOCK
    delay: Annotated[float, Option("-d --delay SECONDS", "Wait after the publishers are made.")] = (
        0.2
    )
    rate: Annotated[float, Option("-r --rate FACTOR", "Play faster or more slowly.")] = 1.0
    start: Annotated[float, Option("-s --start SECONDS", "Leave out the beginning.")] = 0.0
    duration: Annotated[
        float | None, Option("-u --duration SECONDS", "Play this part of the bags only.")
    ] = None
    skip_empty: Annotated[
        float, Option("--skip-empty SECONDS", "Skip longer times without a message.")
    ] = 0.0
    loop: Annotated[bool, Option("-l --loop", "Begin again at the end.")] = False
    keep_alive: Annotated[
        bool, Option("-k --keep-alive", "Stay at the end, for what is latched.")
    ] = False
    wait_for_subscribers: Annotated[
        bool, Option("--wait-for-subscribers", "Wait until each topic has a subscriber.")
    ] = False
    topics: Annotated[
        list[str] | None, Option("--topics TOPIC", "Play these topics only; several may follow.")
    ] = None
    pause_topics: Annotated[
        list[str] | None, Option("--pause-topics TOPIC", "Pause at messages of these topics.")
    ] = None
    rate_control_topic: Annotated[
        str,
        Option("--rate-control-topic TOPIC", "Wait while the stamps of this topic lag behind."),
    ] = ""
    rate_control_max_delay: Annotated[
        float, Option("--rate-control-max-delay SECONDS", "Time by which they may lag behind.")
    ] = 1.0
    # An option of rosbag that changes nothing here.
    try_future: Annotated[bool, Option("--try-future-version")] = False

    def check(self) -> None:
        """Check the values.

        Raises:
            UsageError: One is out of its bounds.
        """
        if not 1 / _MOST_TIMES <= self.rate <= _MOST_TIMES:
            raise UsageError(
                f"--rate is {self.rate:g}; expected a factor above 0, at most {_MOST_TIMES}, such"
                " as 2 to play twice as fast"
            )
        per_second("--clock" if self.clock else "--hz", self.hz)
        at_least("--queue", self.queue, 0, "messages")
        no_less_than_zero("--start", self.start)
        no_less_than_zero("--delay", self.delay)
        no_less_than_zero("--duration", self.duration)
        no_less_than_zero("--skip-empty", self.skip_empty)
        no_less_than_zero("--rate-control-max-delay", self.rate_control_max_delay)

    def options(self) -> PlayOptions:
        """Return the options of the player."""
        from rosz.bags.play import PlayOptions

        fields = asdict(self) | {
            "clock": self.hz if self.clock else 0.0,
            "paused": self.pause,
            "topics": self.topics or (),
            "pause_topics": self.pause_topics or (),
        }
        return convert(fields, PlayOptions)  # which has the other fields by the same names


@app.command("play", arrange=list_topics)
def play_command(call: Call, line: PlayLine) -> int:
    """Publish the messages of bags again, merged by time.

    On a terminal, space pauses and goes on, s publishes one message of a pause, and the arrows up
    and down change the rate.
    """
    line.check()
    from rosz.bags.play import Player
    from rosz.node import Node

    options = line.options()
    sys.setswitchinterval(_SWITCH_SECONDS)
    screen = _Screen(quiet=line.quiet)
    with ExitStack() as stack:
        readers = [stack.enter_context(each) for each in _open(line.bags, screen)]
        node = stack.enter_context(Node(_TOOL, anonymous=True, argv=call.argv))
        player = Player(node, readers, options, screen.warn, screen.update)
        for reader in readers:
            for problem in reader.problems:
                screen.problem(str(problem))
        try:
            if line.wait_for_subscribers:
                screen.show("Waiting for subscribers.")
            player.advertise()
            with _keys(player, screen):
                player.run()
        except ClosedError:  # Ctrl-C
            pass
        screen.end()
    return int(bool(player.problems or screen.problems))


def _open(bags: list[str], screen: _Screen) -> Iterator[BagReader]:
    from rosz.bags import open_reader

    for bag in bags:
        screen.show(f"Opening {bag}")
        yield open_reader(bag)


@contextmanager
def _keys(player: Player, screen: _Screen) -> Iterator[None]:
    """Read the keys of a terminal during a block."""
    if not sys.stdin.isatty():
        yield
        return
    from rosz.turtlesim.teleop import Keyboard

    screen.show("Hit space to toggle paused, or 's' to step.")

    def read() -> None:
        for key in keyboard:
            if key == " ":
                player.toggle()
            elif key == "s":
                player.step()
            elif key in {"up", "down"}:
                player.change_rate(_FASTER if key == "up" else 1 / _FASTER)

    with Keyboard() as keyboard:
        reader = threading.Thread(target=read, name="rosz-keys", daemon=True)
        reader.start()
        try:
            yield
        finally:
            keyboard.stop()
            reader.join()


class _Screen:
    """The terminal while bags play."""

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet
        self._follows = not quiet and takes_escapes(sys.stdout)
        self._shown = False
        self.problems = 0

    def show(self, line: str) -> None:
        if not self._quiet:
            self._leave()
            print_lines([line])

    def warn(self, text: str) -> None:
        """Print a problem of the player, or a remark."""
        self._leave()
        warn(text)

    def problem(self, text: str) -> None:
        self.problems += 1
        self._leave()
        print_error(f"ERROR: {text}")

    def update(self, progress: Progress) -> None:
        """Show the progress in the last line of a terminal."""
        if not self._follows:
            return
        width = 20
        share = min(progress.elapsed / progress.duration, 1.0) if progress.duration > 0 else 1.0
        bar = ("#" * round(share * width)).ljust(width, ".")
        state = "DELAYED" if progress.delayed else "PAUSED " if progress.paused else "RUNNING"
        sys.stdout.write(
            f"\r\033[K[{state}]  Bag Time: {progress.stamp / 1e9:13.6f}"
            f"   Duration: {progress.elapsed:.6f} / {progress.duration:.6f}"
            f"   [{bar}] {progress.rate:.2f} x"
        )
        sys.stdout.flush()
        self._shown = True

    def end(self) -> None:
        self.show("Done.")

    def _leave(self) -> None:
        """End the line of the progress."""
        if self._shown:
            sys.stdout.write("\n")
            self._shown = False
