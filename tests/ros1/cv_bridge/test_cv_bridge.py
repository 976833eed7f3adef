"""cv_bridge beside ROS 1's."""

from __future__ import annotations

import subprocess
import sys

import oracle
import pytest

HEAD = """
import cv2, numpy as np, struct
import cv_bridge
from cv_bridge import CvBridge, CvBridgeError
from cv_bridge.boost import cv_bridge_boost as boost
from sensor_msgs.msg import Image, CompressedImage
from std_msgs.msg import Header
bridge = CvBridge()
named = [f"{color}{bits}" for color in ("mono", "rgb", "bgr", "rgba", "bgra", "bayer_rggb",
    "bayer_bggr", "bayer_gbrg", "bayer_grbg") for bits in (8, 16)] + ["yuv422"]
generic = [f"{depth}C{count}" for depth in ("8U", "8S", "16U", "16S", "32S", "32F", "64F")
    for count in (1, 2, 3, 4)]
def pixels(encoding, height=6, width=8):
    kind, channels = bridge.encoding_to_dtype_with_channels(encoding)
    kind = np.dtype(kind)
    shape = (height, width) if channels == 1 else (height, width, channels)
    random = np.random.RandomState(7)  # gives the same numbers in each version
    if kind.kind == "f":
        numbers = random.uniform(-70000, 70000, shape).astype(kind)
        edges = (np.nan, np.inf, -np.inf, 0.5, 1.5, -0.5, 127.5, 255.5, 1e10, -1e10, 2.5e9, 65535.5)
        numbers.flat[: len(edges)] = edges
        return numbers
    limits = np.iinfo(kind)
    numbers = random.randint(0, 2**31 - 1, shape).astype(np.int64)
    spread = int(limits.max) - int(limits.min) + 1
    numbers = (numbers * (spread // 2**31 or 1)) % spread + int(limits.min)
    return numbers.astype(kind)
def message(encoding):
    image = bridge.cv2_to_imgmsg(pixels(encoding))
    image.encoding = encoding
    return image
def tried(function, *arguments):
    try:
        return plain(function(*arguments))
    except TypeError as error:  # CvBridgeError is one
        return ["raises", "TypeError"]
    except Exception as error:
        return ["raises", type(error).__name__]
def shown(image):
    return [str(image.dtype), list(image.shape), image.tobytes().hex()]
"""

CONVERSIONS = (
    HEAD
    + """
def converted(source, target):
    return shown(bridge.imgmsg_to_cv2(message(source), target))
result = {f"{source} {target}": tried(converted, source, target)
    for source in named + generic for target in named + generic + ["nothing"]}
"""
)

