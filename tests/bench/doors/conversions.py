"""Rates at which messages become JSON and back, beside rosbridge_library's conversion."""

from __future__ import annotations

import json
import subprocess
import time
from array import array
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rosz.bridges.rosbridge.encoded import EncodedMessage, Encodings
from rosz.bridges.rosbridge.messages import build_from_json
from rosz.bridges.rosbridge.operations import Publish, read_text
from rosz.msgs.geometry_msgs.msg import PoseStamped
from rosz.msgs.sensor_msgs.msg import LaserScan

from ..figures import Figure  # noqa: TID252  # tests is no package

__all__ = ("measure",)

LIBRARY = "rosbridge_library"
CASES = ("PoseStamped", "LaserScan of 360 beams")

# A program of Debian's Python; it also runs here, where its imports are those of rosz.
RATE = """
def rate(function, seconds):
    done, begun = 0, time.perf_counter()
    while time.perf_counter() < begun + seconds:
        for _ in range(20):
            function()
        done += 20
    return done / (time.perf_counter() - begun)
"""
PEER = (
    """
import io, json as std, sys, time
sys.path.insert(0, sys.argv[1])
from rosbridge_library.internal import message_conversion as conversion
from rosbridge_library.util import json
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import LaserScan
conversion.bson_only_mode = False  # it asks a master otherwise
"""
    + RATE
    + """
def raw(message):
    file = io.BytesIO()
    message.serialize(file)
    return file.getvalue()
pose = PoseStamped()
pose.header.frame_id, pose.pose.position.x = "map", 1.234567
numbers = [n * 0.0123 for n in range(360)]
scan = LaserScan(ranges=numbers, intensities=numbers)
for message in (pose, scan):
    cls, data = type(message), raw(message)
    def out():
        plain = conversion.extract_values(cls().deserialize(data))
        return json.dumps({"op": "publish", "topic": "/x", "msg": plain})
    text = out()
    def back():
        return raw(conversion.populate_instance(json.loads(text)["msg"], cls()))
    print(std.dumps([rate(out, float(sys.argv[2])), rate(back, float(sys.argv[2]))]))
"""
)


def measure(library: Path | None, rounds: int, seconds: float) -> list[Figure]:
    """Measure both in turn.

    Args:
        library: Folder ``rosbridge_library/src`` of a checkout for ROS 1; None for rosz alone.
        rounds: How often.
        seconds: Time for each case and direction.
    """
    asked = {LIBRARY: "3 at least"}
    figures = [
        Figure(f"{case} {way}", "per second", asked)
        for case in CASES
        for way in ("to JSON", "from JSON")
    ]
    for _ in range(rounds):
        for figure, value in zip(figures, _own(seconds), strict=True):
            figure.add(figure.own, value)
        if library is None:
            continue
        command = ["/usr/bin/python3", "-c", PEER, str(library), str(seconds)]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        values = [value for line in text.splitlines() for value in json.loads(line)]
        for figure, value in zip(figures, values, strict=True):
            figure.add(LIBRARY, value)
    return figures


def _own(seconds: float) -> Iterator[float]:
    space: dict[str, Any] = {"time": time}
    exec(RATE, space)
    rate: Callable[[Callable[[], object], float], float] = space["rate"]
    pose = PoseStamped()
    pose.header.frame_id, pose.pose.position.x = "map", 1.234567
    numbers = array("f", [n * 0.0123 for n in range(360)])
    for message in (pose, LaserScan(ranges=numbers, intensities=numbers)):
        cls, data = type(message), message.to_cdr()

        def out(cls: Any = cls, data: bytes = data) -> bytes:
            return EncodedMessage(Encodings(1 << 24), "/x", cls, data, 0).encode(("none", "ros1"))

        text = out()

        def back(cls: Any = cls, text: bytes = text) -> bytes:
            operation = read_text(text)
            assert isinstance(operation, Publish)
            made: bytes = build_from_json(cls, operation.msg, "ros1", 0).to_cdr()
            return made

        yield rate(out, seconds)
        yield rate(back, seconds)
