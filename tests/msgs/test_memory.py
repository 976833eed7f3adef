"""What codecs remember from one message to the next never shows."""

from __future__ import annotations

import random
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from rosz.message.runtime import Stride, Template
from rosz.message.sequences import StringList, Texts
from rosz.msgs.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rosz.msgs.sensor_msgs.msg import JointState
from rosz.msgs.std_msgs.msg import Header, String

from . import reference
from .test_codec import CATALOG


def joint_bytes(names: list[str]) -> bytes:
    spec = CATALOG.message("sensor_msgs/msg/JointState")
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    plain: dict[str, Any] = {"header": header, "name": names}
    plain |= {"position": [], "velocity": [], "effort": []}
    return reference.encode(CATALOG, spec, plain)


def test_a_list_may_change_after_it_was_sent() -> None:
    names = ["a", "b"]
    message = JointState(name=names)
    assert message.to_cdr() == joint_bytes(["a", "b"])
    names[1] = "c"
    assert message.to_cdr() == joint_bytes(["a", "c"])
    names.append("d")
    assert message.to_cdr() == joint_bytes(["a", "c", "d"])


def test_a_received_list_belongs_to_its_message() -> None:
    data = joint_bytes(["a", "b"])
    first = JointState.from_cdr(data)
    second = JointState.from_cdr(data)
    first.name[0] = "x"
    second.name.append("y")
    assert JointState.from_cdr(data).name == ["a", "b"]


def test_lists_that_are_alike_at_their_beginning() -> None:
    for names in (["a"], ["a", "b"], ["a"], [], ["", ""], [""], ["ab", "c"], ["a", "bc"], []):
        data = joint_bytes(names)
        assert JointState.from_cdr(data).name == names
        assert JointState(name=names).to_cdr() == data


def test_equal_values_of_another_type_are_not_taken_for_strings() -> None:
    class Sly(str):
        __slots__ = ()

        def __eq__(self, other: object) -> bool:
            return True

        __hash__ = str.__hash__

    JointState(name=["arm"]).to_cdr()
    assert Header.from_cdr(Header(frame_id=Sly("arm")).to_cdr()).frame_id == "arm"


def test_long_lists_are_not_kept() -> None:
    memory = StringList()
    memory.put(["x" * 100] * 1000)
    assert memory.written == ([], bytes(4))
    data = memory.put(["a"])
    assert memory.written == (["a"], data)
    assert memory.take(data, 0) == (["a"], len(data))
    assert memory.read == (data, ["a"])


def test_texts_are_bounded() -> None:
    texts = Texts()
    assert texts["é"] == (3, b"\xc3\xa9\0")
    assert texts["x" * 1000] == (1001, b"x" * 1000 + b"\0")
    assert list(texts) == ["é"]
    for number in range(10_000):
        assert texts[str(number)][1] == f"{number}\0".encode()
    assert len(texts) <= 4096
    with pytest.raises(ValueError, match="NUL"):
        texts["a\0"]
    assert "a\0" not in texts


def test_layouts_are_bounded() -> None:
    template = Template("I $", 0)
    assert template[3](3, b"ab") == b"\3\0\0\0ab\0"
    for length in range(5000):
        assert len(template[length](0, b"")) == 4 + length
    assert len(template) <= 4096
    assert max(template) < 1024


def test_a_stride_knows_where_it_ends() -> None:
    stride = Stride("B I $ d", None, 8)
    for start in range(8):
        for length in range(1, 20):
            pack, end = stride[start, length]
            data = pack(1, length, b"x", 2.0)
            assert end == (start + len(data)) % 8
            at = (-(start + 1) % 4) + 1
            assert data[at : at + 4] == length.to_bytes(4, "little")
    aligned = Template("B |8", None)
    assert [len(aligned[start](1)) for start in range(8)] == [8, 7, 6, 5, 4, 3, 2, 1]


def test_threads_share_what_is_remembered() -> None:
    """Codecs run at the same time, on values that differ in length and content."""

    def work(seed: int) -> None:
        rng = random.Random(seed)
        for number in range(300):
            names = [rng.choice("abc") * rng.randrange(1, 9) for _ in range(rng.randrange(4))]
            joints = JointState(Header(frame_id=f"f{seed}"), names)
            assert JointState.from_cdr(joints.to_cdr()).name == names
            pairs = [KeyValue(name, f"{number} {seed}") for name in names]
            status = DiagnosticArray(status=[DiagnosticStatus(name="n" * seed, values=pairs)])
            assert DiagnosticArray.from_cdr(status.to_cdr()) == status
            assert String.from_cdr(String("s" * number).to_cdr()).data == "s" * number

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(work, range(8)))
