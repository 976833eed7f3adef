"""cv_bridge.boost.cv_bridge_boost: conversions between encodings, which ROS 1 has in C++.

An image is an array of numpy with rows, columns and, if it has more than one, channels.
"""

# ruff: noqa: N802  # ROS 1's names

from __future__ import annotations

from functools import cache
from typing import Any, TypeAlias

import cv2
import numpy as np

from rosz.ros1.cv_bridge.encodings import Encoding, color_code, depth_of, parse, type_of

__all__ = (
    "CV_MAT_CNWrap",
    "CV_MAT_DEPTHWrap",
    "cvtColor2",
    "cvtColorForDisplay",
    "getCvType",
)

Image: TypeAlias = Any
"""An array of numpy."""

_TYPES = {
    cv2.CV_8U: np.uint8,
    cv2.CV_8S: np.int8,
    cv2.CV_16U: np.uint16,
    cv2.CV_16S: np.int16,
    cv2.CV_32S: np.int32,
    cv2.CV_32F: np.float32,
    cv2.CV_64F: np.float64,
}
_LABELS = "32SC1"
_DISPLAY = "bgr8"
_GRAY = 127.5
_WIDEN = 65535 // 255


def getCvType(encoding: str) -> int:
    """Return OpenCV's number of the type of images of an encoding, such as ``cv2.CV_8UC3``.

    Raises:
        RuntimeError: The encoding does not exist.
    """
    return type_of(encoding)


def CV_MAT_CNWrap(i: int) -> int:
    """Return the number of channels of one of OpenCV's types."""
    return depth_of(i)[1]


def CV_MAT_DEPTHWrap(i: int) -> int:
    """Return the depth of one of OpenCV's types, such as ``cv2.CV_8U``."""
    return depth_of(i)[0]


def cvtColor2(source: Image, encoding_in: str, encoding_out: str) -> Image:
    """Return a copy of an image in another encoding.

    Values of 8 bits become values of 16 by a factor of 257, and the reverse. Other values that the
    new encoding cannot hold become its lowest or highest.

    Args:
        source: The image.
        encoding_in: Its encoding.
        encoding_out: The new one; the same one when empty.

    Raises:
        RuntimeError: The encoding or conversion does not exist, or does not fit the image.
    """
    image = np.asarray(source)
    if encoding_out in {"", encoding_in}:
        return _squeezed(image).copy()
    before, after = parse(encoding_in), parse(encoding_out)
    code = color_code(before, after)
    if code is None:
        return _converted(_squeezed(image), before, after).copy()
    try:
        image = cv2.cvtColor(image, code)
    except cv2.error as error:
        raise RuntimeError(
            f"an image of shape {image.shape} and type {image.dtype} does not convert from"
            f" '{encoding_in}' to '{encoding_out}': {error}"
        ) from error
    return image if before.bits == after.bits else _converted(image, before, after)


def cvtColorForDisplay(
    source: Image,
    encoding_in: str,
    encoding_out: str,
    do_dynamic_scaling: bool = False,
    min_image_value: float = 0.0,
    max_image_value: float = 0.0,
) -> Image:
    """Return an image of 8 bits that people can look at.

    Labels (``32SC1``) get a colour each. Other images of one channel are scaled if the range is
    given or found; without one they are converted as by `cvtColor2`.

    Args:
        source: The image.
        encoding_in: Its encoding.
        encoding_out: ``bgr8`` or another encoding with colours or shades of 8 bits; ``bgr8`` when
            empty.
        do_dynamic_scaling: Whether to take the range from the image.
        min_image_value: Value that becomes black; no scaling when it is equal to the other one.
        max_image_value: Value that becomes white.

    Raises:
        RuntimeError: The encodings do not serve for that.
    """
    image = _squeezed(np.asarray(source))
    before = parse(encoding_in)
    after = _for_display(before, encoding_out)
    if after.name == _DISPLAY and before.name == _LABELS:
        return np.where(image[..., None] >= 0, _palette()[image % len(_palette())], np.uint8(0))
    low, high = min_image_value, max_image_value
    if do_dynamic_scaling:
        low, high = float(np.nanmin(image)), float(np.nanmax(image))
        if low == high:
            return np.full((*image.shape[:2], 3), np.rint(_GRAY), np.uint8)
    if low != high:
        if before.channels != 1:
            raise RuntimeError(f"cannot scale '{encoding_in}': it has {before.channels} channels")
        return cvtColor2(_scaled(image, low, high), "mono8", after.name)
    return cvtColor2(image, "mono16" if encoding_in == "16UC1" else encoding_in, after.name)


