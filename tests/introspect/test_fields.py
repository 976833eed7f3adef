"""Paths to fields, with ROS 1's names of them too."""

from __future__ import annotations

from array import array
from typing import Any

import pytest

from rosz.errors import NotFoundError
from rosz.introspect.fields import FieldPath
from rosz.message import Message
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.sensor_msgs.msg import CameraInfo
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.stereo_msgs.msg import DisparityImage

INFO = CameraInfo(header=Header(7, Time(3, 4)), k=array("d", range(9)), p=array("d", [2.0] * 12))


@pytest.mark.parametrize(
    ("message", "path", "kind", "value"),
    [
        (INFO, "k", "float64[9]", INFO.k),
        (INFO, "K", "float64[9]", INFO.k),
        (INFO, "K[2]", "float64", 2.0),
        (INFO, "P[0:2]", "float64[12]", [2.0, 2.0]),
        (INFO, "header/seq", "uint32", 7),
        (INFO, "header/stamp/secs", "int32", 3),
        (INFO, "header/stamp/nsecs", "uint32", 4),
        (DisparityImage(t=0.5), "T", "float32", 0.5),
    ],
)
def test_paths(message: Message, path: str, kind: str, value: Any) -> None:
    field = FieldPath(path)
    assert field.type_in(type(message)) == kind
    found = field.read(message)
    assert (list(found) if isinstance(value, list) else found) == value


@pytest.mark.parametrize("path", ["secs", "seq", "Q", "header/K"])
def test_names_that_the_message_does_not_have(path: str) -> None:
    with pytest.raises(NotFoundError, match=f"has no field '{path.rpartition('/')[2]}'"):
        FieldPath(path).type_in(CameraInfo)
