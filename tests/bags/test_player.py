"""Playing bags: times, order, latched messages, QoS, types and control."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

import rosz.bags
from rosz.bags import Channel, open_reader
from rosz.bags.play import Player, PlayOptions, Progress
from rosz.bags.play.ahead import ReadAhead
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import PointStamped
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.msgs.std_msgs.msg import Header, Int32, String
from rosz.qos import LATCHED, QoS
from rosz.wire import Kind

from .ros1_files import STORE, write_bag

pytestmark = pytest.mark.system

SECOND = 1_000_000_000
START = 100 * SECOND


def _bag(path: Path, messages: Iterable[tuple[str, float, Any]]) -> Path:
    """Write messages (topic, seconds, message) into a bag of MCAP."""
    with rosz.bags.open(path, "w") as bag:
        for topic, seconds, message in messages:
            bag.write(topic, message, START + round(seconds * SECOND))
    return path


class _Listener:
    """What a node receives, with times."""

    def __init__(self, network: Network, *topics: str, kind: type[Any] = Int32) -> None:
        self.node = network.node("listener")
        self.found: list[tuple[str, Any, float]] = []
        for topic in topics:
            self.node.subscription(topic, kind, self._receive(topic), qos=QoS(depth=100_000))

    def _receive(self, topic: str) -> Callable[[Any], None]:
        return lambda message: self.found.append((topic, message, time.monotonic()))

    @property
    def values(self) -> list[Any]:
        return [getattr(one[1], "data", None) for one in self.found]

    def wait(self, count: int) -> None:
        eventually(lambda: len(self.found) >= count, f"{count} messages")


def _player(network: Network, *paths: Path, **options: Any) -> Player:
    given = {"wait_for_subscribers": True, "delay": 0.0, **options}
    warnings: list[str] = []
    readers = [network._keep(open_reader(path)) for path in paths]
    player = Player(network.node("player"), readers, PlayOptions(**given), warnings.append)
    player.warnings = warnings  # type: ignore[attr-defined]
    player.advertise()
    return player


def test_reading_ahead_is_done_before_the_first_message(monkeypatch: pytest.MonkeyPatch) -> None:
    """It does not take the processor while the first messages are due."""
    monkeypatch.setattr("rosz.bags.play.ahead._FILL_TIMEOUT", TIMEOUT)
    made: list[int] = []

    def make() -> Iterator[tuple[int, int]]:
        for number in range(10_000):
            made.append(number)
            yield 1, number

    with ReadAhead(make()) as ahead:
        ahead.fill()
        before = len(made)
        assert before > 2000
        assert next(iter(ahead)) == list(range(50))
        eventually(lambda: len(made) > before)
    with ReadAhead(iter([(1, "a")])) as short:
        short.fill()
        assert list(short) == [["a"]]


def test_messages_come_in_order_at_their_times(network: Network, tmp_path: Path) -> None:
    one = _bag(tmp_path / "a.mcap", [("/a", n / 50, Int32(data=n)) for n in range(0, 50, 2)])
    two = _bag(tmp_path / "b.mcap", [("/b", n / 50, Int32(data=n)) for n in range(1, 50, 2)])
    heard = _Listener(network, "/a", "/b")
    began = time.monotonic()
    player = _player(network, one, two, rate=2.0)
    player.run()
    heard.wait(50)
    assert time.monotonic() - began >= 0.48
    assert sorted(heard.values) == list(range(50))
    for topic in ("/a", "/b"):
        own = [message.data for name, message, _ in heard.found if name == topic]
        assert own == sorted(own)
    assert (player.published, player.problems) == (50, 0)


def test_waiting_before_the_first_message_counts_as_no_time(
    network: Network, tmp_path: Path
) -> None:
    """Else all messages of that time would be published at once."""
    bag = _bag(tmp_path / "a.mcap", [("/a", n, Int32(data=n)) for n in (0, 1)])
    published: list[int] = []  # when, whatever delays the messages on their way
    network.node("listener").subscription(
        "/a", Int32, lambda _, info: published.append(info.source_time), with_info=True
    )
    player = _player(network, bag, delay=1.0)
    player.run()
    eventually(lambda: len(published) == 2)
    # A busy machine may publish the first one late.
    assert published[1] - published[0] > SECOND // 10


def test_a_part_of_some_topics_under_a_prefix(network: Network, tmp_path: Path) -> None:
    rows = [(f"/{name}", n / 100, Int32(data=n)) for n in range(20) for name in "ab"]
    bag = _bag(tmp_path / "a.mcap", rows)
    heard = _Listener(network, "/old/a", "/old/b")
    player = _player(
        network, bag, immediate=True, start=0.05, duration=0.04, topics=("a",), prefix="/old"
    )
    player.run()
    heard.wait(5)
    assert [(one[0], one[1].data) for one in heard.found] == [("/old/a", n) for n in range(5, 10)]
    late: Any = _player(network, bag, wait_for_subscribers=False, start=9.0)
    assert late.warnings == [
        "nothing to play: --start 9 is behind the end of the bags, which have 0.2 s"
    ]


@pytest.mark.parametrize("immediate", [False, True])
def test_messages_with_a_time_are_sent_at_once(
    network: Network, tmp_path: Path, immediate: bool
) -> None:
    """Zenoh may hold others for a millisecond, to send several together."""
    bag = _bag(tmp_path / "a.mcap", [("/a", 0.0, Int32(data=7))])
    found: list[bool] = []
    heard = _Listener(network, "/a")
    heard.node.keep(
        heard.node.context.session.subscriber(
            "*/a/**", lambda sample: found.append(sample.raw.express)
        )
    )
    _player(network, bag, immediate=immediate).run()
    eventually(lambda: found)
    assert found == [not immediate]


def test_remapping_renames_topics(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [("/a", 0.0, Int32(data=7))])
    heard = _Listener(network, "/other")
    node = network.node("player", argv=["/a:=/other"])
    options = PlayOptions(immediate=True, delay=0.0, wait_for_subscribers=True)
    player = Player(node, [network._keep(open_reader(bag))], options, print)
    player.advertise()
    player.run()
    heard.wait(1)


def _latched_bag(path: Path) -> Path:
    with rosz.bags.open(path, "w") as bag:
        writer = bag.writer
        channel = Channel(
            "/map",
            Int32._type_name,
            definition=Int32._text,
            type_hash=Int32._type_hash,
            qos=(LATCHED,),
        )
        plain = Channel(
            "/a",
            Int32._type_name,
            definition=Int32._text,
            type_hash=Int32._type_hash,
            qos=(QoS(depth=7),),
        )
        first, second = writer.add(channel), writer.add(plain)
        writer.write(first, START, Int32(data=1).to_cdr())
        writer.write(first, START + 2 * SECOND, Int32(data=2).to_cdr())
        for number in range(10, 13):
            writer.write(second, START + number * SECOND, Int32(data=number).to_cdr())
    return path


def test_what_was_latched_before_the_start_latches(network: Network, tmp_path: Path) -> None:
    bag = _latched_bag(tmp_path / "a.mcap")
    player = _player(
        network, bag, start=10.0, immediate=True, keep_alive=True, wait_for_subscribers=False
    )
    network.thread(player.run)
    eventually(lambda: player.published == 3)
    late = network.node("late").subscription("/map", Int32, qos=LATCHED)
    assert late.get(timeout=TIMEOUT).data == 2
    view = network.context().graph.wait_for(
        lambda view: bool(view.publishers("/map") and view.publishers("/a")), TIMEOUT, "both"
    )
    profiles = {token.name: token.qos for token in view.entities(Kind.PUBLISHER)}
    assert profiles["/map"] == LATCHED
    assert profiles["/a"] == QoS(depth=7)
    player.stop()


def test_a_pause_steps_and_goes_on(network: Network, tmp_path: Path) -> None:
    bag = _latched_bag(tmp_path / "a.mcap")
    heard = _Listener(network, "/a", "/map")
    player = _player(network, bag, paused=True)
    running = network.thread(player.run)
    heard.wait(1)  # latched as the bag began
    assert heard.values == [1]
    for count in (2, 3, 4):
        player.step()
        heard.wait(count)
    assert heard.values == [1, 1, 2, 10]
    player.change_rate(100)
    player.toggle()
    running.join(TIMEOUT)
    heard.wait(6)
    assert heard.values == [1, 1, 2, 10, 11, 12]


def test_a_jump_goes_on_from_another_place(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [("/a", n, Int32(data=n)) for n in range(11)])
    heard = _Listener(network, "/a")
    player = _player(network, bag, paused=True)
    running = network.thread(player.run)
    for count, place in enumerate((5, 2, 0, 8), 1):
        player.jump(place)
        player.step()
        heard.wait(count)
    assert heard.values == [5, 2, 0, 8]
    player.set_rate(100)
    player.toggle()
    running.join(TIMEOUT)
    heard.wait(6)
    assert heard.values == [5, 2, 0, 8, 9, 10]


def test_playing_begins_again_as_long_as_it_shall(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [("/a", n / 100, Int32(data=n)) for n in range(3)])
    heard = _Listener(network, "/a")
    player = _player(network, bag, loop=True)
    running = network.thread(player.run)
    heard.wait(7)
    player.loop = False
    running.join(TIMEOUT)
    assert player.published % 3 == 0
    heard.wait(player.published)


def test_the_clock_runs_with_the_bag(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [("/a", n / 10, Int32(data=n)) for n in range(11)])
    clock = _Listener(network, "/clock", kind=Clock)
    network.node("a").subscription("/a", Int32, lambda _: None)
    player = _player(network, bag, rate=1.0, clock=200.0)
    player.run()

    def stamps() -> list[int]:
        return [one[1].clock.to_nsec() for one in clock.found]

    eventually(lambda: clock.found and stamps()[-1] - stamps()[0] > SECOND // 2)
    clock.wait(4)  # or as many as a busy machine comes to in that time
    found = stamps()
    assert found == sorted(found)
    assert START <= found[0] <= found[-1] <= START + SECOND


def test_bags_of_ros1_play_as_our_types(network: Network, tmp_path: Path) -> None:
    string = STORE.types["std_msgs/msg/String"]
    rows = [("/chatter", START + n, string(data=f"hé {n}")) for n in range(300)]
    bag = write_bag(tmp_path / "x.bag", rows, compression="lz4", latched=["/chatter"])
    heard = _Listener(network, "/chatter", kind=String)
    player = _player(network, bag, immediate=True)
    player.run()
    heard.wait(300)
    assert heard.values == [f"hé {n}" for n in range(300)]


def test_without_waiting_only_what_is_heard_is_published(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [(f"/{n % 2}", n, Int32(data=n)) for n in range(2000)])
    heard = _Listener(network, "/1")
    player = _player(network, bag, immediate=True, wait_for_subscribers=False)
    one, other = (
        player.outputs.publishers[key]
        for key in sorted(player.outputs.publishers, key=lambda key: str(key[0]))
    )
    other.wait_for_subscribers(1)
    eventually(lambda: other.heard)
    assert not one.heard
    player.run()
    heard.wait(1000)
    assert heard.values == list(range(1, 2000, 2))
    assert (player.published, one._sequence, other._sequence) == (2000, 0, 1000)


def test_keys_of_a_terminal(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [("/a", n / 1000, Int32(data=n)) for n in range(9)])
    heard = _Listener(network, "/a")
    ours, theirs = os.openpty()
    words = ("--pause", "--wait-for-subscribers", str(bag))
    program = subprocess.Popen(
        [sys.executable, "-P", "-m", "rosz", "bag", "play", *words],
        env=network.variables() | {"TERM": "xterm"},
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
    )
    os.close(theirs)
    shown = b""

    def wait_for(text: bytes) -> None:
        nonlocal shown
        while text not in shown:
            shown += os.read(ours, 1 << 16)

    try:
        wait_for(b"PAUSED")
        for count in (1, 2, 3):
            os.write(ours, b"s")
            heard.wait(count)
        os.write(ours, b"x\x1b[A")
        wait_for(b"1.10 x")
        assert heard.values == [0, 1, 2]
        os.write(ours, b" ")
        heard.wait(9)
        wait_for(b"Done.")
        assert program.wait(TIMEOUT) == 0
    finally:
        program.kill()
        program.wait()
        os.close(ours)
    assert heard.values == list(range(9))


def test_a_topic_controls_the_rate(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [("/a", n / 2, Int32(data=n)) for n in range(9)])
    heard = _Listener(network, "/a")
    control = network.node("control").publisher("/done", PointStamped)
    player = _player(
        network, bag, rate=10.0, rate_control_topic="/done", rate_control_max_delay=0.75
    )
    control.wait_for_subscribers()
    running = network.thread(player.run)

    def is_held_at(stamp: int) -> bool:
        assert player._control is not None
        return player._control.stamp == stamp and player._pace.delayed

    for second in (0, 1):
        control.publish(PointStamped(header=Header(stamp=Time(sec=100 + second))))
        stamp = START + second * SECOND
        eventually(partial(is_held_at, stamp))
        # Fewer, on a machine so busy that the time of the bag is too late before they are due.
        assert player.published <= 3 + 2 * second
    control.publish(PointStamped(header=Header(stamp=Time(sec=200))))
    running.join(TIMEOUT)
    heard.wait(9)
    assert heard.values == list(range(9))


def test_a_loop_begins_again(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [("/a", n / 100, Int32(data=n)) for n in range(3)])
    heard = _Listener(network, "/a")
    player = _player(network, bag, loop=True)
    running = network.thread(player.run)
    heard.wait(9)
    player.stop()
    running.join(TIMEOUT)
    assert heard.values[:9] == [0, 1, 2] * 3


def test_progress_is_reported(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [("/a", n / 100, Int32(data=n)) for n in range(50)])
    seen: list[Progress] = []
    player = Player(
        network.node("player"),
        [network._keep(open_reader(bag))],
        PlayOptions(delay=0.0),
        print,
        seen.append,
    )
    player.advertise()
    player.run()
    assert seen[-1].published == 50
    assert seen[-1].elapsed == pytest.approx(0.49, abs=0.01)
    assert all(first.stamp <= second.stamp for first, second in pairwise(seen))


def test_topics_that_do_not_fit_are_left_out_and_named(network: Network, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with rosz.bags.open(path, "w") as bag:
        other = Channel(
            "/bad", "std_msgs/msg/Int32", definition="string data\n", type_hash="RIHS01_other"
        )
        handle = bag.writer.add(other)
        bag.writer.write(handle, START, String(data="x").to_cdr())
        bag.write("/a", Int32(data=4), START)
    heard = _Listener(network, "/a")
    player = _player(network, path, immediate=True)
    player.run()
    heard.wait(1)
    (warning,) = player.warnings  # type: ignore[attr-defined]
    assert "topic '/bad' is left out" in warning
    assert "field 'data' is a string in the bag, a int32 here" in warning
    assert player.problems == 1


def test_what_is_not_there_is_told(network: Network, tmp_path: Path) -> None:
    empty = _bag(tmp_path / "empty.mcap", [])
    nothing = _player(network, empty, immediate=True, wait_for_subscribers=False)
    nothing.run()
    assert nothing.warnings == [  # type: ignore[attr-defined]
        "nothing to play: the bags have no messages"
    ]
    bag = _bag(tmp_path / "a.mcap", [("/a", 0, Int32()), ("/a", 1, Int32())])
    given = {"immediate": True, "wait_for_subscribers": False}
    late = _player(network, bag, start=5.0, pause_topics=("b",), **given)
    late.run()
    assert late.warnings == [  # type: ignore[attr-defined]
        "no topic '/b' to pause at in the bags",
        "nothing to play: --start 5 is behind the end of the bags, which have 1.0 s",
    ]
    assert [(one.published, one.problems) for one in (nothing, late)] == [(0, 0)] * 2


def test_the_end_of_the_node_ends_it(network: Network, tmp_path: Path) -> None:
    bag = _bag(tmp_path / "a.mcap", [("/a", n * 1000.0, Int32(data=n)) for n in range(3)])
    player = _player(network, bag, wait_for_subscribers=False)
    running = network.thread(player.run)
    eventually(lambda: player.published == 1)
    threading.Thread(target=player._node.context.close).start()
    running.join(TIMEOUT)
    assert not running.is_alive()


def test_it_waits_for_full_links_whatever_was_recorded(network: Network, tmp_path: Path) -> None:
    player = _player(network, _latched_bag(tmp_path / "a.mcap"), wait_for_subscribers=False)
    assert {one.name: (one._blocks, one.qos) for one in player.outputs.publishers.values()} == {
        "/map": (True, LATCHED),
        "/a": (True, QoS(depth=7)),
    }
