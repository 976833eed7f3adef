"""Messages in ROS 1's layout become the CDR that decoding and encoding makes of them."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from rosz.bags import Payload
from rosz.bags.transcode import compile_transcoder
from rosz.errors import DecodeError
from rosz.message import Message
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.shape_msgs.msg import SolidPrimitive

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
