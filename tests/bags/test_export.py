"""Bags as tables, pictures, videos and plots."""

from __future__ import annotations

import csv
import json
import math
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from pyarrow import parquet

import rosz.bags
from bags.messages import MESSAGES
from rosz.bags.export.tables import file_names
from rosz.cli.main import run
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import Point, PointStamped, TransformStamped
from rosz.msgs.sensor_msgs.msg import CompressedImage, Image, Imu, LaserScan, TimeReference
from rosz.msgs.std_msgs.msg import Bool, Float64, Header, Int32, String
from rosz.msgs.tf2_msgs.msg import TFMessage

START = 1_700_000_000_000_000_000
STEP = 50_000_000
COUNT = 40
COLOR = np.full((12, 16, 3), (10, 120, 200), np.uint8)


def header(number: int) -> Header:
    return Header(0, Time.from_nsec(START + number * STEP), "map")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("bags") / "run.mcap"
    with rosz.bags.open(path, "w") as output:
        for number in range(COUNT):
            stamp = START + number * STEP
            point = Point(math.sin(number / 10), number / 10, 0.0)
            output.write("/point", PointStamped(header(number), point), stamp)
            ranges = [float(number)] * (number % 3) + [math.inf]
            output.write("/scan", LaserScan(header=header(number), ranges=ranges), stamp)
            output.write("/a_b", String(data=f'x,{number}\n"q"'), stamp)
            output.write("/a/b", Bool(data=number % 2 == 0), stamp)
            frames = [TransformStamped(header=header(number), child_frame_id="b")] * (number % 3)
            output.write("/tf", TFMessage(frames), stamp)
            output.write("/imu", Imu(header=header(number)), stamp)
            if number % 2 == 0 and number not in {20, 22}:
                image = Image(header(number), 12, 16, "bgr8", 0, 48, COLOR.tobytes())
                output.write("/cam/image", image, stamp)
    return str(path)


def words(path: str, folder: Path, *options: str) -> list[str]:
    return ["bag", "export", path, str(folder), *options]


def test_csv_has_the_same_columns_in_every_row(bag: str, tmp_path: Path) -> None:
    assert run(words(bag, tmp_path)) == 0
    assert {one.name for one in tmp_path.iterdir()} == {
        *(f"{name}.csv" for name in ("point", "scan", "a_b", "a%2Fb", "tf", "imu", "cam_image"))
    }
    files = {one.stem: one.read_text().splitlines(keepends=True) for one in tmp_path.iterdir()}
    rows = {name: list(csv.reader(lines)) for name, lines in files.items()}
    for table in rows.values():
        assert {len(row) for row in table} == {len(table[0])}
    assert rows["point"][0] == [
        *("time", "header.stamp", "header.frame_id", "point.x", "point.y", "point.z")
    ]
    stamp = str(START + STEP)
    assert rows["point"][2] == [stamp, stamp, "map", repr(math.sin(0.1)), "0.1", "0.0"]
    assert rows["a_b"][1][1] == 'x,0\n"q"'
    assert [row[1] for row in rows["a%2Fb"][1:3]] == ["1", "0"]
    assert json.loads(rows["scan"][3][-2]) == [2.0, 2.0, "Infinity"]
    assert json.loads(rows["tf"][2][1])[0]["child_frame_id"] == "b"
    assert rows["imu"][0][-1] == "linear_acceleration_covariance.8"
    assert "data" not in rows["cam_image"][0]


