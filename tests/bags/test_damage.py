"""Bags of every format that are cut, damaged, or no bags: named, and the rest recovered."""

from __future__ import annotations

import random
from itertools import pairwise
from pathlib import Path

import pytest
from network import repeats

from rosz.bags import Channel, Storage, create_writer, open_reader
from rosz.bags.edit.repair import recover
from rosz.bags.formats.ros1_form import to_ros1
from rosz.bags.formats.rosbag2_writer import Rosbag2Writer
from rosz.cli.main import run
from rosz.errors import BagError
from rosz.msgs.std_msgs.msg import String
from rosz.typestore import TypeStore

COUNT = 400
CHATTER = Channel("/chatter", "std_msgs/msg/String", definition="string data\n", node="/talker")
FORMS = {
    "mcap": "x.mcap",
    "bag": "x.bag",
    "rosbag2 mcap": "x/",
    "rosbag2 sqlite3": "sqlite/",
}


def text(number: int) -> str:
    return f"hello {number:04d} " + "x" * 100


def make(folder: Path, form: str) -> tuple[str, Path]:
    """Write a bag; return its path, and the file in it that has the messages."""
    path = f"{folder}/{FORMS[form]}"
    if form == "bag":
        channel, translate = to_ros1(CHATTER, TypeStore())
    else:
        channel, translate = CHATTER, lambda data, _: bytes(data)
    storage: Storage = "sqlite3" if form == "rosbag2 sqlite3" else "mcap"
    with create_writer(path, storage=storage) as writer:
        handle = writer.add(channel)
        for number in range(COUNT):
            data = String(data=text(number)).to_cdr()
            writer.write(handle, 1_000_000_000 + number, translate(data, 0))
            if number % 20 == 0:
                writer.flush()
    if not path.endswith("/"):
        return path, Path(path)
    (file,) = (one for one in Path(path).iterdir() if one.suffix in {".mcap", ".db3"})
    return path, file


def recovered(path: str, folder: Path) -> tuple[int, list[str]]:
    """Return how many messages are recovered, and the problems."""
    suffix = ".bag" if path.endswith(".bag") else ".mcap"
    copied = recover(Path(path), folder / f"{len(list(folder.iterdir()))}{suffix}")
    with open_reader(copied.path) as reader:
        assert not reader.problems
        found = [bytes(one.data) for one in reader.messages()]
    assert len(found) == copied.count
    known = {text(number).encode() for number in range(COUNT)}
    strange = [one for one in found if one.rstrip(b"\0")[-len(text(0)) :] not in known]
    assert len(strange) <= (1 if "sqlite" in path else 0)
    return copied.count, [str(one) for one in copied.problems]


@pytest.mark.parametrize("form", FORMS)
def test_cut_at_every_1000th_byte(tmp_path: Path, form: str) -> None:
    path, file = make(tmp_path, form)
    folder = tmp_path / "out"
    folder.mkdir()
    whole = file.read_bytes()
    counts: list[int] = []
    unreadable: list[int] = []
    for size in range(len(whole) // 1000 * 1000, 0, -1000):
        file.write_bytes(whole[:size])
        try:
            count, problems = recovered(path, folder)
        except BagError as error:
            count, problems = 0, [str(error)]
            unreadable.append(size)
        assert problems, size
        assert all(str(tmp_path) in one for one in problems)
        counts.append(count)
    assert max(unreadable, default=0) < 30_000
    assert all(more >= fewer for more, fewer in pairwise(counts))
    assert counts[0] >= COUNT - 40
    assert counts[len(counts) // 2] > COUNT // 5


@pytest.mark.parametrize("form", FORMS)
def test_the_end_is_damaged(tmp_path: Path, form: str, capsys: pytest.CaptureFixture[str]) -> None:
    """There is the index, in files of chunks; SQLite has it among the messages."""
    path, file = make(tmp_path, form)
    data = bytearray(file.read_bytes())
    end = len(data) - (40 if "sqlite" not in form else 9000)
    data[end - 60 : end] = b"\xee" * 60
    file.write_bytes(data)
    target = tmp_path / ("new.bag" if form == "bag" else "new.mcap")
    assert run(["bag", "check", path]) == 1
    assert str(file) in capsys.readouterr().err
    assert run(["bag", "fix", path, str(target)]) in {0, 1}
    with open_reader(target) as reader:
        assert reader.indexed
        assert reader.count() >= COUNT - 40


@pytest.mark.parametrize("form", FORMS)
def test_the_middle_is_damaged(
    tmp_path: Path, form: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path, file = make(tmp_path, form)
    data = bytearray(file.read_bytes())
    middle = len(data) // 2 // 4096 * 4096
    data[middle : middle + 4096] = b"\xee" * 4096
    file.write_bytes(data)
    target = tmp_path / ("new.bag" if form == "bag" else "new.mcap")
    assert run(["bag", "check", path]) == 1
    assert str(file) in capsys.readouterr().err
    assert run(["bag", "fix", path, str(target)]) == 1
    assert str(file) in capsys.readouterr().err
    with open_reader(target) as reader:
        assert COUNT > reader.count() >= COUNT // 2


@pytest.mark.parametrize("name", ["x.mcap", "x.bag", "x.db3"])
@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "the file is empty"),
        (b"\xff\xd8\xff\xe0 a picture", "it is not a bag: it begins with"),
        (b"#ROSBAG V1.2\n", "version 1.2, expected 2.0"),
        (b"SQLite format 3\0" + bytes(100), "not a bag of rosbag2, or damaged"),
    ],
)
def test_another_format_is_named(
    tmp_path: Path, name: str, content: bytes, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    for words in (["info"], ["check"], ["cat"], ["reindex"], ["play"]):
        assert run(["bag", *words, str(path)]) == 1
        text = capsys.readouterr().err
        assert str(path) in text
        assert reason in text
        assert "Traceback" not in text


@pytest.mark.parametrize("name", ["x.mcap", "x.bag", "x/"])
def test_a_place_that_cannot_be_written_is_named(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path, _ = make(tmp_path, "mcap")
    blocked = tmp_path / "file"
    blocked.write_text("")
    for words in (["convert", path], ["fix", path], ["filter", path]):
        assert run(["bag", *words, f"{blocked}/{name}"]) == 1
        assert "cannot create it: Not a directory" in capsys.readouterr().err
    assert run(["bag", "merge", path, "-o", f"{blocked}/{name}"]) == 1
    assert run(["bag", "split", path, "-o", f"{blocked}/{name}", "--size", "1"]) == 1


def test_damaged_sqlite_is_read_or_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Rosbag2Writer(tmp_path / "whole", storage="sqlite3") as writer:
        handle = writer.add(Channel("/chatter", "std_msgs/msg/String", definition="string data\n"))
        for number in range(1000):
            writer.write(handle, 1000 + number, String(data=f"hello {number}").to_cdr())
    whole = (tmp_path / "whole" / "whole_0.db3").read_bytes()
    damaged, target = tmp_path / "x.db3", tmp_path / "o.mcap"
    for seed in range(repeats(40, 400)):
        rng = random.Random(seed)
        data = bytearray(whole)
        for _ in range(rng.randrange(1, 20)):
            data[rng.randrange(rng.choice((len(data), 4096, 4096 * 8)))] = rng.randrange(256)
        damaged.write_bytes(data)
        for words in (["info"], ["check"], ["cat"], ["filter", str(target), "m.data != ''"]):
            target.unlink(missing_ok=True)
            assert run(["bag", words[0], str(damaged), *words[1:]]) in {0, 1}, (seed, words)
            assert "Traceback" not in capsys.readouterr().err, (seed, words)
