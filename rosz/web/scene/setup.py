"""The settings of the view, as the address of the page holds them.

``/3d?frame=map&show=grid,tf,/scan;color=%23ff0000;size=4,/map;hidden`` names the fixed frame and
the displays, with commas between; a display is the name of a topic, or ``grid``, ``tf`` or
``robot``, and what differs from its defaults.
"""

from __future__ import annotations

import math
from urllib.parse import urlencode

import msgspec

__all__ = (
    "DEFAULT",
    "DESCRIPTION",
    "GRID",
    "ROBOT",
    "TF",
    "Look",
    "Setup",
    "format_setup",
    "read_setup",
)

GRID, TF, ROBOT = "grid", "tf", "robot"
DESCRIPTION = "/robot_description"
"""The parameter of the robot that has no other name."""
_BETWEEN, _WITHIN = ",", ";"
_MOST_SIZE = 1000.0
_MOST_KEPT = 100_000


class Look(msgspec.Struct, frozen=True):
    """Settings of a display.

    Attributes:
        name: Full name of a topic, or ``grid``, ``tf`` or ``robot``.
        color: ``#rrggbb``, ``height``, ``intensity`` or ``rgb``; empty for the default.
        size: Size in the unit of the display; 0 for the default.
        visible: Whether it is drawn.
        keep: Number of poses of an odometry that stay drawn; 0 for the default.
        prefix: What is before the names of the frames of a robot (``tf_prefix``).
    """

    name: str
    color: str = ""
    size: float = 0.0
    visible: bool = True
    keep: int = 0
    prefix: str = ""


class Setup(msgspec.Struct, frozen=True):
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


def read_setup(frame: str, show: str, view: str) -> Setup:
    """Return the setup of an address; what is not valid in it has its default."""
    looks = tuple(_read_look(one) for one in show.split(_BETWEEN) if one.strip())
    return Setup(frame, looks or DEFAULT, view if view == "top" else "orbit")


def _read_look(text: str) -> Look:
    name, *settings = text.strip().split(_WITHIN)
    found = dict(one.partition("=")[::2] for one in settings)
    try:
        size = float(found.get("size", 0))
    except ValueError:
        size = 0.0
    size = min(max(size, 0.0), _MOST_SIZE) if math.isfinite(size) else 0.0
    keep = int(found["keep"]) if found.get("keep", "").isdecimal() else 0
    return Look(
        name,
        found.get("color", ""),
        size,
        "hidden" not in found,
        keep=min(keep, _MOST_KEPT),
        prefix=found.get("prefix", "").strip("/"),
    )


def format_setup(setup: Setup) -> str:
    """Return the address of a setup."""
    query = {"frame": setup.frame, "show": _BETWEEN.join(map(_format_look, setup.looks))}
    if setup.view != "orbit":
        query["view"] = setup.view
    return f"/3d?{urlencode({k: v for k, v in query.items() if v}, safe='/,;=')}"


def _format_look(look: Look) -> str:
    parts = [look.name]
    if look.color:
        parts.append(f"color={look.color}")
    if look.size:
        parts.append(f"size={look.size:g}")
    if look.keep:
        parts.append(f"keep={look.keep}")
    if look.prefix:
        parts.append(f"prefix={look.prefix}")
    if not look.visible:
        parts.append("hidden")
    return _WITHIN.join(parts)
