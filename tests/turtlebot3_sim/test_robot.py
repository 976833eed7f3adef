from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz.errors import UsageError
from rosz.turtlebot3_sim.world import (
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


def drive(robot: Robot, forward: float, turn: float, seconds: float) -> None:
    robot.command(forward, turn)
    for _ in range(round(seconds * 100)):
        robot.step(0.01)


def test_straight_ahead() -> None:
    robot = Robot(EMPTY, theta=math.pi / 2)
    drive(robot, 0.2, 0.0, 5.0)
    assert (robot.x, robot.y) == pytest.approx((0.0, 1.0))
    assert robot.wheel_left == robot.wheel_right == pytest.approx(1.0 / WHEEL_RADIUS)


def test_on_the_spot() -> None:
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


def test_too_fast_is_cut() -> None:
    robot = Robot(EMPTY)
    robot.command(math.inf, -99.0)
    assert (robot.forward, robot.turn) == (0.22, -2.84)
    robot.command(-1.0, 0.5)
    assert (robot.forward, robot.turn) == (-0.22, 0.5)
    with pytest.raises(UsageError, match="expected numbers"):
        robot.command(math.nan, 0.0)


def test_a_wall_stops_it_and_lets_it_go() -> None:
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


def test_one_that_stands_in_a_wall_can_leave_it() -> None:
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
