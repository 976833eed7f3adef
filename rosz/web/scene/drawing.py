"""The drawing of a display in the coordinates of the fixed frame, its colors, and its bytes.

A drawing is a header in JSON, whose length in four bytes comes first, and the numbers of its parts,
as the graphics processor takes them. ``pages/drawing.js`` reads it.
"""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterable
from typing import Any, Literal, TypeAlias

import numpy as np

from rosz.transforms import Pose

Array: TypeAlias = np.ndarray[Any, np.dtype[Any]]
Shape: TypeAlias = Literal["cube", "sphere", "cylinder", "cone"]

MEDIA = "application/octet-stream"
"""The media type of a drawing."""
BY_HEIGHT, BY_INTENSITY, OWN = "height", "intensity", "rgb"
_HEX = re.compile(r"#[0-9a-fA-F]{6}")
_STOPS = np.array(
    [(255, 0, 0), (255, 255, 0), (0, 255, 0), (0, 255, 255), (0, 0, 255), (255, 0, 255)]
)
_ALIGNMENT = 4
_OPAQUE = 255
_MOST_SHAPES = 200_000
# Lights are added in a linear scale, and the colors of messages are those of a screen.
_LEVELS = np.arange(256) / 255.0
_LINEAR = np.where(
    _LEVELS <= 0.04045,  # noqa: PLR2004  # the constants of sRGB
    _LEVELS / 12.92,
    ((_LEVELS + 0.055) / 1.055) ** 2.4,
)
_LINEAR = np.round(_LINEAR * 255).astype(np.uint8)


class Drawing:
    """Points, lines, triangles, shapes, texts, meshes and images of one display.

    Colors are arrays of bytes, red, green, blue and opacity: one for all, or one for each.

    Attributes:
        handle: The actions that the parts drawn next allow, for the browser; None for
            nothing.
    """

    def __init__(self) -> None:
        self.handle: dict[str, object] | None = None
        self._header: list[dict[str, Any]] = []
        self._data: list[bytes] = []

    def _add(self, head: dict[str, Any]) -> None:
        self._header.append(head if self.handle is None else {**head, "handle": self.handle})

    def points(self, positions: Array, colors: Array, size: float, *, pixels: bool = False) -> None:
        """Draw points.

        Args:
            positions: A row of three coordinates for each.
            colors: Their colors.
            size: Their size in metres.
            pixels: Whether the size is in pixels instead.
        """
        self._vertices({"kind": "points", "size": size, "pixels": pixels}, positions, colors)

    def lines(self, ends: Array, colors: Array) -> None:
        """Draw lines that are one pixel wide; every two rows are the ends of one."""
        self._vertices({"kind": "lines"}, ends, colors)

    def triangles(self, corners: Array, colors: Array) -> None:
        """Draw triangles; every three rows are the corners of one."""
        self._vertices({"kind": "triangles"}, corners, colors)

    def _vertices(self, head: dict[str, Any], positions: Array, colors: Array) -> None:
        rows = np.ascontiguousarray(positions, dtype="<f4").reshape(-1, 3)
        if not len(rows):
            return
        paint = _painted(colors, len(rows))
        self._add({**head, "count": len(rows), "clear": bool(paint[:, 3].min() < _OPAQUE)})
        self._data += [rows.tobytes(), paint.tobytes()]

    def shapes(self, shape: Shape, matrices: Array, colors: Array, texture: str = "") -> None:
        """Draw shapes of size 1 around the origin; cylinders and cones are along z.

        Args:
            shape: The shape.
            matrices: A matrix of 4 x 4 numbers for each, with its pose and size.
            colors: Their colors.
            texture: Where the browser finds a picture for their surface; empty for none.
        """
        rows = np.asarray(matrices, dtype="<f4").reshape(-1, 4, 4)[:_MOST_SHAPES]
        if not len(rows):
            return
        paint = _painted(colors, len(rows))
        for opacity in np.unique(paint[:, 3]):
            chosen = paint[:, 3] == opacity
            columns = np.ascontiguousarray(rows[chosen].transpose(0, 2, 1))
            head = {"kind": "shapes", "shape": shape, "opacity": int(opacity) / _OPAQUE}
            self._add({**head, "count": len(columns), "texture": texture})
            self._data += [columns.tobytes(), np.ascontiguousarray(paint[chosen]).tobytes()]

    def text(
        self, text: str, position: Iterable[float], color: str = "", height: float = 0.0
    ) -> None:
        """Draw a text that faces the viewer.

        Args:
            text: The text.
            position: Its centre.
            color: CSS color; empty for that of the page.
            height: Height in metres; 0 for the same size at any distance.
        """
        at = [float(value) for value in position]
        self._add({"kind": "text", "text": text, "at": at, "color": color, "height": height})

    def mesh(
        self,
        address: str,
        form: str,
        matrix: Array,
        color: Array | None = None,
        texture: str = "",
    ) -> None:
        """Draw a mesh.

        Args:
            address: Where the browser finds it.
            form: ``stl`` or ``glb``.
            matrix: Its pose and scale.
            color: Its color; None for its own.
            texture: Where the browser finds a picture for its surface; empty for its own.
        """
        columns = [float(value) for value in np.asarray(matrix).T.reshape(-1)]
        paint = None if color is None else [int(value) for value in color]
        head = {"kind": "model", "url": address, "form": form, "texture": texture}
        self._add({**head, "matrix": columns, "color": paint})

    def image(self, cells: Array, matrix: Array, palette: Array) -> None:
        """Draw cells on the plane z = 0, from its origin to (1, 1) of a matrix.

        Args:
            cells: A byte for each cell, in rows along x.
            matrix: Pose of the corner and size in metres.
            palette: Colors of the 256 values.
        """
        rows = np.ascontiguousarray(cells, dtype=np.uint8)
        height, width = rows.shape
        columns = [float(value) for value in np.asarray(matrix).T.reshape(-1)]
        self._add({"kind": "image", "width": width, "height": height, "matrix": columns})
        self._data += [np.ascontiguousarray(palette, dtype=np.uint8).tobytes(), rows.tobytes()]

    def encode(self) -> bytes:
        """Return the drawing as the browser takes it."""
        text = json.dumps(self._header, separators=(",", ":")).encode()
        text += b" " * (-len(text) % _ALIGNMENT)
        padded = [part + b"\0" * (-len(part) % _ALIGNMENT) for part in self._data]
        return b"".join([struct.pack("<I", len(text)), text, *padded])


