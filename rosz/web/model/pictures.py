"""Images of a topic as pictures that a browser shows, each made when the browser asks for it."""

from __future__ import annotations

import importlib.util
import secrets
import threading
from collections.abc import Callable
from typing import Any

from rosz.errors import MessageError, UsageError
from rosz.introspect import Survey
from rosz.names import short_type
from rosz.node import Node
from rosz.web.model.topic import TopicWatch

IMAGE_TYPES = frozenset({"sensor_msgs/Image", "sensor_msgs/CompressedImage"})
_LIBRARY = "pictures need libraries: pip install 'rosz[vision]'"

Source = Callable[[], tuple[bytes, str]]
"""Function that returns a picture and its media type."""


class PictureSources:
    """The sources of the pictures that pages show, by secret keys."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sources: dict[str, Source] = {}

    def add(self, source: Source) -> str:
        """Return the key of a new source."""
        key = secrets.token_urlsafe(12)
        with self._lock:
            self._sources[key] = source
        return key

    def remove(self, key: str) -> None:
        """Forget a source."""
        with self._lock:
            self._sources.pop(key, None)

    def take(self, key: str) -> tuple[bytes, str] | None:
        """Return the newest picture of a source; None if there is no such source.

        Raises:
            RoszError: The picture cannot be made.
        """
        source = self._sources.get(key)
        return None if source is None else source()


class ImageWatch(TopicWatch):
    """The newest image of a topic; the arguments are those of `TopicWatch`.

    Raises:
        UsageError: Its messages are not images, or a library is not installed.
    """

    def __init__(self, node: Node, survey: Survey, topic: str) -> None:
        if importlib.util.find_spec("cv2") is None:
            raise UsageError(_LIBRARY)
        super().__init__(node, survey, topic)
        if short_type(self.type_name) not in IMAGE_TYPES:
            self.close()
            raise UsageError(
                f"'{topic}' is a {short_type(self.type_name)}, not one of"
                f" {', '.join(sorted(IMAGE_TYPES))}"
            )

    def encoded(self, form: str = ".jpg") -> tuple[bytes, str]:
        """Return the newest image as a file, and its media type.

        Args:
            form: ``.jpg`` or ``.png``.

        Raises:
            MessageError: The message is not an image, or none has come.
        """
        import cv2

        done, data = cv2.imencode(form, self._pixels())
        if not done:
            raise MessageError(f"OpenCV does not write '{form}'")
        return data.tobytes(), "image/png" if form == ".png" else "image/jpeg"

    def _pixels(self) -> Any:
        from rosz.images import pixels

        message = self.message()
        if message is None:
            raise MessageError(f"no image of '{self.topic}' has come")
        return pixels(message, deep=False)

    def description(self) -> str:
        """Return size and encoding of the newest image; empty before the first one."""
        message = self.message()
        if message is None:
            return ""
        if hasattr(message, "format"):
            return str(message.format)
        return f"{message.width} x {message.height} {message.encoding}"

    def value_at(self, x: int, y: int) -> str:
        """Return the value of a pixel as text; empty if there is none.

        Raises:
            MessageError: The message is not an image.
        """
        from rosz.images import ImageError, image_array

        message = self.message()
        if message is None:
            return ""
        try:
            raw = not hasattr(message, "format")
            image = image_array(message) if raw else self._pixels()
        except ImageError as error:
            raise MessageError(f"the message is not an image: {error}") from error
        height, width = image.shape[:2]
        if not (0 <= x < width and 0 <= y < height):
            return ""
        value = image[y, x]
        numbers = value.tolist() if hasattr(value, "tolist") else value
        shown = ", ".join(map(str, numbers)) if isinstance(numbers, list) else f"{numbers:g}"
        return f"({x}, {y}): {shown}"
