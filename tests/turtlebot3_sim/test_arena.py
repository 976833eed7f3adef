from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rosz.turtlebot3_sim.world import ARENAS, EMPTY, PILLARS, Arena, Pillar, Wall

WALL = Wall(1.0, -1.0, 1.0, 3.0)
PILLAR = Pillar(2.0, 0.0, 0.5)
coordinates = st.floats(-5, 5).map(lambda value: round(value, 3))
angles = st.floats(-math.pi, math.pi)


@pytest.mark.parametrize(
    ("x", "y", "distance"), [(0.0, 0.0, 1.0), (4.0, 2.0, 3.0), (1.0, 5.0, 2.0), (4.0, -5.0, 5.0)]
)
def test_distance_to_a_wall(x: float, y: float, distance: float) -> None:
    assert WALL.distance(x, y) == pytest.approx(distance)


@pytest.mark.parametrize(
    ("angle", "length"),
    [
        (0.0, 1.0),
        (math.pi / 4, math.sqrt(2)),
        (math.pi, math.inf),
        (math.pi / 2, math.inf),
        (-math.pi / 3, math.inf),
    ],
)
def test_rays_to_a_wall(angle: float, length: float) -> None:
    assert WALL.hit(0.0, 0.0, math.cos(angle), math.sin(angle)) == pytest.approx(length)


@pytest.mark.parametrize(
    ("y", "angle", "length"),
    [(0.0, 0.0, 1.5), (0.4, 0.0, 1.7), (0.6, 0.0, math.inf), (0.0, math.pi, math.inf)],
)
def test_rays_to_a_pillar(y: float, angle: float, length: float) -> None:
    assert PILLAR.hit(0.0, y, math.cos(angle), math.sin(angle)) == pytest.approx(length)


@pytest.mark.parametrize("obstacle", [WALL, PILLAR])
@given(x=coordinates, y=coordinates, angle=angles)
def test_a_ray_ends_on_the_surface_and_passes_none_before(
    obstacle: Wall | Pillar, x: float, y: float, angle: float
) -> None:
    assume(obstacle.distance(x, y) > 0.01)
    cos, sin = math.cos(angle), math.sin(angle)
    length = obstacle.hit(x, y, cos, sin)
    if math.isinf(length):
        length = 20.0
    else:
        end = obstacle.distance(x + length * cos, y + length * sin)
        assert end == pytest.approx(0.0, abs=1e-6)
    for share in (0.2, 0.5, 0.9):
        way = length * share
        assert obstacle.distance(x + way * cos, y + way * sin) > -1e-6


def test_the_nearest_counts() -> None:
    arena = Arena([Wall(3.0, -9.0, 3.0, 9.0), PILLAR])
    assert list(arena.ranges(0.0, 0.0, [0.0, math.pi / 4, math.pi], 10.0)) == pytest.approx(
        [1.5, 3 * math.sqrt(2), math.inf]
    )
    assert arena.clearance(0.0, 0.0) == 1.5


def test_nothing_is_seen_beyond_the_limit() -> None:
    assert list(Arena([PILLAR]).ranges(0.0, 0.0, [0.0], 1.4)) == [math.inf]
    assert EMPTY.clearance(0.0, 0.0) == math.inf


def test_the_start_is_free() -> None:
    assert PILLARS.clearance(-2.0, -0.5) > 0.5
    assert len(PILLARS.obstacles) == 15
    assert set(ARENAS) == {"empty", "turtlebot3_world"}