def _painted(colors: Array, count: int) -> Array:
    paint = np.array(np.broadcast_to(np.asarray(colors, dtype=np.uint8), (count, 4)))
    paint[:, :3] = _LINEAR[paint[:, :3]]
    return paint


def matrix_of(pose: Pose) -> Array:
    """Return a pose as a matrix of 4 x 4 numbers."""
    x, y, z, w = pose.rotation
    matrix = np.eye(4)
    matrix[:3, :3] = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    matrix[:3, 3] = pose.translation
    return matrix


def moved(positions: Array, pose: Pose) -> Array:
    """Return positions in the frame in which a pose is given."""
    matrix = matrix_of(pose).astype(np.float32)
    points: Array = np.asarray(positions, dtype=np.float32) @ matrix[:3, :3].T + matrix[:3, 3]
    return points


def placed(pose: Pose, x: float = 1.0, y: float = 1.0, z: float = 1.0) -> Array:
    """Return the matrix of a shape at a pose, with its size in metres."""
    return matrix_of(pose) @ np.diag((x, y, z, 1.0))


def color_bytes(text: str, fallback: str = "#2f6fed") -> Array:
    """Return the four bytes of ``#rrggbb``; those of another color if it is not one."""
    digits = text if _HEX.fullmatch(text) else fallback
    return np.array([*bytes.fromhex(digits[1:]), 255], dtype=np.uint8)


def css_of(r: float, g: float, b: float, a: float = 1.0) -> str:
    """Return the CSS color of numbers from 0 to 1."""
    red, green, blue = (round(min(max(part, 0.0), 1.0) * 255) for part in (r, g, b))
    return f"rgba({red}, {green}, {blue}, {min(max(a, 0.0), 1.0):.3g})"


def rainbow(values: Array) -> Array:
    """Return a color for each value, red for the least and magenta for the greatest."""
    finite = np.isfinite(values)
    low, high = (values[finite].min(), values[finite].max()) if finite.any() else (0.0, 0.0)
    reach = (high - low) or 1.0
    part = np.where(finite, (values - low) / reach, 0.0) * (len(_STOPS) - 1)
    colors = np.full((len(values), 4), 255, dtype=np.uint8)
    for channel in range(3):
        colors[:, channel] = np.interp(part, range(len(_STOPS)), _STOPS[:, channel])
    return colors