def test_parquet_has_typed_columns(
    bag: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosz.bags.export.tables._GROUP_ROWS", 15)
    assert run(words(bag, tmp_path, "--format", "parquet")) == 0
    scan = parquet.read_table(tmp_path / "scan.parquet")
    assert str(scan.schema.field("ranges").type) == "list<element: float>"
    assert scan["ranges"].to_pylist() == [
        [float(number)] * (number % 3) + [math.inf] for number in range(COUNT)
    ]
    assert scan["time"].cast("int64").to_pylist() == [START + n * STEP for n in range(COUNT)]
    assert scan["header.stamp"].cast("int64").to_pylist()[1] == START + STEP
    assert parquet.ParquetFile(tmp_path / "scan.parquet").num_row_groups == 3
    frames = parquet.read_table(tmp_path / "tf.parquet")["transforms"].to_pylist()
    assert [len(one) for one in frames] == [number % 3 for number in range(COUNT)]
    assert frames[1][0]["transform"]["rotation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    imu = parquet.read_table(tmp_path / "imu.parquet")
    assert imu.schema.field("orientation_covariance").type.value_type == "double"
    assert imu["orientation_covariance"][7].as_py() == [0.0] * 9
    assert parquet.read_table(tmp_path / "a%2Fb.parquet")["data"].to_pylist()[:2] == [True, False]
    pixels = parquet.read_table(tmp_path / "cam_image.parquet")["data"]
    assert pixels[0].as_py() == COLOR.tobytes()


@pytest.mark.parametrize("form", ["csv", "json", "parquet"])
def test_every_type_becomes_a_table(tmp_path: Path, form: str) -> None:
    messages: dict[str, Any] = {**MESSAGES, "/reference": TimeReference(header(1), Time(5, 6), "a")}
    with rosz.bags.open(tmp_path / "a.bag.mcap", "w") as output:
        for topic, message in messages.items():
            output.write(topic, message, START)
        output.write("/string", Int32(data=5), START + 1)
    out = tmp_path / "out"
    assert run(words(str(tmp_path / "a.bag.mcap"), out, "--format", form)) == 0
    assert len(list(out.iterdir())) == len(messages) + 1
    if form == "json":
        row = json.loads((out / "string-2.jsonl").read_text())
        assert row == {"time": START + 1, "data": 5}
        text = json.loads((out / "string.jsonl").read_text())["data"]
        assert text == MESSAGES["/string"].data


def test_names_of_files_are_unique() -> None:
    assert file_names(["/a/b", "/c/d"]) == {"/a/b": "a_b", "/c/d": "c_d"}
    assert file_names(["/a/b", "/a_b", "/x"]) == {"/a/b": "a%2Fb", "/a_b": "a_b", "/x": "x"}


def test_a_topic_with_nul_is_exported(tmp_path: Path) -> None:
    with rosz.bags.open(tmp_path / "a.mcap", "w") as made:
        made.write("/a\0b", String(data="x"), 5)
    assert run(["bag", "export", str(tmp_path / "a.mcap"), str(tmp_path / "out")]) == 0
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["a%00b.csv"]


def test_what_exists_is_not_replaced(
    bag: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for form in ("csv", "png", "mp4"):
        only = ("--format", form, "--topics", "/cam/image")
        assert run(words(bag, tmp_path, *only)) == 0
        assert run(words(bag, tmp_path, *only)) == 1
        assert "already; -f" in capsys.readouterr().err
        assert run(words(bag, tmp_path, "-f", *only)) == 0


def test_wrong_words_are_named(
    bag: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"

    def refused(*options: str) -> str:
        assert run(words(bag, out, *options)) in {1, 2}
        return capsys.readouterr().err

    assert "--format is 'gif'; expected csv, json" in refused("--format", "gif")
    assert "--fps is for videos" in refused("--fps", "3")
    assert "--fps is 0; expected more" in refused("--fps", "0", "--format", "mp4")
    assert "no topic '/nix' in the bag" in refused("--topics", "/nix")
    assert "--end is 2, before --start 5" in refused("--start", "5", "--end", "2")
    assert "has no images, but std" in refused("--format", "png", "--topics", "/a_b")
    assert not out.exists()
    (tmp_path / "file").write_text("")
    assert run(words(bag, tmp_path / "file" / "x")) == 1
    assert "cannot make the folder: Not a directory" in capsys.readouterr().err


def test_missing_libraries_are_named(
    bag: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for module in ("pyarrow", "cv2", "matplotlib.figure"):
        monkeypatch.setitem(sys.modules, module, None)
    for form, extra in (("parquet", "parquet"), ("png", "vision"), ("mp4", "vision")):
        assert run(words(bag, tmp_path, "--format", form)) == 2
        assert f"pip install 'rosz[{extra}]'" in capsys.readouterr().err
    assert run(["bag", "plot", bag, "/a/b/data", "-o", str(tmp_path / "x.png")]) == 2
    assert "pip install 'rosz[plot]'" in capsys.readouterr().err


# Pictures.

DEPTH = np.array([[0.5, 1.25], [math.nan, 100.0]], np.float32)
GREY = np.arange(16, dtype=np.uint8).reshape(4, 4) * 10
IMAGES: dict[str, tuple[str, Any, Any]] = {
    "bgr8": ("bgr8", COLOR, COLOR),
    "rgb8": ("rgb8", COLOR[..., ::-1], COLOR),
    "bgra8": ("bgra8", np.dstack([COLOR, COLOR[..., 0]]), np.dstack([COLOR, COLOR[..., 0]])),
    "mono8": ("mono8", GREY, GREY),
    "mono16": ("mono16", GREY.astype(np.uint16) * 257, GREY.astype(np.uint16) * 257),
    "8UC3": ("8UC3", COLOR, COLOR),
    "16UC1": ("16UC1", GREY.astype(np.uint16) * 9, GREY.astype(np.uint16) * 9),
    "32FC1": ("32FC1", DEPTH, np.array([[500, 1250], [0, 65535]], np.uint16)),
    "16SC1": ("16SC1", np.array([[-5, 0], [5, 5]], np.int16), np.array([[0, 127], [255, 255]])),
    "bayer": ("bayer_rggb8", GREY, cv2.cvtColor(GREY, cv2.COLOR_BayerBG2BGR)),
}


@pytest.mark.parametrize("name", IMAGES)
def test_images_become_pictures(tmp_path: Path, name: str) -> None:
    encoding, array, expected = IMAGES[name]
    data = np.ascontiguousarray(array)
    step = data.strides[0]
    rows, columns = array.shape[:2]
    message = Image(header(1), rows, columns, encoding, 0, step, data.tobytes())
    with rosz.bags.open(tmp_path / "a.mcap", "w") as output:
        output.write("/i", message, START)
    out = tmp_path / "out"
    assert run(words(str(tmp_path / "a.mcap"), out, "--format", "png")) == 0
    (file,) = (out / "i").iterdir()
    assert file.name == "000000-1700000000.050000000.png"
    found = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert found is not None
    assert np.array_equal(found, expected)
    assert run(words(str(tmp_path / "a.mcap"), tmp_path / "jpg", "--format", "jpg")) == 0
    (file,) = (tmp_path / "jpg" / "i").iterdir()
    picture = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert picture is not None
    assert picture.shape[:2] == array.shape[:2]


def test_compressed_images_are_kept_as_they_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    jpeg = cv2.imencode(".jpg", COLOR)[1].tobytes()
    inverse = (20.0 / (DEPTH[:1] + 0.0) + 5.0).astype(np.uint16)
    png = cv2.imencode(".png", inverse)[1].tobytes()
    depth = np.array([0], np.int32).tobytes() + np.array([20.0, 5.0], np.float32).tobytes() + png
    with rosz.bags.open(tmp_path / "a.mcap", "w") as output:
        output.write("/c", CompressedImage(header(0), "jpeg", jpeg), START)
        output.write("/c", CompressedImage(header(1), "jpeg", b"none"), START + 1)
        output.write("/d", CompressedImage(header(0), "32FC1; compressedDepth png", depth), START)
    path = str(tmp_path / "a.mcap")
    assert run(words(path, tmp_path / "jpg", "--format", "jpg", "--topics", "/c")) == 1
    reason = "OpenCV cannot read its data of format 'jpeg'"
    problem = f"message of '/c' at {(START + 1) / 1e9:.9f} is left out: {reason}"
    assert problem in capsys.readouterr().err
    (file,) = (tmp_path / "jpg" / "c").iterdir()
    assert file.read_bytes() == jpeg
    assert run(words(path, tmp_path / "png", "--format", "png", "--topics", "/d")) == 0
    (file,) = (tmp_path / "png" / "d").iterdir()
    found = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    assert found is not None
    assert found.tolist() == [[500, 1250]]


def test_videos_keep_the_time(bag: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(words(bag, tmp_path, "--format", "mp4")) == 0
    file = tmp_path / "cam_image.mp4"
    line = f"{file}: 20 frames at 10 per second, 2 repeated, 0 left out\n"
    assert capsys.readouterr().out == line
    video = cv2.VideoCapture(str(file))
    assert video.get(cv2.CAP_PROP_FPS) == 10
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 20
    read, frame = video.read()
    video.release()
    assert read
    assert np.abs(frame.astype(int) - COLOR).max() < 12
    assert run(words(bag, tmp_path, "--format", "mp4", "--fps", "5", "-f")) == 0
    assert "at 5 per second, 1 repeated" in capsys.readouterr().out


def test_frames_of_another_size_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with rosz.bags.open(tmp_path / "a.mcap", "w") as output:
        for number, width in enumerate((16, 16, 8)):
            data = bytes(12 * width)
            image = Image(header(number), 12, width, "mono8", 0, width, data)
            output.write("/i", image, START + number)
    assert run(words(str(tmp_path / "a.mcap"), tmp_path / "out", "--format", "mp4")) == 1
    captured = capsys.readouterr()
    assert "an image of 8 x 12 pixels does not fit a video of 16 x 12" in captured.err
    assert "2 frames at 20 per second" in captured.out


# Plots.


def plot(bag: str, *words: str) -> int:
    return run(["bag", "plot", bag, *words])


def test_plots_are_drawn(bag: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["/point/point/x:y", "/scan/ranges[0],/a/b/data", "-o"]
    for suffix, begin in (("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")):
        file = tmp_path / f"x.{suffix}"
        assert plot(bag, *words, str(file)) == 0
        assert file.read_bytes().startswith(begin)
    assert plot(bag, *words, str(tmp_path / "nix" / "x.png")) == 1
    assert "x.png: cannot write to it: No such file" in capsys.readouterr().err


def test_curves_have_the_values_of_the_bag(bag: str) -> None:
    from rosz.bags.export.plotting import find_curves, read_curves

    with rosz.bags.open(bag) as source:
        topics = {topic: [name] for topic, name in source.topics.items()}
        classes = {type(one.message)._type_name: type(one.message) for one in source.messages()}
        fields = ["/point/point/x:y", "/point/point,/a/b/data", "/scan/ranges[0:2]"]
        axes = find_curves(fields, topics, classes.__getitem__)
        read_curves(axes, source.reader.messages(), source.decoder, source.start)
    labels = [[one.label for one in axis] for axis in axes]
    assert labels == [
        ["/point/point/x", "/point/point/y"],
        ["/point/point/x", "/point/point/y", "/point/point/z", "/a/b/data"],
        ["/scan/ranges[0:2]"],
    ]
    times, values = axes[0][0].lines[""]
    assert list(times) == [number * STEP / 1e9 for number in range(COUNT)]
    assert list(values) == [math.sin(number / 10) for number in range(COUNT)]
    assert list(axes[2][0].lines) == [" 0", " 1"]
    assert math.isnan(axes[2][0].lines[" 0"][1][0])


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["/a_b/data"], "'/a_b/data' is a string, and only numbers can be plotted"),
        (["/nix"], "unknown topic '/nix'"),
        (["/point/point/w"], "has no field 'w'"),
        (["/imu/orientation[0]"], "takes no index"),
        (["/a/b/data", "--start", "500"], "no message of that time has such a field"),
        (["/scan/ranges[9]"], "40 messages have no '/scan/ranges[9]'"),
        (["/a/b/data", "-o", "x.gif"], "expected .png, .svg, .pdf"),
    ],
)
def test_what_cannot_be_plotted_is_named(
    bag: str, tmp_path: Path, words: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    output = [] if "-o" in words else ["-o", str(tmp_path / "x.png")]
    assert plot(bag, *words, *output) != 0
    assert reason in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_long_arrays_are_not_plotted_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with rosz.bags.open(tmp_path / "a.mcap", "w") as output:
        output.write("/scan", LaserScan(ranges=[1.0] * 50), START)
        output.write("/x", Float64(data=1.0), START)
    path = str(tmp_path / "a.mcap")
    assert plot(path, "/scan/ranges", "-o", str(tmp_path / "x.png")) == 2
    assert "has 50 elements; choose some, as /scan/ranges[0]" in capsys.readouterr().err


# Filters.


@pytest.mark.parametrize(
    ("expression", "reason"),
    [
        ("m.data ==", "is not a Python expression: invalid syntax at column 10"),
        ("topic = 3", "at column 7"),
        ("m.data[5", "'[' was never closed at column 7"),
        ("1/0", "failed: ZeroDivisionError: division by zero, at message 1, of '/point' at 17"),
        ("topic == '/tf' and m.data", "'TFMessage' object has no attribute 'data', at message 5"),
        ("undefined", "NameError: name 'undefined' is not defined"),
    ],
)
def test_wrong_filters_are_named_and_write_nothing(
    bag: str, tmp_path: Path, expression: str, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "x.mcap"
    output.write_text("older")
    assert run(["bag", "filter", bag, str(output), expression]) != 0
    assert reason in capsys.readouterr().err
    assert [one.name for one in tmp_path.iterdir()] == ["x.mcap"]
    assert output.read_text() == "older"


def test_an_empty_filter_result_is_a_bag(
    bag: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "x.mcap"
    assert run(["bag", "filter", bag, str(output), "topic == '/nix'"]) == 0
    assert capsys.readouterr().out == f"{output}: 0 messages\n"
    with rosz.bags.open(output) as found:
        assert found.count() == 0
