"""The bags of a page, without the page: what is reachable, recording, playing, and permissions."""

from __future__ import annotations

import io
import os
import signal
import tarfile
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from network import TIMEOUT, Network, eventually

import rosz.bags
from rosz.access import PagePolicy
from rosz.errors import BagError, NotFoundError, UsageError
from rosz.msgs.std_msgs.msg import Int32
from rosz.security import Permit
from rosz.web.model import BagCommand, BagRun, Bags, PlayOrder, RecordOrder

LONG = 4 * TIMEOUT


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with bags, and with what is none; beside it another bag."""
    made = tmp_path / "bags"
    made.mkdir()
    for path in (made / "a.mcap", tmp_path / "outside.mcap"):
        with rosz.bags.open(path, "w") as bag:
            for number in range(100):
                bag.write("/count", Int32(data=number), (10 + number) * 10**9)
    with rosz.bags.open(f"{made}/two/", "w") as bag:
        bag.write("/count", Int32(data=1), 10**9)
    (made / "b.mcap.active").write_bytes(b"unfinished")
    (made / "notes.txt").write_text("no bag")
    (made / "other").mkdir()
    (made / "link.mcap").symlink_to(tmp_path / "outside.mcap")
    (made / "folder").symlink_to(made / "two")
    (made / "two" / "link.mcap").symlink_to(tmp_path / "outside.mcap")
    return made


@pytest.fixture
def here(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let processes that a test starts be on its network."""
    for name, value in network.variables().items():
        monkeypatch.setenv(name, value)


def test_only_bags_of_the_folder_are_reachable(folder: Path) -> None:
    bags = Bags(folder, PagePolicy())
    assert {one.name: one.finished for one in bags.folder.rows()} == {
        "a.mcap": True,
        "two": True,
        "b.mcap.active": False,
    }
    for name in ("../outside.mcap", "link.mcap", "folder", "notes.txt", "other", "", ".", ".."):
        uses: list[Callable[[str], object]] = [bags.folder.summary, bags.open, bags.delete]
        for use in uses:
            with pytest.raises(NotFoundError, match="has no bag"):
                use(name)
    assert (folder.parent / "outside.mcap").exists()
    with pytest.raises(UsageError, match="is not finished"):
        bags.open("b.mcap.active")


def test_a_bag_is_described_and_deleted(folder: Path) -> None:
    bags = Bags(folder, PagePolicy())
    summary, problems = bags.folder.summary("a.mcap")
    assert (summary.messages, summary.duration, problems) == (100, 99.0, [])
    assert bags.open("a.mcap") == (folder / "a.mcap", None)
    bags.delete("a.mcap")
    bags.delete("two")
    assert [one.name for one in bags.folder.rows()] == ["b.mcap.active"]
    assert (folder.parent / "outside.mcap").exists()


def test_a_folder_of_rosbag2_is_sent_as_an_archive(folder: Path) -> None:
    _, pieces = Bags(folder, PagePolicy()).open("two")
    assert pieces is not None
    with tarfile.open(fileobj=io.BytesIO(b"".join(pieces))) as archive:
        names = archive.getnames()
        assert "two/metadata.yaml" in names
        assert "two/link.mcap" not in names
        for name in names:
            member = archive.extractfile(name)
            assert member is not None
            assert member.read() == (folder / name).read_bytes()


def test_permissions_hold_for_bags(folder: Path) -> None:
    look = Bags(folder, PagePolicy(read_only=True))
    for use in (
        lambda: look.record(RecordOrder(name="x.mcap")),
        lambda: look.play(PlayOrder(name="a.mcap")),
        lambda: look.delete("a.mcap"),
        look.stop_recording,
        lambda: look.control(BagCommand("pause")),
    ):
        with pytest.raises(UsageError, match="this page is read-only"):
            use()
    assert look.open("a.mcap")
    some = Bags(folder, PagePolicy(Permit(subscribe=("/other",), control=True)))
    with pytest.raises(UsageError, match="subscribe '/count'"):
        some.open("a.mcap")
    with pytest.raises(UsageError, match="subscribe all topics; choose some"):
        some.record(RecordOrder(name="x.mcap"))
    with pytest.raises(UsageError, match="publish '/old/count'"):
        some.play(PlayOrder(name="a.mcap", prefix="/old"))
    with pytest.raises(UsageError, match="let this page delete bags"):
        Bags(folder, PagePolicy(Permit())).delete("a.mcap")


@pytest.mark.parametrize("name", ["../x.mcap", "/x.mcap", ".x.mcap", "x.txt", "a/b.bag"])
def test_a_recording_stays_in_the_folder(folder: Path, name: str) -> None:
    with pytest.raises(UsageError, match="is not the name of a bag in this folder"):
        Bags(folder, PagePolicy()).record(RecordOrder(name=name))


