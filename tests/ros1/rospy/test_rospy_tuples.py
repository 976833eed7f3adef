"""Numeric sequences arrive as tuples, long ones as sequences that behave so."""

from __future__ import annotations

import copy
import json
import pickle
from typing import Any

import numpy as np
import pytest

from rosz.errors import DecodeError
from rosz.message.tuples import LONGEST_TUPLE, LongTuple, tuple_decoder
from rosz.msgs.geometry_msgs.msg import PoseWithCovariance
from rosz.msgs.std_msgs.msg import Float32MultiArray, String
from rosz.typestore import TypeStore, shipped_packages, shipped_types

from .rospy_programs import Printed

SIZES = (0, 3, LONGEST_TUPLE, LONGEST_TUPLE + 1, 10_000)


def received(size: int) -> tuple[Any, Any]:
    """Return a received sequence, and the tuple that it stands for."""
    numbers: Any = tuple(map(float, range(size)))
    data = Float32MultiArray(data=list(numbers)).to_cdr()
    return tuple_decoder(Float32MultiArray)(data).data, numbers


@pytest.mark.parametrize("size", SIZES)
def test_it_is_a_tuple(size: int) -> None:
    data, numbers = received(size)
    assert type(data) is (tuple if size <= LONGEST_TUPLE else LongTuple)
    assert data == numbers
    assert numbers == data
    assert not data != numbers  # noqa: SIM202  # another method
    assert data != [*numbers]
    assert hash(data) == hash(numbers)
    assert {data: 1}[numbers] == 1
    assert data + (3.0,) == (*numbers, 3.0)  # noqa: RUF005  # what is tested
    assert (3.0,) + data == (3.0, *numbers)  # noqa: RUF005
    assert data[:2] == numbers[:2]
    assert data < (*numbers, 1.0)
    assert repr(data) == repr(numbers)
    assert isinstance(data, tuple)
    fixed: Any = data
    with pytest.raises(TypeError, match="item assignment"):
        fixed[0] = 1.0


@pytest.mark.parametrize("size", SIZES)
def test_it_is_written_as_a_tuple(size: int) -> None:
    data, numbers = received(size)
    assert json.dumps({"data": data}) == json.dumps({"data": numbers})
    assert json.dumps(data, indent=1) == json.dumps(numbers, indent=1)
    assert np.array_equal(np.asarray(data), numbers)
    assert Float32MultiArray(data=data).to_cdr() == Float32MultiArray(data=numbers).to_cdr()
    for same in (copy.copy(data), copy.deepcopy(data), pickle.loads(pickle.dumps(data))):
        assert same == numbers


def test_json_refuses_what_it_does_not_know() -> None:
    received(10_000)
    with pytest.raises(TypeError, match="not JSON serializable"):
        json.dumps(object())


def test_long_sequences_are_buffers() -> None:
    data, _ = received(10_000)
    assert np.frombuffer(data, np.float32).shape == (10_000,)


def test_all_shipped_types_have_tuples() -> None:
    found = 0
    store = TypeStore()
    for package in shipped_packages():
        for name in shipped_types(package, "msg"):
            cls = store.message(f"{package}/{name}")
            kind: Any = cls
            made = tuple_decoder(kind)(cls().to_cdr())
            assert type(made) is cls
            assert "array(" not in repr(made)
            found += tuple_decoder(kind) is not cls._decode
    assert found > 20


def test_big_endian_and_damaged_bytes() -> None:
    decode = tuple_decoder(Float32MultiArray)
    layout = b"\0\0\0\0\0\0\0\0"
    big = b"\0\0\0\0" + layout + b"\0\0\0\1" + b"\x3f\x80\0\0"
    assert decode(big).data == (1.0,)
    for size in range(len(big)):
        with pytest.raises(DecodeError):
            decode(big[:size])


def test_other_types_keep_their_decoder() -> None:
    assert tuple_decoder(String) is String._decode
    assert (
        tuple_decoder(PoseWithCovariance)(PoseWithCovariance().to_cdr()).covariance == (0.0,) * 36
    )


def test_on_topics_and_in_services(printed: Printed) -> None:
    assert printed("""
        import json
        import rospy
        from std_msgs.msg import Float64MultiArray
        from sensor_msgs.srv import SetCameraInfo, SetCameraInfoResponse
        rospy.init_node("tuples")
        out = rospy.Publisher("numbers", Float64MultiArray, queue_size=1, latch=True)
        out.publish(data=[1.0, 2.0])
        n = rospy.wait_for_message("numbers", Float64MultiArray, 60)
        print(n.data == (1.0, 2.0), n.data + (3.0,), json.dumps(n.data), len({n.data}))
        taken = []
        def handle(request):
            taken.append(request.camera_info.D)
            return SetCameraInfoResponse(True, "")
        rospy.Service("set", SetCameraInfo, handle)
        call = rospy.ServiceProxy("set", SetCameraInfo)
        request = SetCameraInfo._request_class()
        request.camera_info.D = [0.5]
        call(request)
        print(taken)
        print(Float64MultiArray().data + [1.0], json.dumps(request.camera_info.K[:2]))
        """) == [
        "True (1.0, 2.0, 3.0) [1.0, 2.0] 1",
        "[(0.5,)]",
        "[1.0] [0.0, 0.0]",
    ]
