"""Pictures on the surfaces of robots, in a form that browsers read. Needs Pillow."""

from __future__ import annotations

import io

import numpy as np

from rosz.errors import UsageError
from rosz.web.scene.drawing import Array

__all__ = ("read_texture",)

_MEDIA = {"JPEG": "image/jpeg", "PNG": "image/png", "WEBP": "image/webp"}
"""Formats that browsers can show; pictures in other formats are converted to PNG."""


def read_texture(uri: str, data: bytes) -> tuple[bytes, str, Array]:
    """Return a picture for browsers, its media type, and the color of its first pixel.

    Args:
        uri: Where it is from.
        data: The contents of the file.

    Raises:
        UsageError: It is not a picture that can be read, or a library is not installed.
    """
    try:
        from PIL import Image
    except ImportError as error:
        raise UsageError(f"'{uri}' needs a library: pip install 'rosz[web]'") from error
    try:
        with Image.open(io.BytesIO(data)) as picture:
            form = picture.format or ""
            whole = picture.convert("RGBA")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise UsageError(f"'{uri}' is not a picture that can be read: {error}") from error
    color = np.array(whole.getpixel((0, 0)), dtype=np.uint8)
    if form not in _MEDIA:
        buffer = io.BytesIO()
        whole.save(buffer, "PNG")
        form, data = "PNG", buffer.getvalue()
    return data, _MEDIA[form], color