def _ended(run: BagRun | None) -> BagRun:
    assert run is not None
    assert run.wait(LONG)
    return run


@pytest.mark.usefixtures("here")
def test_a_recorder_does_not_give_way_as_pages_do(tmp_path: Path) -> None:
    bags = Bags(tmp_path, PagePolicy())
    order = RecordOrder(name="run.mcap", topics=("/count",))

    def record() -> None:
        os.nice(7)  # of this thread, as that of the server
        bags.record(order)

    thread = threading.Thread(target=record)
    thread.start()
    thread.join()
    assert bags.recording is not None
    pid = bags.recording._process.pid
    assert os.getpriority(os.PRIO_PROCESS, pid) == os.getpriority(os.PRIO_PROCESS, 0)
    bags.close()


@pytest.mark.usefixtures("here")
def test_a_recording_goes_on_until_it_is_stopped(network: Network, tmp_path: Path) -> None:
    bags = Bags(tmp_path, PagePolicy())
    count = network.node("robot").publisher("count", Int32)
    bags.record(RecordOrder(name="run.mcap", topics=("/count",)))
    recording = bags.recording
    assert recording is not None

    def recorded() -> bool:
        count.publish(Int32(data=1))
        return recording.last.messages > 10 or recording.ended

    eventually(recorded, "messages in the bag", LONG)
    assert recording.last.path == "run.mcap"
    assert recording.last.left > 0
    with pytest.raises(UsageError, match=r"a recording goes on: run\.mcap"):
        bags.record(RecordOrder(name="other.mcap"))
    with pytest.raises(UsageError, match="is being recorded"):
        bags.delete("run.mcap.active")
    bags.stop_recording()
    assert _ended(recording).fault == ""
    assert bags.folder.summary("run.mcap")[0].messages > 10
    bags.record(RecordOrder(name="run.mcap"))
    assert "exists already" in _ended(bags.recording).fault


@pytest.mark.usefixtures("here")
def test_a_page_that_ends_leaves_a_whole_bag_and_a_dead_recorder_is_told(
    network: Network, tmp_path: Path
) -> None:
    robot = network.node("robot")
    robot.publisher("map", Int32, latch=True).publish(Int32(data=1))
    bags = Bags(tmp_path, PagePolicy())
    bags.record(RecordOrder(name="run.mcap", topics=("/map",)))
    first = bags.recording
    assert first is not None
    eventually(lambda: first.last.messages >= 1, "the latched message", LONG)
    bags.close()
    assert _ended(first).fault == ""
    assert bags.folder.summary("run.mcap")[0].messages >= 1
    bags.record(RecordOrder(name="killed.mcap", topics=("/map",)))
    second = bags.recording
    assert second is not None
    eventually(lambda: second.last.messages >= 1, "the latched message", LONG)
    os.kill(second._process.pid, signal.SIGKILL)
    assert "ended with code -9" in _ended(second).fault


@pytest.mark.usefixtures("here")
def test_a_bag_is_played_by_the_bar(network: Network, folder: Path) -> None:
    heard: list[int] = []
    network.node("ear").subscription("/old/count", Int32, lambda one: heard.append(one.data))
    bags = Bags(folder, PagePolicy())
    with pytest.raises(UsageError, match="no bag plays"):
        bags.control(BagCommand("pause"))
    bags.play(PlayOrder(name="a.mcap", prefix="/old", paused=True))
    playing = bags.playing
    assert playing is not None
    eventually(lambda: playing.last.paused, "the bag is open", LONG)
    assert playing.last.duration == 99.0
    bags.control(BagCommand("step"))
    eventually(lambda: heard == [0], "the first message", LONG)
    bags.control(BagCommand("jump", 96.0))
    bags.control(BagCommand("step"))
    eventually(lambda: heard == [0, 96], "the message at the place", LONG)
    bags.control(BagCommand("rate", 100.0))
    eventually(lambda: playing.last.rate == 100.0, "the rate", LONG)
    bags.control(BagCommand("pause"))
    assert _ended(playing).fault == ""
    eventually(lambda: heard == [0, 96, 97, 98, 99], "the rest", LONG)
    bags.play(PlayOrder(name="a.mcap", paused=True))
    again = bags.playing
    bags.close()
    assert _ended(again).fault == ""


def test_a_folder_that_is_gone_is_told(tmp_path: Path) -> None:
    bags = Bags(tmp_path / "none", PagePolicy())
    with pytest.raises(BagError, match="cannot read the folder"):
        bags.folder.rows()
    with pytest.raises(BagError, match="cannot start its process"):
        bags.record(RecordOrder(name="x.mcap"))
