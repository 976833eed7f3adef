"""What a turtle looks like from above: convex polygons, from the lowest to the uppermost."""

from __future__ import annotations

import math
from collections.abc import Iterator

import msgspec

from rosz.turtlesim.field import Color, Point
from rosz.turtlesim.turtle import UNIT_PIXELS, Turtle

__all__ = ("Patch", "looks")

_CORNERS = 20


class Patch(msgspec.Struct, frozen=True):
    """A patch of one colour.

    Attributes:
        color: Its colour.
        outline: Its corners, in pixels of the field.
    """

    color: Color
    outline: tuple[Point, ...]


class _Dress(msgspec.Struct, frozen=True):
    """The colours of one kind of turtle."""

    skin: Color
    rim: Color
    shell: Color
    plate: Color


_KINDS = (
    _Dress((126, 186, 96), (56, 94, 40), (92, 142, 62), (148, 190, 104)),
    _Dress((222, 178, 108), (104, 62, 26), (160, 102, 48), (206, 152, 84)),
    _Dress((108, 190, 178), (22, 84, 92), (38, 128, 132), (104, 190, 180)),
    _Dress((226, 146, 120), (112, 34, 34), (172, 62, 52), (226, 120, 92)),
    _Dress((196, 160, 214), (74, 40, 104), (118, 72, 152), (174, 128, 202)),
    _Dress((214, 206, 120), (98, 92, 24), (152, 144, 48), (208, 200, 104)),
)
_EYE = (24, 24, 24)


def _oval(centre: Point, radii: Point, turned: float = 0.0) -> tuple[Point, ...]:
    cos, sin = math.cos(turned), math.sin(turned)
    corners: list[Point] = []
    for number in range(_CORNERS):
        angle = math.tau * number / _CORNERS
        x, y = radii[0] * math.cos(angle), radii[1] * math.sin(angle)
        corners.append((centre[0] + cos * x - sin * y, centre[1] + sin * x + cos * y))
    return tuple(corners)


def _plate(x: float, y: float, size: float) -> tuple[Point, ...]:
    angles = (math.tau * number / 6 for number in range(6))
    return tuple((x + size * math.cos(angle), y + size * math.sin(angle)) for angle in angles)


# Heading along x; lengths in turtles.
_LIMBS = (
    ((-0.36, 0.07), (-0.36, -0.07), (-0.52, 0.0)),
    _oval((0.25, 0.33), (0.19, 0.085), 1.0),
    _oval((0.25, -0.33), (0.19, 0.085), -1.0),
    _oval((-0.27, 0.29), (0.15, 0.08), 2.3),
    _oval((-0.27, -0.29), (0.15, 0.08), -2.3),
    _oval((0.46, 0.0), (0.14, 0.115)),
)
_EYES = (_oval((0.52, 0.055), (0.025, 0.025)), _oval((0.52, -0.055), (0.025, 0.025)))
_RIM = _oval((0.0, 0.0), (0.40, 0.335))
_SHELL = _oval((0.0, 0.0), (0.36, 0.295))
_PLATES = (
    _plate(0.0, 0.0, 0.105),
    _plate(0.2, 0.0, 0.085),
    _plate(-0.2, 0.0, 0.085),
    *(_plate(x, y, 0.085) for x in (0.1, -0.1) for y in (0.165, -0.165)),
)


def looks(turtle: Turtle) -> Iterator[Patch]:
    """Yield the patches that a turtle is made of, where it is on the picture."""
    dress = _KINDS[turtle.kind % len(_KINDS)]
    at_x, at_y = turtle.pixel
    ahead = UNIT_PIXELS * math.cos(turtle.theta)
    aside = UNIT_PIXELS * math.sin(turtle.theta)
    coats = (
        (dress.skin, _LIMBS),
        (_EYE, _EYES),
        (dress.rim, (_RIM,)),
        (dress.shell, (_SHELL,)),
        (dress.plate, _PLATES),
    )
    for color, outlines in coats:
        for outline in outlines:
            placed = (
                (at_x + ahead * x - aside * y, at_y - aside * x - ahead * y) for x, y in outline
            )
            yield Patch(color, tuple(placed))
