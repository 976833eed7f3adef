"""What the encodings of sensor_msgs/Image mean, and how OpenCV converts between them."""

from __future__ import annotations

import re
from functools import cache
from typing import NamedTuple

import cv2

from rosz.errors import MessageError

_COLORS = {"mono": 1, "rgb": 3, "bgr": 3, "rgba": 4, "bgra": 4}
# OpenCV names a Bayer pattern by the second row's second and third pixel.
_BAYER = {"bayer_rggb": "BG", "bayer_bggr": "RG", "bayer_gbrg": "GR", "bayer_grbg": "GB"}
_YUV = "yuv422"
_NAMED = re.compile(rf"({'|'.join((*_COLORS, *_BAYER))})(8|16)")
_GENERIC = re.compile(r"(8U|8S|16U|16S|32S|32F|64F)(?:C(\d+))?")


class ImageError(MessageError):
    """An image whose encoding does not exist, does not fit its data, or does not convert."""


class Encoding(NamedTuple):
    """The meaning of an encoding.

    Attributes:
        name: Its name, such as ``bgr8``.
        color: What its channels are: ``mono``, ``bgr``, ``bayer_rggb`` …; empty if it does not say.
        channels: Number of channels.
        bits: Bits of a channel.
    """

    name: str
    color: str
    channels: int
    bits: int


@cache
def parse_encoding(name: str) -> Encoding:
    """Return the meaning of an encoding.

    Raises:
        ImageError: The encoding does not exist.
    """
    if name == _YUV:
        return Encoding(name, name, 2, 8)
    named = _NAMED.fullmatch(name)
    if named is not None:
        return Encoding(name, named[1], _COLORS.get(named[1], 1), int(named[2]))
    generic = _GENERIC.fullmatch(name)
    if generic is None:
        raise ImageError(
            f"'{name}' is not an encoding; expected one such as 'bgr8', 'mono16', 'bayer_rggb8',"
            " 'yuv422' or '32FC1'"
        )
    return Encoding(name, "", int(generic[2] or 1), int(generic[1][:-1]))


@cache
def type_of(name: str) -> int:
    """Return the number that OpenCV has for images of an encoding, such as ``cv2.CV_8UC3``.

    Raises:
        ImageError: The encoding does not exist.
    """
    encoding = parse_encoding(name)
    generic = _GENERIC.fullmatch(name)
    depth = generic[1] if generic is not None else f"{encoding.bits}U"
    # CV_MAKETYPE is not in Python's OpenCV before 4.8.
    return int(getattr(cv2, f"CV_{depth}")) + ((encoding.channels - 1) << _SHIFT)


# Versions of OpenCV keep the depth in another number of bits.
_SHIFT = int(cv2.CV_8UC2).bit_length() - 1


def depth_of(number: int) -> tuple[int, int]:
    """Return depth and number of channels of OpenCV's number of a type."""
    return number & ((1 << _SHIFT) - 1), (number >> _SHIFT) + 1


@cache
def color_code(source: Encoding, target: Encoding) -> int | None:
    """Return OpenCV's code of a conversion; None if only the depth differs.

    Raises:
        ImageError: The conversion does not exist.
    """
    if not (source.color and target.color):
        if source.channels == target.channels and not (target.color and not source.color):
            return None
        suggestion = "'passthrough'" if source.color else f"'{source.name}'"
        raise ImageError(
            f"cannot convert '{source.name}' to '{target.name}': one of them does not say what its"
            f" channels are; read it as {suggestion} or use cv2.cvtColor"
        )
    if source.color == target.color and source.color not in _BAYER:
        return None
    to = target.color.replace("mono", "gray").upper()
    if source.color == _YUV:
        name = f"COLOR_YUV2{to}_UYVY"
    elif source.color in _BAYER:
        name = f"COLOR_Bayer{_BAYER[source.color]}2{to}"
    else:
        name = f"COLOR_{source.color.replace('mono', 'gray').upper()}2{to}"
    opaque = source.color in _BAYER and target.channels == _COLORS["rgba"]
    if opaque or target.color not in _COLORS or not hasattr(cv2, name):
        raise ImageError(
            f"there is no conversion of '{source.name}' to '{target.name}'; images convert to"
            " mono8, rgb8, bgr8, rgba8, bgra8 and the same with 16 bits"
        )
    return int(getattr(cv2, name))
