"""cv_bridge: images of ROS as arrays that OpenCV takes, and back (ROS wiki, cv_bridge).

Needs the extra ``rosz[vision]``. May import message classes, numpy and OpenCV.
"""

# ruff: noqa: N802  # ROS 1's names

from __future__ import annotations

from functools import cache
from typing import Any, TypeAlias

import cv2
import numpy as np

from rosz import images
from rosz.msgs.sensor_msgs.msg import CompressedImage
from rosz.msgs.sensor_msgs.msg import Image as ImageMessage
from rosz.ros1.exceptions import raised_as

__all__ = ("CvBridge", "CvBridgeError", "cvtColorForDisplay", "getCvType")

Image: TypeAlias = Any
"""An array of numpy: rows, columns and, if it has more than one, channels."""

_LABELS = "32SC1"
_DISPLAY = "bgr8"
_GRAY = 127.5
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


@raised_as(RuntimeError, images.ImageError)
def getCvType(encoding: str) -> int:
    """Return OpenCV's number of the type of images of an encoding, such as ``cv2.CV_8UC3``.

    Raises:
        RuntimeError: The encoding does not exist.
    """
    return images.type_of(encoding)


def CV_MAT_CNWrap(i: int) -> int:
    """Return the number of channels of one of OpenCV's types."""
    return images.depth_of(i)[1]


def CV_MAT_DEPTHWrap(i: int) -> int:
    """Return the depth of one of OpenCV's types, such as ``cv2.CV_8U``."""
    return images.depth_of(i)[0]


@raised_as(RuntimeError, images.ImageError)
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
    return images.convert(source, encoding_in, encoding_out)


@raised_as(RuntimeError, images.ImageError)
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
    image = images.without_channel(np.asarray(source))
    before = images.parse_encoding(encoding_in)
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
            shifted = images.saturated(shifted, image.dtype.type).astype(np.float64)
        return images.saturated(shifted * (255.0 / (high - low)), np.uint8)


def _for_display(before: images.Encoding, wanted: str) -> images.Encoding:
    if wanted:
        after = images.parse_encoding(wanted)
        if after.bits != 8 or not after.color or after.color.startswith(("bayer", "yuv")):  # noqa: PLR2004
            raise RuntimeError(f"'{wanted}' is not for display; expected colours or mono of 8 bits")
        return after
    if before.bits > (32 if before.channels == 1 else 16):
        raise RuntimeError(f"no encoding for display goes with '{before.name}'; name one")
    return images.parse_encoding(_DISPLAY)


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
        depth, channels = images.depth_of(cvtype)
        return self.cvdepth_to_numpy_depth[depth], channels

    def encoding_to_cvtype2(self, encoding: str) -> int:
        """Return OpenCV's number of the type of an encoding.

        Raises:
            CvBridgeError: The encoding does not exist.
        """
        with raised_as(CvBridgeError, images.ImageError):
            return images.type_of(encoding)

    def encoding_to_dtype_with_channels(self, encoding: str) -> tuple[str, int]:
        """Return numpy's name of the type and the channels; see `encoding_to_cvtype2`."""
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
        with raised_as(CvBridgeError, images.ImageError):
            return images.image_array(img_msg, desired_encoding)

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
        if image is None or desired_encoding == "passthrough":
            return image
        with raised_as(CvBridgeError, images.ImageError):
            return images.convert(image, "bgr8", desired_encoding)

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
