"""Images as arrays of numpy: rows, columns and, if an image has more than one, channels."""

from __future__ import annotations

import sys
from typing import Any, TypeAlias

import cv2
import numpy as np

from rosz.images import encodings

ImageArray: TypeAlias = Any
"""An array of numpy."""

_DTYPES = {
    cv2.CV_8U: np.uint8,
    cv2.CV_8S: np.int8,
    cv2.CV_16U: np.uint16,
    cv2.CV_16S: np.int16,
    cv2.CV_32S: np.int32,
    cv2.CV_32F: np.float32,
    cv2.CV_64F: np.float64,
}
_FLAT = 2
_WIDEN = 65535 // 255


def image_array(message: Any, encoding: str = "passthrough") -> ImageArray:
    """Return the array of an Image.

    With ``passthrough``, or in its own encoding and byte order, it shares the memory of the
    message where it can, and then is read-only.

    Args:
        message: The message.
        encoding: Encoding of the array; that of the message when ``passthrough``.

    Raises:
        ImageError: The encoding or conversion does not exist, or the data are too few.
    """
    depth, channels = encodings.depth_of(encodings.type_of(message.encoding))
    dtype = np.dtype(_DTYPES[depth]).newbyteorder(">" if message.is_bigendian else "<")
    image = _data_array(message, dtype, channels)
    if bool(message.is_bigendian) == (sys.byteorder == "little"):
        image = image.astype(dtype.newbyteorder("="))
    return image if encoding == "passthrough" else convert(image, message.encoding, encoding)


def _data_array(message: Any, dtype: np.dtype[Any], channels: int) -> ImageArray:
    """Return the data of a message as an array, without a copy."""
    data = message.data.encode() if isinstance(message.data, str) else message.data
    shape = (message.height, message.width, channels)[: _FLAT if channels == 1 else None]
    row = message.width * channels * dtype.itemsize
    # Many programs leave the step at 0, and some set a wrong one.
    padded = message.step > row and len(data) >= message.step * (message.height - 1) + row
    strides = (message.step, channels * dtype.itemsize, dtype.itemsize)[: len(shape)]
    try:
        return np.ndarray(shape, dtype, data, strides=strides if padded else None)
    except TypeError as error:
        raise encodings.ImageError(
            f"an image of {message.height} rows of {row} bytes ({message.width} pixels of"
            f" '{message.encoding}') has {len(data)} bytes: {error}"
        ) from error


def convert(source: ImageArray, encoding: str, target: str) -> ImageArray:
    """Return a copy of an image in another encoding.

    Values of 8 bits become values of 16 by a factor of 257, and the reverse. Other values that the
    new encoding cannot hold become its lowest or highest.

    Args:
        source: The image.
        encoding: Its encoding.
        target: The new one; the same one when empty.

    Raises:
        ImageError: The encoding or conversion does not exist, or does not fit the image.
    """
    image = np.asarray(source)
    if target in {"", encoding}:
        return without_channel(image).copy()
    before, after = encodings.parse_encoding(encoding), encodings.parse_encoding(target)
    code = encodings.color_code(before, after)
    if code is None:
        return _deepened(without_channel(image), before, after).copy()
    try:
        image = cv2.cvtColor(image, code)
    except cv2.error as error:
        raise encodings.ImageError(
            f"an image of shape {image.shape} and type {image.dtype} does not convert from"
            f" '{encoding}' to '{target}': {error}"
        ) from error
    return image if before.bits == after.bits else _deepened(image, before, after)


def without_channel(image: ImageArray) -> ImageArray:
    """Return an image without the axis of its only channel."""
    return image[..., 0] if image.ndim == 3 and image.shape[2] == 1 else image  # noqa: PLR2004


def _deepened(
    image: ImageArray, before: encodings.Encoding, after: encodings.Encoding
) -> ImageArray:
    """Return an image with the depth of another encoding."""
    kind: Any = _DTYPES[encodings.depth_of(encodings.type_of(after.name))[0]]
    bits = before.bits, after.bits
    if bits == (8, 16):
        if image.dtype == np.uint8 and kind is np.uint16:
            return np.multiply(image, _WIDEN, dtype=np.uint16)
        return saturated(image.astype(np.float64) * _WIDEN, kind)
    if bits == (16, 8):
        if image.dtype == np.uint16 and kind is np.uint8:
            return cv2.convertScaleAbs(image, alpha=1 / _WIDEN)
        return saturated(image.astype(np.float64) / _WIDEN, kind)
    return saturated(image, kind)


def saturated(image: ImageArray, kind: Any) -> ImageArray:
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
