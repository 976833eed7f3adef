"""Colors of displays: one for all, or by a value of each point, as rviz has them."""

from __future__ import annotations

import re

import numpy as np

from rosz.web.scene.drawing import Array

__all__ = ("BY_HEIGHT", "BY_INTENSITY", "BY_VALUE", "OWN", "color_bytes", "css_of", "rainbow")

BY_HEIGHT, BY_INTENSITY, OWN = "height", "intensity", "rgb"
BY_VALUE = (BY_HEIGHT, BY_INTENSITY, OWN)

_HEX = re.compile(r"#[0-9a-fA-F]{6}")
_STOPS = np.array(
    [(255, 0, 0), (255, 255, 0), (0, 255, 0), (0, 255, 255), (0, 0, 255), (255, 0, 255)]
)


def color_bytes(text: str, fallback: str = "#2f6fed") -> Array:
    """Return the four bytes of ``#rrggbb``; those of another color if it is not one."""
    digits = text if _HEX.fullmatch(text) else fallback
    return np.array([*bytes.fromhex(digits[1:]), 255], dtype=np.uint8)


def css_of(r: float, g: float, b: float, a: float = 1.0) -> str:
    """Return the CSS color of numbers from 0 to 1."""
    red, green, blue = (round(min(max(one, 0.0), 1.0) * 255) for one in (r, g, b))
    return f"rgba({red}, {green}, {blue}, {min(max(a, 0.0), 1.0):.3g})"


def rainbow(values: Array) -> Array:
    """Return a color for each value, red for the least and magenta for the greatest."""
    known = np.isfinite(values)
    low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
    reach = (high - low) or 1.0
    part = np.where(known, (values - low) / reach, 0.0) * (len(_STOPS) - 1)
    colors = np.full((len(values), 4), 255, dtype=np.uint8)
    for channel in range(3):
        colors[:, channel] = np.interp(part, range(len(_STOPS)), _STOPS[:, channel])
    return colors
