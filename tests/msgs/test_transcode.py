"""Messages change between ROS 1's layout and CDR as by decoding and encoding them."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from rosz.bags import Payload
from rosz.errors import DecodeError
from rosz.message import Message
from rosz.message.transcode import compile_from_cdr, compile_transcoder
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.sensor_msgs.msg import Image
from rosz.msgs.shape_msgs.msg import SolidPrimitive
from rosz.msgs.std_msgs.msg import Header

from .test_ros1_layout import NAMES, ros1_value


def _transcoder(cls: type[Message]) -> Callable[[Payload], bytes]:
    return compile_transcoder(cls, lambda data: cls.from_ros1(data).to_cdr())


@pytest.mark.parametrize("name", NAMES)
def test_layouts_are_translated_as_by_decoding(name: str) -> None:
    rng = random.Random(name)
    for _ in range(5):
        message = ros1_value(name, rng)
        cls = type(message)
        translate = _transcoder(cls)
        data = message.to_ros1()
        expected = cls.from_ros1(data).to_cdr()
        assert translate(data) == translate(memoryview(data)) == expected
        assert translate(data + b"more") == expected


def test_few_types_are_translated_by_decoding() -> None:
    def plainly(data: Payload) -> bytes:
        return bytes(data)

    assert compile_transcoder(SolidPrimitive, plainly) is plainly
    assert compile_transcoder(Odometry, plainly) is not plainly


def test_bytes_that_are_cut_are_refused_as_by_decoding() -> None:
    data = ros1_value("nav_msgs/Odometry", random.Random(1)).to_ros1()
    translate = _transcoder(Odometry)
    for size in range(len(data)):
        with pytest.raises(DecodeError):
            translate(data[:size])


@pytest.mark.parametrize("name", NAMES)
def test_cdr_is_translated_as_by_decoding(name: str) -> None:
    rng = random.Random(name)
    for _ in range(5):
        message = ros1_value(name, rng)
        cls = type(message)

        def plainly(data: bytes, _seq: bytes, cls: type[Message] = cls) -> bytes:
            return cls.from_cdr(data).to_ros1()

        translate = compile_from_cdr(cls, plainly)
        data = cls.from_ros1(message.to_ros1()).to_cdr()
        expected = cls.from_cdr(data).to_ros1()
        assert b"".join(translate(data, bytes(4))) == expected
        assert b"".join(translate(data + bytes(3), bytes(4))) == expected


def test_headers_get_the_sequence_number() -> None:
    data = Odometry(header=Header(frame_id="map")).to_cdr()
    translate = compile_from_cdr(Odometry, lambda data, _seq: data)
    assert Odometry.from_ros1(b"".join(translate(data, b"\x07\0\0\0"))).header.seq == 7


def test_an_image_is_not_copied() -> None:
    data = Image(data=bytes(1000)).to_cdr()
    parts = compile_from_cdr(Image, lambda data, _seq: data)(data, bytes(4))
    assert sum(len(part) for part in parts if isinstance(part, bytes)) < 100


def test_cdr_that_is_cut_is_refused_as_by_decoding() -> None:
    data = ros1_value("nav_msgs/Odometry", random.Random(1)).to_cdr()
    translate = compile_from_cdr(Odometry, lambda data, _seq: Odometry.from_cdr(data).to_ros1())
    for size in range(len(data)):
        with pytest.raises(DecodeError):
            translate(data[:size], bytes(4))
