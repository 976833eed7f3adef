from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz.turtlesim.world import Canvas, Point, span

BLACK, WHITE = (0, 0, 0), (255, 255, 255)
SIZE = 24
near = st.floats(-40, 60).map(lambda value: round(value, 2))


def drawn(field: Canvas) -> set[tuple[int, int]]:
    """Return the pixels that are white."""
    return {
        (x, y)
        for y in range(field.height)
        for x in range(field.width)
        if field.color_at(x, y) == WHITE
    }


def distance(pixel: tuple[int, int], start: Point, end: Point) -> float:
    """Return the distance from a pixel to a line, calculated simply."""
    along_x, along_y = end[0] - start[0], end[1] - start[1]
    length = along_x**2 + along_y**2
    share = 0.0
    if length:
        share = ((pixel[0] - start[0]) * along_x + (pixel[1] - start[1]) * along_y) / length
        share = min(max(share, 0.0), 1.0)
    x, y = start[0] + share * along_x, start[1] + share * along_y
    return math.hypot(pixel[0] - x, pixel[1] - y)


@given(st.tuples(near, near), st.tuples(near, near), st.integers(1, 30))
def test_a_line_covers_pixels_within_half_its_width(start: Point, end: Point, width: int) -> None:
    field = Canvas(SIZE, SIZE, BLACK)
    field.line(start, end, width, WHITE)
    white = drawn(field)
    for y in range(SIZE):
        for x in range(SIZE):
            off = distance((x, y), start, end) - width / 2
            if abs(off) > 1e-6:
                assert ((x, y) in white) == (off < 0)


@pytest.mark.parametrize("width", [1, 2, 3, 10])
def test_straight_lines_are_as_wide_as_asked(width: int) -> None:
    field = Canvas(60, 60, BLACK)
    field.line((-10, 30), (70, 30), width, WHITE)
    assert len({y for _, y in drawn(field)}) == width
    field.fill(BLACK)
    field.line((29.5, -20), (29.5, 80), width, WHITE)
    assert len({x for x, _ in drawn(field)}) == width


def test_a_line_without_length_is_a_dot() -> None:
    field = Canvas(9, 9, BLACK)
    field.line((4, 4), (4, 4), 3, WHITE)
    assert drawn(field) == {(x, y) for x in (3, 4, 5) for y in (3, 4, 5)}


def test_lines_far_outside_are_invisible_and_cheap() -> None:
    field = Canvas(9, 9, BLACK)
    field.line((1e30, 1e30), (2e30, -1e30), 3, WHITE)
    assert drawn(field) == set()


def test_colors_by_the_nearest_pixel_and_the_edge() -> None:
    field = Canvas(4, 4, BLACK)
    field.line((3, 0), (3, 0), 1, WHITE)
    assert field.color_at(2.5, 0.4) == field.color_at(99, -99) == WHITE
    assert field.color_at(2.4, 0.4) == field.color_at(3, 0.5) == BLACK


def test_every_change_is_a_new_version() -> None:
    field = Canvas(4, 4, BLACK)
    versions = [field.version]
    field.line((0, 0), (1, 1), 1, WHITE)
    versions.append(field.version)
    field.fill(WHITE)
    versions.append(field.version)
    assert versions == sorted(set(versions))


def test_a_copy_is_independent() -> None:
    field = Canvas(4, 3, BLACK)
    copy = field.copy()
    field.fill(WHITE)
    assert (copy.width, copy.height, drawn(copy)) == (4, 3, set())


def test_spans_of_a_triangle() -> None:
    triangle = ((0.0, 0.0), (4.0, 0.0), (2.0, 4.0))
    assert span(triangle, 2.0) == (1.0, 3.0)
    assert span(triangle, 5.0) is None
