"""cv_bridge.core: `CvBridge`."""

from __future__ import annotations

import sys
from typing import Any, TypeAlias

import cv2
import numpy as np

from rosz.msgs.sensor_msgs.msg import CompressedImage
from rosz.msgs.sensor_msgs.msg import Image as ImageMessage
from rosz.ros1.cv_bridge.boost.cv_bridge_boost import cvtColor2, getCvType
from rosz.ros1.cv_bridge.encodings import depth_of

__all__ = ("CvBridge", "CvBridgeError")

Image: TypeAlias = Any
"""An array of numpy: rows, columns and, if it has more than one, channels."""

_NAMES = {
    "uint8": "8U",
    "int8": "8S",
    "uint16": "16U",
    "int16": "16S",
    "int32": "32S",
    "float32": "32F",
    "float64": "64F",
}
_FLAT = 2


class CvBridgeError(TypeError):
    """An image does not convert."""


class CvBridge:
    """Converts images of ROS to arrays that OpenCV takes, and back.

    Attributes:
        cvtype_to_name: The generic encodings, such as ``8UC3``, by OpenCV's number of the type.
        cvdepth_to_numpy_depth: numpy's names of types by OpenCV's numbers of depths.
        numpy_type_to_cvtype: OpenCV's names of depths by numpy's names of types, and the reverse.
    """

    def __init__(self) -> None:
        self.cvtype_to_name = {
            getCvType(f"{depth}C{count}"): f"{depth}C{count}"
            for depth in _NAMES.values()
            for count in (1, 2, 3, 4)
        }
        self.cvdepth_to_numpy_depth = {
            int(getattr(cv2, f"CV_{depth}")): name for name, depth in _NAMES.items()
        }
        self.numpy_type_to_cvtype = _NAMES | {depth: name for name, depth in _NAMES.items()}

    def dtype_with_channels_to_cvtype2(self, dtype: Any, n_channels: int) -> str:
        """Return the generic encoding of a type of numpy and a number of channels.

        Raises:
            CvBridgeError: OpenCV has no images of that type.
        """
        name = self.numpy_type_to_cvtype.get(dtype.name)
        if name is None:
            expected = ", ".join(_NAMES)
            raise CvBridgeError(f"an image cannot have type {dtype.name}; expected {expected}")
        return f"{name}C{n_channels}"

    def cvtype2_to_dtype_with_channels(self, cvtype: int) -> tuple[str, int]:
        """Return numpy's name of the type and the number of channels of OpenCV's type."""
        depth, channels = depth_of(cvtype)
        return self.cvdepth_to_numpy_depth[depth], channels

    def encoding_to_cvtype2(self, encoding: str) -> int:
        """Return OpenCV's number of the type of an encoding.

        Raises:
            CvBridgeError: The encoding does not exist.
        """
        try:
            return getCvType(encoding)
        except RuntimeError as error:
            raise CvBridgeError(str(error)) from error

    def encoding_to_dtype_with_channels(self, encoding: str) -> tuple[str, int]:
        """Return numpy's name of the type and the number of channels of an encoding.

        Raises:
            CvBridgeError: The encoding does not exist.
        """
        return self.cvtype2_to_dtype_with_channels(self.encoding_to_cvtype2(encoding))

    def imgmsg_to_cv2(self, img_msg: Any, desired_encoding: str = "passthrough") -> Image:
        """Return the array of an Image.

        With ``passthrough``, or in its own encoding and byte order, it shares the memory of the
        message where it can, and then is read-only.

        Args:
            img_msg: The message.
            desired_encoding: Encoding of the array; that of the message when ``passthrough``.

        Raises:
            CvBridgeError: The encoding or conversion does not exist, or the data are too few.
        """
        name, channels = self.encoding_to_dtype_with_channels(img_msg.encoding)
        kind = np.dtype(name).newbyteorder(">" if img_msg.is_bigendian else "<")
        image = _array(img_msg, kind, channels)
        if bool(img_msg.is_bigendian) == (sys.byteorder == "little"):
            image = image.astype(kind.newbyteorder("="))
        return _encoded(image, img_msg.encoding, desired_encoding)

    def cv2_to_imgmsg(
        self, cvim: Image, encoding: str = "passthrough", header: Any = None
    ) -> ImageMessage:
        """Return an array as an Image.

        Args:
            cvim: The array.
            encoding: Its encoding; the generic one of its type, such as ``8UC3``, when
                ``passthrough``.
            header: Header of the message.

        Raises:
            TypeError: The argument is not an array.
            CvBridgeError: The array is none of the encoding.
        """
        _check(cvim)
        channels = 1 if cvim.ndim <= _FLAT else cvim.shape[_FLAT]
        generic = self.dtype_with_channels_to_cvtype2(cvim.dtype, channels)
        if encoding != "passthrough":
            expected = self.cvtype_to_name.get(self.encoding_to_cvtype2(encoding))
            if expected != generic:
                raise CvBridgeError(
                    f"an image of encoding '{encoding}' is of type {expected}, got {generic}"
                )
        message = ImageMessage()
        if header is not None:
            message.header = header
        message.height, message.width = cvim.shape[:2]
        message.encoding = generic if encoding == "passthrough" else encoding
        message.is_bigendian = int(cvim.dtype.byteorder == ">")
        message.data = cvim.tobytes()
        message.step = len(message.data) // message.height if message.height else 0
        return message

    def compressed_imgmsg_to_cv2(
        self, cmprs_img_msg: Any, desired_encoding: str = "passthrough"
    ) -> Image:
        """Return the array of a CompressedImage; None if OpenCV cannot read the data.

        Args:
            cmprs_img_msg: The message.
            desired_encoding: Encoding of the array. ``passthrough`` gives what the data hold;
                another one is made of them as if they were ``bgr8``.

        Raises:
            CvBridgeError: The conversion does not exist.
        """
        data = np.frombuffer(cmprs_img_msg.data, np.uint8)
        image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
        return None if image is None else _encoded(image, "bgr8", desired_encoding)

    def cv2_to_compressed_imgmsg(self, cvim: Image, dst_format: str = "jpg") -> CompressedImage:
        """Return an array as a CompressedImage.

        Args:
            cvim: The array; OpenCV takes three channels as blue, green and red.
            dst_format: Format of the data, such as ``jpg`` or ``png``, and of the message.

        Raises:
            TypeError: The argument is not an array.
            CvBridgeError: OpenCV does not write such an array in that format.
        """
        _check(cvim)
        try:
            written, data = cv2.imencode(f".{dst_format}", cvim)
        except cv2.error as error:
            raise CvBridgeError(f"cannot write format '{dst_format}': {error}") from error
        if not written:
            raise CvBridgeError(
                f"format '{dst_format}' does not hold an image of shape {cvim.shape} and type"
                f" {cvim.dtype}"
            )
        return CompressedImage(format=dst_format, data=data.tobytes())


def _check(image: Any) -> None:
    if not isinstance(image, np.ndarray | np.generic):
        raise TypeError(f"expected an array of numpy, got {type(image).__name__}")


def _array(message: Any, kind: np.dtype[Any], channels: int) -> Image:
    """Return the data of a message as an array, without a copy."""
    data = message.data.encode() if isinstance(message.data, str) else message.data
    shape = (message.height, message.width, channels)[: _FLAT if channels == 1 else None]
    row = message.width * channels * kind.itemsize
    # Many programs leave the step at 0, and some set a wrong one.
    padded = message.step > row and len(data) >= message.step * (message.height - 1) + row
    strides = (message.step, channels * kind.itemsize, kind.itemsize)[: len(shape)]
    try:
        return np.ndarray(shape, kind, data, strides=strides if padded else None)
    except TypeError as error:
        raise CvBridgeError(
            f"an image of {message.height} rows of {row} bytes ({message.width} pixels of"
            f" '{message.encoding}') has {len(data)} bytes: {error}"
        ) from error


def _encoded(image: Image, encoding: str, desired: str) -> Image:
    if desired == "passthrough":
        return image
    try:
        return cvtColor2(image, encoding, desired)
    except RuntimeError as error:
        raise CvBridgeError(str(error)) from error
