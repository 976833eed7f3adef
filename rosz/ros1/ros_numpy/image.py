"""ros_numpy.image: Image as an array of rows, columns and channels."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from rosz.msgs.sensor_msgs.msg import Image
from rosz.ros1.ros_numpy.registry import converts_from_numpy, converts_to_numpy

__all__ = ("image_to_numpy", "name_to_dtypes", "numpy_to_image")

_KINDS = {
    "8U": np.uint8,
    "8S": np.int8,
    "16U": np.uint16,
    "16S": np.int16,
    "32S": np.int32,
    "32F": np.float32,
    "64F": np.float64,
}
_CHANNELS = {"rgb": 3, "rgba": 4, "bgr": 3, "bgra": 4, "mono": 1}
_PATTERNS = ("rggb", "bggr", "gbrg", "grbg")

name_to_dtypes: dict[str, tuple[type[Any], int]] = {
    **{f"{name}8": (np.uint8, count) for name, count in _CHANNELS.items()},
    **{f"{name}16": (np.uint16, count) for name, count in _CHANNELS.items()},
    **{f"bayer_{pattern}8": (np.uint8, 1) for pattern in _PATTERNS},
    **{f"bayer_{pattern}16": (np.uint16, 1) for pattern in _PATTERNS},
    **{f"{name}C{count}": (kind, count) for name, kind in _KINDS.items() for count in range(1, 5)},
}
"""Type of the values and number of channels of each encoding."""


@converts_to_numpy(Image)
def image_to_numpy(msg: Image) -> Any:
    """Return a copy of the pixels; an image of one channel has two dimensions.

    Raises:
        TypeError: The encoding is unknown.
    """
    kind, channels = _kind(msg.encoding)
    dtype = np.dtype(kind).newbyteorder(">" if msg.is_bigendian else "<")
    pixel = channels * dtype.itemsize
    strides = (msg.step or msg.width * pixel, pixel, dtype.itemsize)
    data: Any = msg.data
    array = np.ndarray((msg.height, msg.width, channels), dtype, data, strides=strides).copy()
    return array[..., 0] if channels == 1 else array


@converts_from_numpy(Image)
def numpy_to_image(arr: Any, encoding: str) -> Image:
    """Return the message of an array of pixels.

    Raises:
        TypeError: The encoding is unknown, or the array is none of it.
    """
    kind, expected = _kind(encoding)
    if arr.ndim not in {2, 3}:
        raise TypeError(f"expected rows, columns and channels, got an array of shape {arr.shape}")
    height, width, channels = (*arr.shape, 1)[:3]
    if (channels, arr.dtype.type) != (expected, kind):
        raise TypeError(
            f"an image of encoding '{encoding}' has {expected} channels of {kind.__name__}, got"
            f" {channels} of {arr.dtype.name}"
        )
    order = arr.dtype.byteorder
    return Image(
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=int(order == ">" or (order == "=" and sys.byteorder == "big")),
        step=width * channels * arr.dtype.itemsize,
        data=arr.tobytes(),
    )


def _kind(encoding: str) -> tuple[type[Any], int]:
    if encoding not in name_to_dtypes:
        raise TypeError(f"unknown encoding '{encoding}'; expected {', '.join(name_to_dtypes)}")
    return name_to_dtypes[encoding]