MESSAGES = (
    HEAD
    + """
def fields(message):
    return [message.height, message.width, message.encoding, int(message.is_bigendian),
        message.step, bytes(message.data).hex(), message.header.frame_id]
def sent(image, *args, **options):
    return tried(lambda: fields(bridge.cv2_to_imgmsg(image, *args, **options)))
def read(image, *args):
    return tried(lambda: shown(bridge.imgmsg_to_cv2(image, *args)))
def compressed(encoding, form, desired):
    packed = bridge.cv2_to_compressed_imgmsg(pixels(encoding), form)
    return [packed.format, shown(bridge.compressed_imgmsg_to_cv2(packed, desired))]
big = Image(height=2, width=3, encoding="mono16", is_bigendian=1, step=6, data=bytes(range(12)))
nine = Image(height=2, width=3, encoding="8UC9", step=27, data=bytes(range(54)))
short = Image(height=2, width=3, encoding="bgr8", step=9, data=bytes(17))
no_step = Image(height=2, width=3, encoding="bgr8", data=bytes(range(18)))
small = pixels("8UC3", 2, 3)
floats = pixels("32FC1", 2, 3)
result = {
    "sent": [sent(pixels(name, 2, 3), name) for name in named + generic],
    "passed through": [sent(pixels(name, 2, 3)) for name in named + generic],
    "refused": [sent(small, name) for name in named + generic + ["nothing"]],
    "header": sent(small, header=Header(frame_id="camera")),
    "parts": sent(pixels("8UC3")[1:3, 2:6], "bgr8"),
    "big": [sent(pixels("16UC1").astype(">u2"), "mono16"), read(big), read(big, "mono8"),
        read(big, "mono16"), read(big, "bgr8")],
    "no image": [sent(1), sent([1, 2])],
    "odd": [read(nine), read(short), read(no_step), read(no_step, ""),
        read(Image(encoding="x"))],
    "compressed": [tried(compressed, encoding, form, desired)
        for encoding, form in (("8UC1", "bmp"), ("8UC3", "bmp"), ("8UC1", "png"),
            ("8UC3", "png"), ("8UC4", "png"), ("16UC1", "png"), ("16UC3", "png"))
        for desired in ("passthrough", "bgr8", "rgb8", "rgba8", "rgb16", "mono8", "nothing")],
    "formats": [bridge.cv2_to_compressed_imgmsg(small).format, bool(
        bridge.cv2_to_compressed_imgmsg(small, "jpeg").data), tried(
        bridge.compressed_imgmsg_to_cv2, CompressedImage(data=b"nothing"), "bgr8")],
    "types": [[bridge.encoding_to_dtype_with_channels(name),
        bridge.cvtype2_to_dtype_with_channels(bridge.encoding_to_cvtype2(name)),
        boost.CV_MAT_CNWrap(boost.getCvType(name)),
        bridge.dtype_with_channels_to_cvtype2(pixels(name).dtype, 2)]
        for name in named + generic + ["8U", "16S", "64F", "32FC7"]],
    "own": [cv_bridge.getCvType("32FC4") == cv2.CV_32FC4, boost.getCvType("bgr8") == cv2.CV_8UC3,
        tried(boost.getCvType, "nothing"), tried(bridge.encoding_to_cvtype2, "nothing"),
        issubclass(CvBridgeError, TypeError), sorted(bridge.cvtype_to_name.values()),
        sorted(bridge.cvdepth_to_numpy_depth.values()), bridge.numpy_type_to_cvtype],
    "display": [tried(lambda: shown(boost.cvtColorForDisplay(
        (pixels(name) if name[:2] != "32" else np.abs(pixels(name)) % 400), name, to, *options)))
        for name in ("mono8", "mono16", "16UC1", "rgb8", "rgba16", "32SC1", "64FC1", "32SC3")
        for to in ("", "bgr8", "mono8", "rgb16", "yuv422", "nothing")
        for options in ((), (True,), (False, 10, 60000))],
    "labels": shown(cv_bridge.cvtColorForDisplay(
        np.arange(-3, 300, dtype=np.int32).reshape(3, 101), "32SC1", "bgr8")),
    "flat": shown(boost.cvtColorForDisplay(
        np.full((2, 3), 7.0, np.float32), "32FC1", "mono8", True)),
}
"""
)
_NEEDED = ("cv_bridge", "python3-cv-bridge")


def differences(found: object, expected: object, place: str = "") -> list[str]:
    """Return the places where two results differ."""
    if isinstance(expected, dict) and isinstance(found, dict) and expected.keys() == found.keys():
        return [
            one
            for key in expected
            for one in differences(found[key], expected[key], f"{place}/{key}")
        ]
    if isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        return [
            one
            for at, (ours, theirs) in enumerate(zip(found, expected, strict=True))
            for one in differences(ours, theirs, f"{place}/{at}")
        ]
    return [] if found == expected else [f"{place}: rosz {found}, real {expected}"]


@pytest.mark.ros1
def test_conversions_are_those_of_ros_1() -> None:
    expected = oracle.real(CONVERSIONS, *_NEEDED)
    assert differences(oracle.ours(CONVERSIONS), expected) == []


@pytest.mark.ros1
def test_messages_are_those_of_ros_1() -> None:
    expected = oracle.real(MESSAGES, *_NEEDED)
    assert differences(oracle.ours(MESSAGES), expected) == []


def test_a_missing_extra_is_an_import_error_that_names_it() -> None:
    program = """
import importlib.util, sys
sys.modules["cv2"] = None
import rosz.ros1
print(importlib.util.find_spec("cv_bridge") is not None)
for name in "cv_bridge", "cv_bridge.core", "image_geometry":
    try:
        __import__(name)
    except ImportError as error:
        print(error.name, str(error).rpartition("; ")[2])
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == [
        "True",
        "cv2 cv_bridge needs it, run: pip install 'rosz[vision]'",
        "cv2 cv_bridge needs it, run: pip install 'rosz[vision]'",
        "cv2 image_geometry needs it, run: pip install 'rosz[vision]'",
    ]


def test_a_row_may_end_with_padding() -> None:
    pytest.importorskip("cv2")
    from rosz.msgs.sensor_msgs.msg import Image
    from rosz.ros1.libraries.cv_bridge import CvBridge

    padded = Image(height=2, width=2, encoding="mono8", step=3, data=b"abcdef")
    assert CvBridge().imgmsg_to_cv2(padded).tobytes() == b"abde"


@pytest.mark.parametrize("form", ["nothing", "pbm"])
def test_what_a_format_does_not_hold_is_refused(form: str) -> None:
    np = pytest.importorskip("numpy")
    pytest.importorskip("cv2")
    from rosz.ros1.libraries.cv_bridge import CvBridge, CvBridgeError

    with pytest.raises(CvBridgeError, match=form):
        CvBridge().cv2_to_compressed_imgmsg(np.zeros((2, 2, 3), np.uint8), form)
