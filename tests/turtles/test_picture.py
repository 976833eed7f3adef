from __future__ import annotations

import math
import random

import pytest

from rosz.turtlesim import picture
from rosz.turtlesim.picture import Patch, patches
from rosz.turtlesim.world import BACKGROUND, SIZE, START, Turtle, World

from . import png


def taken(world: World) -> bytes:
    return picture.render(world.field, world.turtles.values())


def test_png_preserves_the_pixels() -> None:
    pixels = random.Random(1).randbytes(3 * 7 * 5)
    image = png.read(picture.encode_png(pixels, 7, 5))
    assert (image.width, image.height) == (7, 5)
    assert b"".join(image.rows) == pixels


def test_an_empty_field_has_one_color() -> None:
    image = png.read(taken(World()))
    assert (image.width, image.height) == (500, 500)
    assert image.colors() == {BACKGROUND}


def test_the_turtle_is_in_the_picture_and_not_on_the_field() -> None:
    world = World()
    world.spawn(START, START, 0.0)
    before = bytes(world.field.pixels)
    image = png.read(taken(world))
    changed = [(x, y) for y in range(500) for x in range(500) if image.at(x, y) != BACKGROUND]
    assert bytes(world.field.pixels) == before
    xs, ys = [x for x, _ in changed], [y for _, y in changed]
    assert 220 < min(xs) < 230
    assert 270 < max(xs) < 280
    assert 220 < min(ys) < 235
    assert min(ys) + max(ys) == pytest.approx(499, abs=1)


@pytest.mark.parametrize(
    ("theta", "ahead"),
    [(0.0, (1, 0)), (math.pi / 2, (0, -1)), (math.pi, (-1, 0)), (-math.pi / 2, (0, 1))],
)
def test_the_head_is_ahead(theta: float, ahead: tuple[int, int]) -> None:
    eyes = [patch for patch in patches(Turtle(5.0, 5.0, theta)) if patch.color == (24, 24, 24)]
    assert len(eyes) == 2
    for eye in eyes:
        x = sum(corner[0] for corner in eye.outline) / len(eye.outline) - 5.0 * 45
        y = sum(corner[1] for corner in eye.outline) / len(eye.outline) - (SIZE - 5.0) * 45
        assert x * ahead[0] + y * ahead[1] > 20


def test_the_line_is_below_the_turtle() -> None:
    world = World()
    world.spawn(START, START, 0.0)
    world.turtles["turtle1"].teleport_by(3.0, 0.0)
    assert list(world.step(0.0)) == []
    image = png.read(taken(world))
    assert image.at(300, 250) == world.turtles["turtle1"].pen.color
    assert image.at(384, 250) not in {BACKGROUND, world.turtles["turtle1"].pen.color}


def test_half_a_pixel_is_half_the_color() -> None:
    pixels = bytearray(3 * 3)
    square = ((0.0, -0.5), (2.0, -0.5), (2.0, 0.5), (0.0, 0.5))
    picture.paint(pixels, 3, 1, Patch((200, 100, 50), square))
    assert tuple(pixels) == (100, 50, 25, 200, 100, 50, 100, 50, 25)


def test_a_quarter_of_the_height_is_a_quarter_of_the_color() -> None:
    pixels = bytearray(3)
    low = ((-0.5, 0.25), (0.5, 0.25), (0.5, 0.5), (-0.5, 0.5))
    picture.paint(pixels, 1, 1, Patch((200, 100, 40), low))
    assert tuple(pixels) == (50, 25, 10)


def test_parts_outside_the_picture_are_ignored() -> None:
    world = World()
    world.spawn(0.0, 0.0, 0.0)
    world.spawn(50.0, 50.0, 0.0)
    image = png.read(taken(world))
    assert image.at(0, 499) != BACKGROUND