def _scaled(image: Image, low: float, high: float) -> Image:
    with np.errstate(invalid="ignore"):  # infinite values
        shifted = image.astype(np.float64) - low
        if image.dtype.kind != "f":
            shifted = _rounded(shifted, image.dtype.type).astype(np.float64)
        return _rounded(shifted * (255.0 / (high - low)), np.uint8)


def _for_display(before: Encoding, wanted: str) -> Encoding:
    if wanted:
        after = parse(wanted)
        if after.bits != 8 or not after.color or after.color.startswith(("bayer", "yuv")):  # noqa: PLR2004
            raise RuntimeError(f"'{wanted}' is not for display; expected colours or mono of 8 bits")
        return after
    if before.bits > (32 if before.channels == 1 else 16):
        raise RuntimeError(f"no encoding for display goes with '{before.name}'; name one")
    return parse(_DISPLAY)


def _squeezed(image: Image) -> Image:
    """Return an image without the axis of its only channel."""
    return image[..., 0] if image.ndim == 3 and image.shape[2] == 1 else image  # noqa: PLR2004


def _converted(image: Image, before: Encoding, after: Encoding) -> Image:
    """Return an image with the depth of another encoding."""
    kind: Any = _TYPES[depth_of(type_of(after.name))[0]]
    bits = before.bits, after.bits
    if bits == (8, 16):
        if image.dtype == np.uint8 and kind is np.uint16:
            return np.multiply(image, _WIDEN, dtype=np.uint16)
        return _rounded(image.astype(np.float64) * _WIDEN, kind)
    if bits == (16, 8):
        if image.dtype == np.uint16 and kind is np.uint8:
            return cv2.convertScaleAbs(image, alpha=1 / _WIDEN)
        return _rounded(image.astype(np.float64) / _WIDEN, kind)
    return _rounded(image, kind)


def _rounded(image: Image, kind: Any) -> Image:
    """Return values of another type as OpenCV converts them."""
    if image.dtype == kind or np.dtype(kind).kind == "f":
        with np.errstate(over="ignore"):
            return image.astype(kind, copy=False)
    values, ints = image.astype(np.float64), np.iinfo(np.int32)
    if image.dtype.kind == "f":
        values = np.rint(values)
        # The processor's conversion to 32 bits gives the lowest number for all that do not fit.
        values[~((values >= ints.min) & (values <= ints.max))] = ints.min
    limits = np.iinfo(kind)
    return np.clip(values, limits.min, limits.max).astype(kind)


@cache
def _palette() -> Image:
    """Return the colours of labels: those of CSS by name, with three digits as ROS 1 has them."""
    channels = np.frombuffer(bytes.fromhex(_CSS), np.uint8).reshape(-1, 3)
    return channels[:, ::-1]


_CSS = (
    "eff8ff f9ebd6 00ffff 7effd3 efffff f5f5dc ffe3c4 000000 ffebcd 0000ff 892be1 a42a2a "
    "deb886 5f9e9f 7eff00 d2691e ff7e50 6394ec fff8dc dc133b 00ffff 00008a 008a8a b8850a "
    "a9a9a9 006300 a9a9a9 bcb76b 8a008a 546b2e ff8b00 9931cc 8a0000 e99579 8fbb8f 473c8a "
    "2e4f4f 2e4f4f 00ced1 9300d2 ff1392 00beff 696969 696969 1e90ff b12121 fff9ef 218a21 "
    "ff00ff dcdcdc f8f8ff ffd600 daa41f 808080 008000 acff2e 808080 efffef ff69b4 cd5c5c "
    "4a0082 ffffef efe68b e6e6f9 ffeff5 7bfb00 fff9cd acd7e6 ef8080 dfffff f9f9d2 d2d2d2 "
    "90ed90 d2d2d2 ffb6c1 ff9f79 1fb1aa 86cef9 778799 778799 afc4de ffffdf 00ff00 31cd31 "
    "f9efe6 ff00ff 800000 66cdaa 0000cd b954d2 926fdb 3bb370 7a68ed 00f99a 47d1cc c61585 "
    "18186f f5fff9 ffe3e0 ffe3b5 ffdeac 000080 fcf5e6 808000 6b8e22 ffa400 ff4500 da6fd5 "
    "ede8aa 97fa97 aeeded ffeed4 ffdab8 cd853e ffc0ca dd9fdd afdfe6 800080 ff0000 bb8f8f "
    "4169e0 8a4512 f98071 f9a35f 2d8a56 fff5ed 9f522c c0c0c0 86ceeb 6a5acd 6f8090 6f8090 "
    "fff9f9 00ff7e 4682b4 d2b48b 008080 d7bed7 ff6246 40dfd0 ed82ed f5deb3 ffffff f5f5f5 "
    "ffff00 9acd31 "
)
