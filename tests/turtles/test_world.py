"""Turtles and their world: movement, teleports, pens, names. No clock, no network."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz.errors import NotFoundError, UsageError
from rosz.turtlesim.world import BACKGROUND, SIZE, START, STEP_SECONDS, Canvas, Pen, Turtle, World

BLUE = (69, 86, 255)
MIDDLE = SIZE / 2
speeds = st.floats(-50, 50)


@pytest.fixture
def field() -> Canvas:
    return Canvas(500, 500, BLUE)


def run(turtle: Turtle, field: Canvas, steps: int, start: float = 0.0) -> None:
    for number in range(steps):
        turtle.step(field, start + number * STEP_SECONDS)


def test_the_field_has_the_size_of_ros1() -> None:
    assert pytest.approx(11.0889, abs=1e-4) == SIZE
    assert 1 / STEP_SECONDS == 62.5


def test_straight_ahead_for_a_second_and_no_longer(field: Canvas) -> None:
    turtle = Turtle(2.0, 3.0, 0.0)
    turtle.command(0.0, forward=2.0, left=0.0, turn=0.0)
    run(turtle, field, 63)
    assert turtle.x == pytest.approx(2.0 + 63 * STEP_SECONDS * 2.0)
    assert turtle.speed == 2.0
    run(turtle, field, 50, start=1.01)
    assert turtle.x == pytest.approx(2.0 + 63 * STEP_SECONDS * 2.0)
    assert (turtle.speed, turtle.turn, turtle.y) == (0.0, 0.0, 3.0)


def test_strafing_goes_to_the_left(field: Canvas) -> None:
    turtle = Turtle(5.0, 5.0, math.pi / 6)
    turtle.command(0.0, forward=3.0, left=4.0, turn=0.0)
    turtle.step(field, 0.0)
    right, up = math.sqrt(3) / 2 * 3 - 4 / 2, 3 / 2 + math.sqrt(3) / 2 * 4
    assert turtle.x == pytest.approx(5.0 + right * STEP_SECONDS)
    assert turtle.y == pytest.approx(5.0 + up * STEP_SECONDS)
    assert turtle.speed == 5.0


def test_a_circle_ends_where_it_began(field: Canvas) -> None:
    turtle = Turtle(MIDDLE, MIDDLE, 0.0)
    turns = 2 * math.pi / (100 * STEP_SECONDS)
    for number in range(100):
        turtle.command(number * STEP_SECONDS, forward=2.0, left=0.0, turn=turns)
        turtle.step(field, number * STEP_SECONDS)
    assert (turtle.x, turtle.y) == pytest.approx((MIDDLE, MIDDLE), abs=1e-9)
    assert turtle.theta == pytest.approx(0.0, abs=1e-9)


@given(speeds, speeds, st.floats(-1e9, 1e9), st.floats(-100, 100))
def test_it_stays_on_the_field_and_its_heading_in_one_turn(
    forward: float, left: float, turn: float, theta: float
) -> None:
    field = Canvas(500, 500, BLUE)
    turtle = Turtle(MIDDLE, MIDDLE, theta)
    for _ in range(5):
        turtle.command(0.0, forward=forward, left=left, turn=turn)
        turtle.step(field, 0.0)
        assert 0 <= turtle.x <= SIZE
        assert 0 <= turtle.y <= SIZE
        assert -math.pi <= turtle.theta < math.pi


def test_half_a_turn_counts_as_minus_pi(field: Canvas) -> None:
    turtle = Turtle(5.0, 5.0, math.pi)
    turtle.step(field, 0.0)
    assert turtle.theta == -math.pi


def test_a_wall_stops_it_and_its_goal_is_returned(field: Canvas) -> None:
    turtle = Turtle(SIZE - 0.01, 5.0, 0.0)
    turtle.command(0.0, forward=2.0, left=0.0, turn=0.0)
    assert turtle.step(field, 0.0) == pytest.approx((SIZE - 0.01 + 2 * STEP_SECONDS, 5.0))
    assert turtle.x == SIZE
    turtle.command(0.0, forward=-2.0, left=0.0, turn=0.0)
    assert turtle.step(field, 0.0) is None


def test_teleports_happen_in_order_at_the_next_step(field: Canvas) -> None:
    turtle = Turtle(1.0, 1.0, 0.0)
    turtle.teleport_to(4.0, 4.0, 0.0)
    turtle.teleport_by(2.0, math.pi / 2)
    assert (turtle.x, turtle.y) == (1.0, 1.0)
    turtle.step(field, 0.0)
    assert (turtle.x, turtle.y, turtle.theta) == pytest.approx((4.0, 6.0, math.pi / 2))
    assert field.color_at(2.5 * 45, (SIZE - 2.5) * 45) == turtle.pen.color
    assert field.color_at(4.0 * 45, (SIZE - 5.0) * 45) == turtle.pen.color


def test_a_teleport_beyond_the_field_ends_at_the_wall(field: Canvas) -> None:
    turtle = Turtle(1.0, 1.0, 0.0)
    turtle.teleport_to(99.0, 99.0, 0.0)
    # As in ROS 1, only what is too far up counts as being at the wall from the start.
    assert turtle.step(field, 0.0) == (99.0, SIZE)
    assert (turtle.x, turtle.y) == (SIZE, SIZE)


def test_the_pen_draws_unless_it_is_off(field: Canvas) -> None:
    turtle = Turtle(1.0, 5.0, 0.0, pen=Pen((1, 2, 3), 7))
    turtle.teleport_to(3.0, 5.0, 0.0)
    turtle.step(field, 0.0)
    turtle.pen = Pen((1, 2, 3), 7, on=False)
    turtle.teleport_to(6.0, 5.0, 0.0)
    turtle.step(field, 0.0)
    row = (SIZE - 5.0) * 45
    assert field.color_at(2.0 * 45, row) == (1, 2, 3)
    assert field.color_at(2.0 * 45, row - 3) == (1, 2, 3)
    assert field.color_at(2.0 * 45, row - 5) == BLUE
    assert field.color_at(4.5 * 45, row) == BLUE


def test_the_color_sensor_ignores_the_new_line(field: Canvas) -> None:
    turtle = Turtle(1.0, 5.0, 0.0)
    turtle.teleport_to(3.0, 5.0, 0.0)
    turtle.command(0.0, forward=10.0, left=0.0, turn=0.0)
    turtle.step(field, 0.0)
    assert turtle.sees == BLUE
    turtle.command(0.0, forward=-10.0, left=0.0, turn=0.0)
    turtle.step(field, 0.0)
    assert turtle.sees == turtle.pen.color


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_are_refused(value: float) -> None:
    turtle = Turtle(1.0, 1.0, 0.0)
    with pytest.raises(UsageError, match=r"^turn is '-?(nan|inf)': expected a finite number$"):
        turtle.command(0.0, forward=0.0, left=0.0, turn=value)
    with pytest.raises(UsageError, match=r"^x is"):
        turtle.teleport_to(value, 0.0, 0.0)
    with pytest.raises(UsageError, match=r"^linear is"):
        turtle.teleport_by(value, 0.0)


@pytest.fixture
def world() -> World:
    made = World()
    made.spawn(START, START, 0.0)
    return made


def test_the_first_turtle_is_in_the_middle(world: World) -> None:
    assert list(world.turtles) == ["turtle1"]
    first = world.turtles["turtle1"]
    assert (first.x, first.y, first.theta) == (START, START, 0.0)
    assert f"{START:f}" == "5.544445"


def test_generated_names_skip_taken_ones(world: World) -> None:
    assert world.spawn(1, 1, 0, "turtle2") == "turtle2"
    assert world.spawn(1, 1, 0) == "turtle3"
    world.kill("turtle3")
    assert world.spawn(1, 1, 0) == "turtle4"


def test_names_are_unique(world: World) -> None:
    with pytest.raises(UsageError, match=r"^a turtle named \[turtle1\] already exists$"):
        world.spawn(1, 1, 0, "turtle1")


def test_places_must_be_finite(world: World) -> None:
    with pytest.raises(UsageError, match=r"^y is 'nan'"):
        world.spawn(1, math.nan, 0)
    assert list(world.turtles) == ["turtle1"]


def test_a_killed_turtle_leaves_its_line(world: World) -> None:
    world.turtles["turtle1"].teleport_by(2.0, 0.0)
    assert list(world.step(0.0)) == []
    drawn = bytes(world.field.pixels)
    world.kill("turtle1")
    assert world.turtles == {}
    assert bytes(world.field.pixels) == drawn
    with pytest.raises(NotFoundError, match=r"kill turtle \[turtle1\], which does not exist"):
        world.kill("turtle1")


def test_clearing_takes_the_lines_and_sets_the_background(world: World) -> None:
    world.turtles["turtle1"].teleport_by(2.0, 0.0)
    assert list(world.step(0.0)) == []
    world.clear((1, 2, 3))
    assert set(zip(*[iter(world.field.pixels)] * 3, strict=True)) == {(1, 2, 3)}
    assert list(world.turtles) == ["turtle1"]


def test_reset_starts_over(world: World) -> None:
    world.spawn(1, 1, 0)
    world.turtles["turtle1"].teleport_by(2.0, 1.0)
    assert list(world.step(0.0)) == []
    assert world.reset(BACKGROUND) == "turtle1"
    assert list(world.turtles) == ["turtle1"]
    assert world.turtles["turtle1"].x == START
    assert world.spawn(1, 1, 0) == "turtle2"
    assert bytes(world.field.pixels) == bytes(World().field.pixels)


def test_bumps_name_the_turtle(world: World) -> None:
    world.spawn(0.0, 5.0, math.pi, "west")
    world.turtles["west"].command(0.0, forward=1.0, left=0.0, turn=0.0)
    ((turtle, goal),) = world.step(0.0)
    assert turtle == "west"
    assert goal == pytest.approx((-0.016, 5.0))
