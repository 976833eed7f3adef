"""Messages from the JSON of clients: what is compiled agrees with what is done field by field."""

from __future__ import annotations

import importlib
import math
import pkgutil
from typing import Any

import msgspec
import pytest

import rosz.msgs
from rosz.bridges.clients import build
from rosz.bridges.rosbridge.messages import build_from_json
from rosz.bridges.rosbridge.plain import Spelling, converter
from rosz.errors import EncodeError, UsageError
from rosz.message import INTEGER_RANGES, Message, slots
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import PoseStamped
from rosz.msgs.sensor_msgs.msg import Image, LaserScan, PointCloud2
from rosz.msgs.std_msgs.msg import Byte, ByteMultiArray, Header, Int8, UInt64

NOW = 5_000_000_007


def filled(cls: Any) -> Any:
    """Return a message with extreme numbers, and three elements where there may be three."""
    values: dict[str, Any] = {}
    for slot in slots(cls):
        if isinstance(slot.kind, str):
            low, high = INTEGER_RANGES.get(slot.kind, (0, 0))
            number = {"bool": True, "float32": 1.5, "float64": -1e300}
            few = [low, high, 0] if high else [number.get(slot.kind, "wörd")] * 3
            few = [max(one, 0) for one in few] if slot.kind == "byte" else few
        else:
            few = [filled(slot.kind)] * 3
        if slot.shape == "one":
            values[slot.name] = few[1]
        else:
            values[slot.name] = (few * slot.size)[: slot.size or 3]
    return cls(**values)


CLASSES = [
    one
    for package in pkgutil.iter_modules(rosz.msgs.__path__)
    if importlib.util.find_spec(f"rosz.msgs.{package.name}.msg")
    for one in vars(importlib.import_module(f"rosz.msgs.{package.name}.msg")).values()
    if isinstance(one, type) and issubclass(one, Message) and one.__module__.startswith("rosz.msgs")
]


@pytest.mark.parametrize("spelling", ["ros1", "ros2"])
def test_all_types(spelling: Spelling, monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(CLASSES) > 200
    for cls in CLASSES:
        message = filled(cls)
        plain = converter(cls, spelling)(message)
        wanted = build(cls, plain, NOW).to_cdr()
        with monkeypatch.context() as patch:
            # Nothing is left to the slow way.
            patch.setattr("rosz.bridges.rosbridge.messages.build", None)
            text = msgspec.Raw(msgspec.json.encode(plain))
            assert build_from_json(cls, text, spelling, NOW).to_cdr() == wanted, cls
            empty = build_from_json(cls, msgspec.Raw(b"{}"), spelling, NOW)
            assert empty.to_cdr() == build(cls, {}, NOW).to_cdr(), cls


@pytest.mark.parametrize(
    ("cls", "text"),
    [
        (PoseStamped, '{"header": {"frame_id": "map"}, "pose": {"position": {"x": 1}}}'),
        (PoseStamped, '{"header": {"stamp": {}}, "pose": null}'),
        (PoseStamped, '{"header": null}'),
        (PoseStamped, '{"header": {"stamp": "now", "seq": 3}}'),
        (PoseStamped, '{"header": {"stamp": {"sec": 3, "nsecs": 4}}}'),
        (PoseStamped, '{"pose": {"position": [1, 2, 3]}}'),
        (PoseStamped, '{"pose": {"position": {"x": "1e-5", "y": null}}}'),
        (PoseStamped, '{"pose": {"position": {"z": 1e400}}}'),
        (PoseStamped, '{"pose": {"position": {"w": 1}}}'),
        (PoseStamped, '{"pose": {"position": {"x": true}}}'),
        (PoseStamped, "[]"),
        (PoseStamped, "{"),
        (PoseStamped, "[" * 100_000),
        (LaserScan, '{"ranges": [1, null, 2.5]}'),
        (LaserScan, '{"ranges": [1e300]}'),
        (LaserScan, '{"ranges": "x"}'),
        (Image, '{"data": [1, 255], "height": 3}'),
        (Image, '{"data": [-1]}'),
        (Image, '{"data": "A"}'),
        (Image, '{"data": "Af8="}'),
        (PointCloud2, '{"is_dense": 1, "fields": [{"name": "x", "count": 3}]}'),
        (PointCloud2, '{"fields": [{"nome": "x"}]}'),
        (Int8, '{"data": 128}'),
        (UInt64, '{"data": 18446744073709551615}'),
        (UInt64, '{"data": 18446744073709551616}'),
    ],
)
@pytest.mark.parametrize("spelling", ["ros1", "ros2"])
def test_both_ways_agree(cls: Any, text: str, spelling: Spelling) -> None:
    def outcome(way: Any) -> Any:
        try:
            return way().to_cdr()
        except EncodeError as error:
            return type(error)

    try:
        members = msgspec.json.decode(text, type=dict[str, Any])
    except (msgspec.MsgspecError, RecursionError):
        with pytest.raises(UsageError, match="msg: "):
            build_from_json(cls, msgspec.Raw(text.encode()), spelling, NOW)
        return
    raw = msgspec.Raw(text.encode())
    fast = outcome(lambda: build_from_json(cls, raw, spelling, NOW))
    assert fast == outcome(lambda: build(cls, members, NOW))


def test_a_header_without_a_stamp_gets_the_time() -> None:
    raw = msgspec.Raw(b'{"header": {"frame_id": "map"}}')
    header = build_from_json(PoseStamped, raw, "ros1", NOW).header
    assert header == Header(stamp=Time.from_nsec(NOW), frame_id="map")


def test_null_is_nan() -> None:
    raw = msgspec.Raw(b'{"ranges": [1, null]}')
    ranges = build_from_json(LaserScan, raw, "ros1", NOW).ranges
    assert ranges[0] == 1
    assert math.isnan(ranges[1])


def test_a_byte_is_signed_in_ros1() -> None:
    for cls, plain in ((Byte, {"data": -127}), (ByteMultiArray, {"data": [-128, 0, 127]})):
        made = build_from_json(cls, msgspec.Raw(msgspec.json.encode(plain)), "ros1", NOW)
        message = cls.from_cdr(made.to_cdr())
        assert converter(cls, "ros1")(message)["data"] == plain["data"]
    assert converter(Byte, "ros2")(Byte(200)) == {"data": 200}
