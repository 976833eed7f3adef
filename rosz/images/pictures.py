"""Images as pictures: in shades or colours that files and screens have."""

from __future__ import annotations

import struct
from typing import Any

import cv2
import numpy as np

from rosz.errors import MessageError
from rosz.images.arrays import ImageArray, image_array
from rosz.images.encodings import ImageError, parse_encoding

_DEPTH_HEADER = struct.Struct("<iff")
"""The header of image_transport's compressedDepth, before the PNG: a format and two numbers."""
_MILLIMETRES = 1000.0
_ALPHA = 4
_DEEP_BITS = 16
_DRAWN = frozenset({1, 3, 4})


def pixels(message: Any, *, deep: bool) -> ImageArray:
    """Return an image as OpenCV writes it: grey, or blue, green, red and maybe alpha.

    Args:
        message: An Image or a CompressedImage.
        deep: Whether it may have 16 bits and alpha; else it has 8 bits and no alpha.

    Raises:
        MessageError: The message is not an image, or files cannot hold its number of channels.
    """
    try:
        image = _decompressed(message) if hasattr(message, "format") else _raw(message, deep=deep)
    except (ImageError, cv2.error) as error:
        raise MessageError(f"the message is not an image: {error}") from error
    channels = 1 if image.ndim == 2 else image.shape[2]  # noqa: PLR2004  # rows and columns
    if channels not in _DRAWN or not image.size:
        raise MessageError(f"an image of shape {image.shape} cannot be a picture")
    if deep and image.dtype.kind == "f":
        image = _millimetres(image)
    elif image.dtype != np.uint8 and not (deep and image.dtype == np.uint16):
        image = _stretched(image)
    return image[..., :3] if channels == _ALPHA and not deep else image


def _raw(message: Any, *, deep: bool) -> ImageArray:
    """Return the array of an Image, in an encoding that files have."""
    encoding = parse_encoding(message.encoding)
    if not encoding.color:
        return image_array(message)
    color = "mono" if encoding.color == "mono" else "bgr"
    if deep and encoding.channels == _ALPHA:
        color = "bgra"
    bits = _DEEP_BITS if deep and encoding.bits == _DEEP_BITS else 8
    return image_array(message, f"{color}{bits}")


def _decompressed(message: Any) -> ImageArray:
    data, depth = bytes(message.data), "compressedDepth" in message.format
    if depth:
        data = data[_DEPTH_HEADER.size :]
    packed = np.frombuffer(data, np.uint8)
    image = cv2.imdecode(packed, cv2.IMREAD_UNCHANGED) if data else None
    if image is None:
        raise MessageError(f"OpenCV cannot read its data of format '{message.format}'")
    if depth and message.format.startswith("32FC1"):
        _, first, second = _DEPTH_HEADER.unpack_from(bytes(message.data))
        with np.errstate(divide="ignore"):
            image = np.where(image == 0, np.nan, first / (image.astype(np.float32) - second))
    return image


def _millimetres(image: ImageArray) -> ImageArray:
    """Return depths in metres as whole millimetres; 0 where there is none."""
    with np.errstate(invalid="ignore"):
        scaled = np.nan_to_num(image * _MILLIMETRES, nan=0.0, posinf=0.0, neginf=0.0)
    return np.clip(np.rint(scaled), 0, np.iinfo(np.uint16).max).astype(np.uint16)


def _stretched(image: ImageArray) -> ImageArray:
    """Return an image with its smallest number as black and its largest one as white."""
    values = image.astype(np.float64)
    sound = values[np.isfinite(values)]
    if not sound.size:
        return np.zeros(image.shape, np.uint8)
    low, high = sound.min(), sound.max()
    with np.errstate(all="ignore"):  # of infinite values
        scaled = (values - low) * (255.0 / (high - low) if high > low else 0.0)
    return np.nan_to_num(scaled, nan=0.0, posinf=255.0, neginf=0.0).astype(np.uint8)
