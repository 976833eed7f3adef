"""The geometry of the robot and of its arena."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rosz.errors import UsageError
from rosz.turtlebot3_sim.world import (
    ARENAS,
    BODY_RADIUS,
    EMPTY,
    MAX_FORWARD,
    MAX_TURN,
    PILLARS,
    TRACK,
    WHEEL_RADIUS,
    Arena,
    Pillar,
    Robot,
    Wall,
)

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


def test_the_nearest_obstacle_is_measured() -> None:
    arena = Arena([Wall(3.0, -9.0, 3.0, 9.0), PILLAR])
    assert list(arena.ranges(0.0, 0.0, [0.0, math.pi / 4, math.pi], 10.0)) == pytest.approx(
        [1.5, 3 * math.sqrt(2), math.inf]
    )
    assert arena.clearance(0.0, 0.0) == 1.5


def test_obstacles_beyond_the_limit_are_not_measured() -> None:
    assert list(Arena([PILLAR]).ranges(0.0, 0.0, [0.0], 1.4)) == [math.inf]
    assert EMPTY.clearance(0.0, 0.0) == math.inf


def test_the_start_is_free() -> None:
    assert PILLARS.clearance(-2.0, -0.5) > 0.5
    assert len(PILLARS.obstacles) == 15
    assert set(ARENAS) == {"empty", "turtlebot3_world"}


def drive(robot: Robot, forward: float, turn: float, seconds: float) -> None:
    robot.command(forward, turn)
    for _ in range(round(seconds * 100)):
        robot.step(0.01)


def test_straight_ahead() -> None:
    robot = Robot(EMPTY, theta=math.pi / 2)
    drive(robot, 0.2, 0.0, 5.0)
    assert (robot.x, robot.y) == pytest.approx((0.0, 1.0))
    assert robot.wheel_left == robot.wheel_right == pytest.approx(1.0 / WHEEL_RADIUS)


def test_turning_on_the_spot() -> None:
    robot = Robot(EMPTY)
    drive(robot, 0.0, math.pi / 4, 2.0)
    assert (robot.x, robot.y, robot.theta) == pytest.approx((0.0, 0.0, math.pi / 2))
    assert -robot.wheel_left == robot.wheel_right
    assert robot.wheel_right == pytest.approx(math.pi / 2 * TRACK / 2 / WHEEL_RADIUS)


@given(st.floats(0.01, MAX_FORWARD), st.floats(-MAX_TURN, MAX_TURN), st.floats(0.001, 3))
def test_one_long_step_is_as_good_as_many(forward: float, turn: float, seconds: float) -> None:
    one, many = Robot(EMPTY), Robot(EMPTY)
    one.command(forward, turn)
    many.command(forward, turn)
    one.step(seconds)
    for _ in range(50):
        many.step(seconds / 50)
    assert (one.x, one.y) == pytest.approx((many.x, many.y), abs=1e-9)
    assert math.remainder(one.theta - many.theta, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_speeds_are_limited() -> None:
    robot = Robot(EMPTY)
    robot.command(math.inf, -99.0)
    assert (robot.forward, robot.turn) == (0.22, -2.84)
    robot.command(-1.0, 0.5)
    assert (robot.forward, robot.turn) == (-0.22, 0.5)
    with pytest.raises(UsageError, match="expected numbers"):
        robot.command(math.nan, 0.0)


def test_a_wall_stops_it_and_it_can_leave() -> None:
    robot = Robot(Arena([Wall(1.0, -5.0, 1.0, 5.0)]))
    drive(robot, 0.2, 0.0, 10.0)
    assert robot.x == pytest.approx(1.0 - BODY_RADIUS, abs=0.0021)
    assert robot.x <= 1.0 - BODY_RADIUS
    assert robot.speed == 0.0
    drive(robot, 0.2, 1.0, 0.5)
    assert robot.theta == pytest.approx(0.5)
    drive(robot, -0.2, 0.0, 1.0)
    assert robot.speed == -0.2
    assert robot.x < 0.75


def test_a_robot_inside_a_wall_can_leave() -> None:
    robot = Robot(Arena([Wall(1.0, -5.0, 1.0, 5.0)]), x=0.95)
    drive(robot, 0.2, 0.0, 1.0)
    assert robot.x == 0.95
    drive(robot, -0.2, 0.0, 1.0)
    assert robot.x == pytest.approx(0.75)


def test_the_laser_sees_counter_clockwise_from_ahead() -> None:
    robot = Robot(Arena([Pillar(1.0, 0.0, 0.1), Pillar(0.0, 2.0, 0.1)]), x=0.032)
    ranges = list(robot.scan())
    assert len(ranges) == 360
    assert ranges[0] == pytest.approx(0.9)
    assert ranges[90] == pytest.approx(1.9)
    assert ranges[180] == ranges[270] == math.inf
    robot.theta = math.pi / 2
    robot.x, robot.y = 0.0, 0.032
    ranges = list(robot.scan())
    assert (ranges[0], ranges[270]) == pytest.approx((1.9, 0.9))


def test_the_laser_is_blind_close_by_and_far_away() -> None:
    robot = Robot(Arena([Wall(0.08, -1.0, 0.08, 1.0), Wall(-9.0, -1.0, -9.0, 1.0)]))
    ranges = list(robot.scan())
    assert ranges[0] == ranges[180] == math.inf
    assert ranges[60] == pytest.approx(0.112 / math.cos(math.pi / 3))


def test_there_is_a_wall_or_pillar_everywhere() -> None:
    ranges = list(Robot(PILLARS, x=0.4).scan())
    assert all(0.12 <= length <= 3.5 for length in ranges)
