"""Command lines of ROS 1's rosbag, and scripts that import rosbag, on real ROS 1 and on rosz."""

from __future__ import annotations

import shlex
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from oracle import Worker, ours, real, require

from rosz.cli.main import run

pytestmark = pytest.mark.ros1

PACKAGES = "rosbag, python3-rosbag"
BAGS = {
    "plain": ("none", 400, 768 * 1024),
    "small_chunks": ("none", 400, 2000),
    "bz2": ("bz2", 400, 4000),
    "lz4": ("lz4", 400, 4000),
    "one": ("none", 1, 768 * 1024),
    "empty": ("none", 0, 768 * 1024),
}


@pytest.fixture(scope="module")
def rosbag() -> Iterator[Worker]:
    require("rosbag", "roslz4", package=PACKAGES)
    worker = Worker("rosbag_calls")
    yield worker
    worker.close()


@pytest.fixture(scope="module")
def folder(rosbag: Worker, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("bags")
    for name, (compression, count, threshold) in BAGS.items():
        rosbag.call("make", str(made / f"{name}.bag"), compression, count, threshold)
    return made


@pytest.fixture(autouse=True)
def _in_utc(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    with monkeypatch.context() as patch:
        patch.setenv("TZ", "UTC")
        time.tzset()
        yield
    time.tzset()


OPTIONS = (
    "",
    "--freq",
    "-y",
    "--yaml --freq",
    "-y -k duration",
    "-y -k start",
    "-y --key messages",
    "-y -k compression",
    "-y -k topics",
    "-y -k types",
)
INFO = [
    f"info {options} {bag}.bag"
    for bag in ("plain", "small_chunks", "bz2", "lz4", "one")
    for options in (OPTIONS if bag == "bz2" else OPTIONS[:6])
] + ["info plain.bag bz2.bag", "info -y plain.bag lz4.bag", "info -y -k size plain.bag one.bag"]


@pytest.mark.parametrize("line", INFO)
def test_info_prints_the_same(
    rosbag: Worker,
    folder: Path,
    line: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(folder)
    code, expected = rosbag.call("command", line.split(), str(folder))
    assert run(["bag", *line.split()]) == code
    assert capsys.readouterr().out == expected


WRONG = (
    "info",
    "info missing.bag",
    "info -k duration plain.bag",
    "info text.bag",
    "filter",
    "filter plain.bag",
    "filter missing.bag out.bag True",
    "filter plain.bag plain.bag True",
    "play",
    "check",
    "fix plain.bag",
    "reindex",
    "record",
)


@pytest.mark.parametrize("line", WRONG)
def test_what_rosbag_refuses_is_refused(
    rosbag: Worker,
    folder: Path,
    line: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(folder)
    (folder / "text.bag").write_text("no bag\n")
    code, _ = rosbag.call("command", line.split(), str(folder))
    assert code
    assert run(["bag", *line.split()]) != 0
    assert capsys.readouterr().err


FILTERS = (
    "topic == '/tf'",
    "topic != '/tf' and topic != '/cmd_vel'",
    "m._type == 'std_msgs/String'",
    "topic == '/cmd_vel' and m.linear.x > 390",
    "topic == '/chatter' and m.data.endswith('3')",
    "topic == '/tf' and m.transforms[0].header.frame_id == 'a'",
    "topic == '/tf' and m.transforms[0].header.seq == 57",
    "topic == '/info' and m.K[0] == 1.0",
    "t.secs == 1500000001",
    "t.to_sec() < 1500000000.5",
    "t.nsecs == 0 and topic == '/cmd_vel'",
    "t.secs <= 1500000002 and 'e' in topic",
)


@pytest.mark.parametrize("expression", FILTERS)
def test_filter_keeps_the_same(
    rosbag: Worker,
    folder: Path,
    expression: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    theirs, mine = tmp_path / "theirs.bag", tmp_path / "mine.bag"
    source = str(folder / "bz2.bag")
    words = ["filter", source, str(theirs), expression]
    assert rosbag.call("command", words, str(tmp_path))[0] == 0
    assert run(["bag", "filter", source, str(mine), expression]) == 0, shlex.join(words)
    found = rosbag.call("contents", str(mine))
    assert found == rosbag.call("contents", str(theirs))
    assert found
    capsys.readouterr()


def test_what_goes_through_mcap_comes_back(
    rosbag: Worker, folder: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    there, back = tmp_path / "x.mcap", tmp_path / "x.bag"
    source = str(folder / "lz4.bag")
    assert run(["bag", "convert", source, str(there)]) == 0
    assert run(["bag", "convert", str(there), str(back), "--compression", "bz2"]) == 0
    expected = sorted(rosbag.call("contents", source))
    assert sorted(row[::2] for row in rosbag.call("contents", str(back))) == sorted(
        row[::2] for row in expected
    )
    assert run(["bag", "split", str(back), "-u", "1", "-o", str(tmp_path / "part.bag")]) == 0
    parts = sorted(map(str, tmp_path.glob("part_*.bag")))
    assert len(parts) == 4
    assert run(["bag", "merge", *parts, "-o", str(tmp_path / "whole.bag")]) == 0
    assert rosbag.call("contents", str(tmp_path / "whole.bag")) == rosbag.call(
        "contents", str(back)
    )
    capsys.readouterr()


def test_export_writes_a_file_per_topic(
    folder: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    assert run(["bag", "export", str(folder / "bz2.bag"), str(out)]) == 0
    rows = (out / "cmd_vel.csv").read_text().splitlines()
    assert rows[0] == "time,linear.x,linear.y,linear.z,angular.x,angular.y,angular.z"
    assert rows[3] == "1500000000020000000,2.0,0.0,0.0,0.0,0.0,0.0"
    assert len(rows) == 401
    assert {one.name for one in out.iterdir()} >= {"chatter.csv", "tf.csv", "once.csv"}
    capsys.readouterr()


READING = """
import rosbag
from rosbag import Bag, Compression, ROSBagException, ROSBagFormatException
from rosbag.bag import Bag as Same
import rospy
path = "{path}"
bag = rosbag.Bag(path)
start = rospy.Time.from_sec(bag.get_start_time() + 1)
end = rospy.Time(1500000002)
types, topics = bag.get_type_and_topic_info()
info = bag.get_type_and_topic_info(topic_filters=["/tf"])
quick, stream = Bag(path, skip_index=True), open(path, "rb")
spooled = Bag(stream)
def closed(function):
    try:
        return function()
    except ValueError as error:
        return str(error)
result = [
    Same is Bag,
    [type(one).__name__ for one in (info, info.topics["/tf"], bag.get_compression_info())],
    [(topic, m._md5sum if topic in ("/info", "/marker") else str(m), t.to_nsec())
        for topic, m, t in bag.read_messages()],
    [(list(m.K), list(m.D)) for _, m, _ in bag.read_messages("/info")],
    [(x.topic, x.timestamp.to_sec()) for x in bag.read_messages("/chatter", start, end)],
    [x.timestamp.secs for x in bag.read_messages(topics=["/tf", "/once"], end_time=end)],
    [m.data for _, m, _ in bag.read_messages(connection_filter=lambda topic, datatype, md5sum,
        msg_def, header: datatype == "std_msgs/String" and header["topic"] == b"/chatter")],
    [(kind, raw, md5, cls._type) for _, (kind, raw, md5, _, cls), _ in
        bag.read_messages("/marker", raw=True)],
    [sorted(header) for *_, header in bag.read_messages("/once", return_connection_header=True)],
    [t.to_nsec() for _, _, t in bag][:5],
    bag.get_message_count(), bag.get_message_count("/tf"), bag.get_message_count(["/tf", "/no"]),
    bag.get_start_time(), bag.get_end_time(), tuple(bag.get_compression_info()),
    types, {{name: tuple(one) for name, one in topics.items()}}, tuple(info.topics["/tf"]),
    bag.size, bag.filename == path, bag.version, bag.mode, bag.compression, bag.chunk_threshold,
    bag.options, str(bag), bag._get_yaml_info(), str(quick),
    [tried(Bag, one) for one in ("/no/such.bag", "", "/dev/null")],
    tried(Bag, path, "x"), tried(lambda: Bag(path, compression="gz")),
    tried(lambda: Bag(path, options=3)), tried(lambda: Bag(path, chunk_threshold=-1)),
    spooled.get_message_count(), quick.close(), spooled.close(), stream.close(),
    bag.close(), closed(lambda: bag.size), closed(lambda: list(bag.read_messages())),
]
"""


@pytest.mark.parametrize("name", ["plain", "small_chunks", "bz2", "lz4"])
def test_scripts_read_the_same(folder: Path, name: str) -> None:
    script = READING.format(path=folder / f"{name}.bag")
    expected = real(script, "rosbag", PACKAGES, home=str(folder))
    found = ours(script)
    for number, (mine, theirs) in enumerate(zip(found, expected, strict=True)):
        assert mine == theirs, f"value {number}"


WRITING = """
import os, rosbag, rospy, io
from std_msgs.msg import Int32, String
from geometry_msgs.msg import PoseStamped
path = "{path}"
with rosbag.Bag(path, "w", compression=rosbag.Compression.BZ2) as bag:
    for number in range(30):
        bag.write("/n", Int32(data=number), rospy.Time(100 + number))
        bag.write("chatter", String("x"), t=rospy.Time(100, number))
    pose = PoseStamped()
    pose.header.seq, pose.pose.orientation.w = 8, 0.5
    bag.write("/pose", pose, rospy.Time(130))
    within = bag.get_message_count()
    refused = [tried(bag.write, "", pose), tried(bag.write, "/x", None)]
    bag.flush()
    with rosbag.Bag("{source}") as other:
        for _, raw, t in other.read_messages("/tf", raw=True):
            bag.write("/raw", raw, t, raw=True)
with rosbag.Bag(path, "a") as bag:
    bag.write("/late", Int32(data=1), rospy.Time(1600000000))
bag = rosbag.Bag(path)
result = [
    within, refused, [(topic, str(m), t.to_nsec()) for topic, m, t in bag],
    {{name: tuple(one) for name, one in bag.get_type_and_topic_info().topics.items()}},
    bag.get_start_time(), bag.get_end_time(), bag.get_compression_info().compression,
    bag.close(),
]
"""


def test_scripts_write_the_same(rosbag: Worker, folder: Path, tmp_path: Path) -> None:
    theirs, mine = tmp_path / "theirs.bag", tmp_path / "mine.bag"
    source = folder / "plain.bag"
    script = WRITING.format(path=theirs, source=source)
    expected = real(script, "rosbag", PACKAGES, home=str(folder))
    found = ours(WRITING.format(path=mine, source=source))
    for number, (one, other) in enumerate(zip(found, expected, strict=True)):
        assert one == other, f"value {number}"
    assert rosbag.call("contents", str(mine)) == rosbag.call("contents", str(theirs))
