"""Images in bags as files: pictures, and videos. Needs the extra ``rosz[vision]``.

OpenCV writes the files.
"""

from __future__ import annotations

from array import array
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any, TypeAlias

import cv2
import msgspec
import numpy as np

from rosz.bags.bag import FileErrors
from rosz.errors import BagError, MessageError
from rosz.images import pixels
from rosz.message import Message

IMAGE_TYPES = ("sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/Image")

_Image: TypeAlias = Any
_NS = 1_000_000_000
_SLOWEST, _FASTEST = 0.01, 1000.0
_FORMATS = {"png": b"\x89PNG", "jpg": b"\xff\xd8"}


class ImageFiles:
    """Writes each image of a topic into a file: ``000012-1700000000.250000000.png``.

    PNG keeps 16 bits and alpha. Depths in metres (``32FC1``) become millimetres in 16 bits, as
    ``16UC1`` has them; other numbers are stretched to 8 bits.

    Args:
        folder: The folder of the topic; made if it is missing.
        form: ``png`` or ``jpg``.
        replace: Whether the folder may have files already.

    Attributes:
        count: Number of files.

    Raises:
        BagError: The folder has files already, or cannot be made.
    """

    def __init__(self, folder: Path, form: str, *, replace: bool = False) -> None:
        self._folder = folder
        self._form = form
        self.count = 0
        with FileErrors(folder, "cannot make the folder"):
            folder.mkdir(parents=True, exist_ok=True)
            taken = any(folder.iterdir())
        if taken and not replace:
            raise BagError("the folder has files already; -f writes among them", str(folder))

    def write(self, message: Any, stamp: int) -> None:
        """Write an image.

        Args:
            message: An Image or a CompressedImage.
            stamp: When it was received; the name has the stamp of its header, if it has one.

        Raises:
            MessageError: The message is not an image, or such a file cannot hold it.
            BagError: The file cannot be written.
        """
        seconds, rest = divmod(message.header.stamp.to_nsec() or stamp, _NS)
        file = self._folder / f"{self.count:06d}-{seconds}.{rest:09d}.{self._form}"
        data = self._encode(message)
        with FileErrors(file):
            file.write_bytes(data)
        self.count += 1

    def _encode(self, message: Any) -> bytes:
        compressed = message._type_name == IMAGE_TYPES[0]
        if compressed and message.data[:4].startswith(_FORMATS[self._form]):
            return bytes(message.data)  # as the camera made it
        image = pixels(message, deep=self._form == "png")
        written, data = cv2.imencode(f".{self._form}", image)
        if not written:
            raise MessageError(f"an image of shape {image.shape} does not fit {self._form}")
        encoded: bytes = data.tobytes()
        return encoded


class VideoTimes(msgspec.Struct):
    """When the frames of a video were taken.

    Attributes:
        taken: Stamps of the headers.
        received: Stamps in the bag.
    """

    taken: array[int] = msgspec.field(default_factory=lambda: array("q"))
    received: array[int] = msgspec.field(default_factory=lambda: array("q"))

    def add(self, message: Any, stamp: int) -> None:
        """Add a frame."""
        self.taken.append(message.header.stamp.to_nsec())
        self.received.append(stamp)

    @property
    def stamps(self) -> array[int]:
        """The stamps of the headers, or those in the bag where these do not grow."""
        grows = all(a < b for a, b in pairwise(self.taken))
        return self.taken if grows else self.received

    @property
    def rate(self) -> float:
        """Frames per second, by the median of the times between two."""
        stamps = self.stamps
        gaps = [b - a for a, b in pairwise(stamps)]
        gap = median(gaps) if gaps else _NS
        return round(min(max(_NS / max(gap, 1), _SLOWEST), _FASTEST), 3)


class Video:
    """Writes the images of a topic as MP4.

    Videos have one rate. A frame is repeated until the next one is due, and left out where another
    one has its time, so that the video is as long as the recording.

    Args:
        file: Path of the video.
        times: Times of all frames.
        rate: Frames per second; that of the times when not given.
        replace: Whether a file that exists is replaced; otherwise it is an error.

    Attributes:
        rate: Frames per second.
        count: Number of frames in the video.
        repeated: Number of frames that repeat the one before.
        dropped: Number of images that are left out.

    Raises:
        BagError: The file exists, or cannot be written.
    """

    def __init__(
        self, file: Path, times: VideoTimes, rate: float | None = None, *, replace: bool = False
    ) -> None:
        self._file = file
        self._stamps = times.stamps
        self._next = 0
        self._writer: Any = None
        self._size = 0, 0
        self._last: _Image = None
        self.rate: float = rate or times.rate
        self.count = self.repeated = self.dropped = 0
        if file.exists() and not replace:
            raise BagError("it exists already; -f replaces it", str(file))
        with FileErrors(file):
            file.parent.mkdir(parents=True, exist_ok=True)
            file.open("wb").close()

    def write(self, message: Message) -> None:
        """Write the next image.

        Raises:
            MessageError: The message is not an image, or its size is not that of the first one.
            BagError: The video cannot be written.
        """
        stamp = self._stamps[self._next]
        self._next += 1
        image = np.ascontiguousarray(pixels(message, deep=False))
        if image.ndim == 2 or image.shape[2] == 1:  # noqa: PLR2004  # rows and columns
            image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
        size = image.shape[1], image.shape[0]
        if self._writer is None:
            self._open(size)
        if size != self._size:
            raise MessageError(
                f"an image of {size[0]} x {size[1]} pixels does not fit a video of"
                f" {self._size[0]} x {self._size[1]}"
            )
        place = round((stamp - self._stamps[0]) * self.rate / _NS)
        if place < self.count:
            self.dropped += 1
            return
        while self.count < place and self._last is not None:
            self._writer.write(self._last)
            self.count += 1
            self.repeated += 1
        self._writer.write(image)
        self._last = image
        self.count += 1

    def _open(self, size: tuple[int, int]) -> None:
        code = cv2.VideoWriter.fourcc(*"mp4v")
        self._writer = cv2.VideoWriter(str(self._file), code, self.rate, size)
        self._size = size
        if not self._writer.isOpened():
            raise BagError(f"OpenCV cannot write a video of {size[0]} x {size[1]}", str(self._file))

    def close(self) -> None:
        """Finish the video."""
        if self._writer is not None:
            self._writer.release()
