from __future__ import annotations

import math
import signal
from collections.abc import Callable, Iterator

import pytest
from network import TIMEOUT, Network, Program

from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.turtlesim.msg import Pose
from rosz.turtlesim.drivers import Square
from rosz.turtlesim.world import START, STEP_SECONDS, World

from .conftest import Watcher

MIMIC = """
<launch>
  <group ns="turtlesim1"><node pkg="turtlesim" name="sim" type="turtlesim_node"/></group>
  <group ns="turtlesim2"><node pkg="turtlesim" name="sim" type="turtlesim_node"/></group>
  <node pkg="turtlesim" name="mimic" type="mimic">
    <remap from="input" to="turtlesim1/turtle1"/>
    <remap from="output" to="turtlesim2/turtle1"/>
  </node>
</launch>
"""


@pytest.fixture
def rosz(network: Network) -> Iterator[Callable[..., Program]]:
    """Return a function that starts a command of rosz, which is interrupted after the test."""
    started: list[Program] = []

    def start(*words: str) -> Program:
        started.append(network.run("-m", "rosz", *words))
        return started[-1]

    yield start
    for program in started:
        if program.process.poll() is None:
            program.send(signal.SIGINT)
        program.exit_code()


def test_the_node_runs_and_ends(rosz: Callable[..., Program]) -> None:
    program = rosz("run", "turtlesim", "turtlesim_node", "__name:=turtlesim_1")
    program.wait_for("Starting turtlesim with node name /turtlesim_1")
    program.wait_for("Spawning turtle [turtle1] at x=[5.544445], y=[5.544445], theta=[0.000000]")
    program.wait_for("No window: ")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
    assert "Traceback" not in program.output


def test_the_headless_parameter(rosz: Callable[..., Program]) -> None:
    program = rosz("run", "turtlesim", "turtlesim_node", "_headless:=true")
    program.wait_for("No window: the parameter ~headless is set. 'rosz turtlesim snapshot")


def test_a_python_without_tk_says_what_to_install(network: Network) -> None:
    program = network.program(
        """
        import sys
        sys.modules["tkinter"] = None
        from rosz.turtlesim.program import main
        main()
        """
    )
    program.wait_for("No window: this Python has no tkinter (Debian and Ubuntu: apt install")


def test_the_mimic_example_of_the_tutorials(network: Network, rosz: Callable[..., Program]) -> None:
    file = network.folder / "turtlemimic.launch"
    file.write_text(MIMIC)
    rosz("launch", str(file))
    user = network.node("user")
    leader, follower = Watcher(user, "/turtlesim1/turtle1"), Watcher(user, "/turtlesim2/turtle1")
    commands = user.publisher("/turtlesim1/turtle1/cmd_vel", Twist, queue_size=1)
    commands.wait_for_subscribers(timeout=TIMEOUT)
    user.context.graph.wait_for(
        lambda view: (
            bool(view.publishers("/turtlesim2/turtle1/cmd_vel"))
            and any(t.node == "mimic" for t in view.subscriptions("/turtlesim1/turtle1/pose"))
        ),
        TIMEOUT,
        "the mimic",
    )
    follower.wait_for()
    command = Twist(Vector3(x=2.0), Vector3(z=-1.8))
    # Again and again: the mimic passes on only what comes once it is linked to both simulations.
    driving = user.timer(0.5, lambda _: commands.publish(command))
    moving = follower.wait_for(lambda pose: pose.linear_velocity and pose.theta < -1)
    assert (moving.linear_velocity, moving.angular_velocity) == pytest.approx((2.0, -1.8))
    driving.close()
    leader.wait_for(lambda pose: pose.theta < -1)
    leader.wait_for(lambda pose: not pose.angular_velocity)


def test_two_fields_from_one_launch_file(network: Network, rosz: Callable[..., Program]) -> None:
    launch = rosz("launch", "turtlesim", "multisim.launch")
    user = network.node("user")
    for name in ("/turtlesim1/turtle1", "/turtlesim2/turtle1"):
        assert Watcher(user, name).wait_for().x == START
    launch.send(signal.SIGINT)
    assert launch.exit_code() == 0


def test_the_launch_line_of_the_lecture(network: Network, rosz: Callable[..., Program]) -> None:
    rosz("launch", "turtlesim", "turtlesim_node").wait_for("Spawning turtle [turtle1]")
    assert network.node("user").params["/turtlesim/background_b"] == 255


def test_the_square_on_a_world_without_network() -> None:
    world, square = World(), Square()
    turtle = world.turtles[world.spawn(START, START, 0.0)]
    corners: list[tuple[float, float]] = []
    for number in range(3000):
        now = number * STEP_SECONDS
        move = square.next(Pose(turtle.x, turtle.y, turtle.theta, turtle.speed, turtle.turn))
        turtle.command(now, forward=move.linear.x, left=0.0, turn=move.angular.z)
        assert list(world.step(now)) == []
        corners += [(turtle.x, turtle.y)] * square.messages.count("Reached goal")
        square.messages.clear()
    sides = [math.dist(*pair) for pair in zip(corners[::2], corners[2::2], strict=False)]
    assert len(sides) > 3
    assert sides == pytest.approx([1.9] * len(sides), abs=0.05)
    assert math.dist(corners[0], corners[8]) < 0.2


def test_the_square_waits_until_the_turtle_stands() -> None:
    square = Square()
    assert square.next(Pose()) == Twist(Vector3(x=1.0))
    assert square.next(Pose(x=1.95, linear_velocity=1.0)) == Twist()
    assert square.next(Pose(x=1.96, linear_velocity=1.0)) == Twist()
    assert square.next(Pose(x=1.97)) == Twist(angular=Vector3(z=0.4))
    assert square.messages == [
        "New goal [2.000000 0.000000, 0.000000]",
        "Reached goal",
        "New goal [1.970000 0.000000, 1.570796]",
    ]


def test_draw_square_drives_the_turtle(network: Network, rosz: Callable[..., Program]) -> None:
    rosz("run", "turtlesim", "turtlesim_node").wait_for("Spawning")
    watcher = Watcher(network.node("user"), "turtle1")
    watcher.wait_for()
    program = rosz("run", "turtlesim", "draw_square")
    program.wait_for("New goal [7.544445 5.544445, 0.000000]")
    assert watcher.wait_for(lambda pose: pose.x > START + 1).y == START
    program.wait_for("Reached goal")


def test_draw_square_goes_on_without_a_reset(network: Network) -> None:
    program = network.program(
        """
        from rosz.turtlesim import drivers
        drivers._RESET_SECONDS = 0.1
        drivers.draw_square()
        """
    )
    program.wait_for("cannot reset the field: no service '/reset'")
    pose = network.node("sim").publisher("turtle1/pose", Pose, latch=True)
    pose.publish(Pose(1.0, 2.0, 0.0, 0.0, 0.0))
    program.wait_for("New goal [3.000000 2.000000, 0.000000]")
