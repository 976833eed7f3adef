"""The settings of the view, as the address of the page holds them.

``/3d?frame=map&show=grid,tf,/scan;color=%23ff0000;size=4,/map;hidden`` names the fixed frame and
the displays, separated by commas. A display is its name (of a topic, or ``grid``, ``axes``, ``tf``
or ``robot``), and after semicolons the settings that differ from the defaults.
"""

from __future__ import annotations

import math
from urllib.parse import urlencode

import msgspec

AXES, DEPTH, GRID, TF, ROBOT = "axes", "depth", "grid", "tf", "robot"
DESCRIPTION = "/robot_description"
"""The parameter with the description of the robot, where no other is named."""
_BETWEEN, _WITHIN = ",", ";"
_MOST_SIZE = 1000.0
_MOST_KEPT = 100_000
_MOST_GRID_CELLS = 1000
MOST_DISPLAYS = 100
"""Largest number of displays of a page: each costs the browser and the server time."""


class Look(msgspec.Struct, frozen=True):
    """Settings of a display.

    Attributes:
        name: Full name of a topic, also with ``depth:`` before it, or ``grid``, ``axes``, ``tf`` or
            ``robot``.
        color: ``#rrggbb``, ``height``, ``intensity`` or ``rgb``; empty for the default.
        size: Size in the unit of the display; 0 for the default.
        visible: Whether it is drawn.
        keep: Number of poses of an odometry that stay drawn; 0 for the default.
        prefix: The prefix of the names of a robot's frames (``tf_prefix``).
        frame: Frame that a grid or axes are at; empty for the fixed frame.
        radius: Radius of axes in metres; 0 for the default.
        cells: Number of cells of a grid along one side; 0 for the default.
        image: Topic of the image with the colors of a depth image; empty for none.
    """

    name: str
    color: str = ""
    size: float = 0.0
    visible: bool = True
    keep: int = 0
    prefix: str = ""
    frame: str = ""
    radius: float = 0.0
    cells: int = 0
    image: str = ""


class SceneSetup(msgspec.Struct, frozen=True):
    """The settings of the view.

    Attributes:
        frame: The fixed frame; empty to choose one.
        looks: The displays.
        view: ``orbit`` or ``top``.
    """

    frame: str = ""
    looks: tuple[Look, ...] = ()
    view: str = "orbit"


DEFAULT = (Look(GRID), Look(TF))


def read_setup(frame: str, show: str, view: str) -> SceneSetup:
    """Return the setup of an address; invalid parts have their defaults.

    It may have more displays than a page shows; see `MOST_DISPLAYS`.
    """
    looks = tuple(_read_look(look) for look in show.split(_BETWEEN) if look.strip())
    return SceneSetup(frame, looks or DEFAULT, view if view == "top" else "orbit")


def _read_look(text: str) -> Look:
    name, *settings = text.strip().split(_WITHIN)
    options = dict(setting.partition("=")[::2] for setting in settings)
    return Look(
        name,
        options.get("color", ""),
        _read_length(options.get("size", "")),
        "hidden" not in options,
        keep=_read_count(options.get("keep", ""), _MOST_KEPT),
        prefix=options.get("prefix", "").strip("/"),
        frame=options.get("frame", "").removeprefix("/"),
        radius=_read_length(options.get("radius", "")),
        cells=_read_count(options.get("cells", ""), _MOST_GRID_CELLS),
        image=options.get("image", ""),
    )


def _read_length(text: str) -> float:
    try:
        length = float(text or 0)
    except ValueError:
        return 0.0
    return min(max(length, 0.0), _MOST_SIZE) if math.isfinite(length) else 0.0


def _read_count(text: str, most: int) -> int:
    return min(int(text), most) if text.isdecimal() else 0


def format_setup(setup: SceneSetup) -> str:
    """Return the address of a setup."""
    query = {"frame": setup.frame, "show": _BETWEEN.join(map(_format_look, setup.looks))}
    if setup.view != "orbit":
        query["view"] = setup.view
    return f"/3d?{urlencode({k: v for k, v in query.items() if v}, safe='/,;=')}"


def _format_look(look: Look) -> str:
    parts = [look.name]
    for key in ("color", "size", "keep", "prefix", "frame", "radius", "cells", "image"):
        value = getattr(look, key)
        if value:
            parts.append(f"{key}={value:g}" if isinstance(value, float) else f"{key}={value}")
    if not look.visible:
        parts.append("hidden")
    return _WITHIN.join(parts)
