from __future__ import annotations

import math

import pytest

from rosz.errors import NotFoundError, UsageError
from rosz.turtlesim.world import BACKGROUND, START, World


@pytest.fixture
def world() -> World:
    made = World()
    made.spawn_first()
    return made


def test_the_first_turtle_is_in_the_middle(world: World) -> None:
    assert list(world.turtles) == ["turtle1"]
    first = world.turtles["turtle1"]
    assert (first.x, first.y, first.theta) == (START, START, 0.0)
    assert f"{START:f}" == "5.544445"


def test_names_are_made_up_and_skip_what_is_taken(world: World) -> None:
    assert world.spawn(1, 1, 0, "turtle2") == "turtle2"
    assert world.spawn(1, 1, 0) == "turtle3"
    world.kill("turtle3")
    assert world.spawn(1, 1, 0) == "turtle4"


def test_a_name_is_given_once(world: World) -> None:
    with pytest.raises(UsageError, match=r"^a turtle named \[turtle1\] already exists$"):
        world.spawn(1, 1, 0, "turtle1")


def test_no_turtle_is_nowhere(world: World) -> None:
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
    (bump,) = world.step(0.0)
    assert bump.turtle == "west"
    assert bump.goal == pytest.approx((-0.016, 5.0))
