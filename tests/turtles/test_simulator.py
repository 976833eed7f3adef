from __future__ import annotations

import math
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import NotFoundError, ServiceError, ServiceNotFound, UsageError
from rosz.msgs.geometry_msgs.msg import Twist, Vector3
from rosz.msgs.rcl_interfaces.msg import Log
from rosz.msgs.std_srvs.srv import Empty
from rosz.msgs.turtlesim.msg import Color, Pose
from rosz.msgs.turtlesim.srv import Kill, SetPen, Spawn, TeleportAbsolute, TeleportRelative
from rosz.node import Service
from rosz.qos import ROSOUT
from rosz.turtlesim import fetch
from rosz.turtlesim.simulator import Simulator
from rosz.turtlesim.world import SIZE, START

from . import png
from .conftest import Scene, Watcher, wait_for_turtle

FORWARD = Twist(Vector3(x=2.0), Vector3())


def served(scene: Scene) -> set[str]:
    """Return the topics and services of the simulation, without those of every node."""
    view = scene.user.context.graph.refresh()
    names = {token.name for token in view.entities() if token.node_name == "/turtlesim"}
    return {name for name in names if not name.startswith(("/rosout", "/turtlesim/"))}


def image_of(scene: Scene) -> png.Image:
    """Fetch the picture like another process."""
    return png.read(fetch(scene.user.context.session, scene.user.context.domain).png)


def test_names_of_topics_and_services(scene: Scene) -> None:
    assert served(scene) == {
        "/clear",
        "/kill",
        "/reset",
        "/spawn",
        "/turtle1/cmd_vel",
        "/turtle1/color_sensor",
        "/turtle1/pose",
        "/turtle1/set_pen",
        "/turtle1/teleport_absolute",
        "/turtle1/teleport_relative",
    }


def test_poses_at_the_rate_of_the_original(scene: Scene) -> None:
    watcher = scene.watch()
    assert watcher.wait_for() == Pose(START, START, 0.0, 0.0, 0.0)
    began = scene.user.now()
    for _ in range(125):
        watcher.wait_for()
    # Late ones are made up for; a machine that is busy all the time is slower.
    assert (scene.user.now() - began) / 1e9 > 1.0


def test_a_command_moves_it_for_a_second(scene: Scene) -> None:
    watcher = scene.watch()
    commands = scene.user.publisher("turtle1/cmd_vel", Twist, queue_size=1)
    commands.wait_for_subscribers()
    commands.publish(FORWARD)
    moving = watcher.wait_for(lambda pose: pose.linear_velocity)
    assert (moving.linear_velocity, moving.angular_velocity) == (2.0, 0.0)
    stopped = watcher.wait_for(lambda pose: not pose.linear_velocity)
    assert stopped.x > START  # how far, tests/turtles/test_world.py tells
    assert stopped.y == START


def test_it_moves_left_and_turns(scene: Scene) -> None:
    watcher = scene.watch()
    commands = scene.user.publisher("turtle1/cmd_vel", Twist, queue_size=1)
    commands.wait_for_subscribers()
    commands.publish(Twist(Vector3(y=1.5, z=9.0), Vector3(x=9.0, z=0.5)))
    pose = watcher.wait_for(lambda pose: pose.linear_velocity)
    assert (pose.linear_velocity, pose.angular_velocity) == (1.5, 0.5)
    assert pose.y > START


def test_walls_are_logged(scene: Scene, capfd: pytest.CaptureFixture[str]) -> None:
    watcher = scene.watch()
    scene.call("turtle1/teleport_absolute", TeleportAbsolute, 99.0, 5.0, 0.0)
    assert watcher.wait_for(lambda pose: pose.x > START).x == pytest.approx(SIZE)
    scene.sim.close()
    written = "".join(capfd.readouterr())
    assert "Oh no! I hit the wall! (Clamping from [x=99.000000, y=6.088889])" in written


def test_invalid_commands_are_ignored(scene: Scene) -> None:
    watcher = scene.watch()
    logged: SimpleQueue[Log] = SimpleQueue()
    scene.user.subscription("/rosout", Log, logged.put, qos=ROSOUT)
    commands = scene.user.publisher("turtle1/cmd_vel", Twist, queue_size=1)
    commands.wait_for_subscribers()
    commands.publish(Twist(Vector3(x=math.nan), Vector3()))
    while "ignoring a command for [turtle1]: forward is 'nan'" not in logged.get(timeout=60).msg:
        pass
    commands.publish(Twist(Vector3(), Vector3(z=1.0)))
    assert watcher.wait_for(lambda pose: pose.angular_velocity).x == START


def test_invalid_requests_are_refused(scene: Scene) -> None:
    with pytest.raises(ServiceError, match="theta is 'inf': expected a finite number"):
        scene.call("turtle1/teleport_absolute", TeleportAbsolute, 1.0, 1.0, math.inf)
    with pytest.raises(ServiceError, match="x is 'nan'"):
        scene.call("spawn", Spawn, math.nan, 1.0, 0.0, "")


def test_spawn_and_kill(scene: Scene) -> None:
    assert scene.call("spawn", Spawn, 5.0, 4.0, 0.8, "new_turtle").name == "new_turtle"
    pose = scene.watch("new_turtle").wait_for()
    assert (pose.x, pose.y, pose.theta) == pytest.approx((5.0, 4.0, 0.8))
    assert scene.call("spawn", Spawn, 1.0, 1.0, 0.0, "").name == "turtle2"
    before = served(scene)
    assert {"/turtle2/cmd_vel", "/new_turtle/set_pen"} <= before
    scene.call("kill", Kill, "new_turtle")
    left = {name for name in before if not name.startswith("/new_turtle/")}
    eventually(lambda: served(scene) == left, "the topics of the killed turtle are gone")
    with pytest.raises(ServiceNotFound):
        scene.call("new_turtle/teleport_relative", TeleportRelative, 1.0, 0.0)


def test_invalid_names(scene: Scene, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ServiceError, match=r"a turtle named \[turtle1\] already exists"):
        scene.call("spawn", Spawn, 1.0, 1.0, 0.0, "turtle1")
    with pytest.raises(ServiceError, match="is not a valid name"):
        scene.call("spawn", Spawn, 1.0, 1.0, 0.0, "a turtle")
    with pytest.raises(ServiceError, match="kill turtle"):
        scene.call("kill", Kill, "nobody")
    assert not [name for name in served(scene) if "turtle1" not in name and name.count("/") > 1]
    scene.sim.close()
    written = "".join(capfd.readouterr())
    assert "A turtle named [turtle1] already exists" in written
    assert "Tried to kill turtle [nobody], which does not exist" in written
    assert "Traceback" not in written


def test_reset_keeps_the_topics_of_the_first(scene: Scene) -> None:
    watcher = scene.watch()
    publishers = [
        token.entity_id for token in scene.user.context.graph.refresh().publishers("/turtle1/pose")
    ]
    scene.call("spawn", Spawn, 1.0, 1.0, 0.0, "other")
    scene.call("turtle1/teleport_absolute", TeleportAbsolute, 1.0, 2.0, 0.5)
    watcher.wait_for(lambda pose: pose.x == 1.0)
    scene.call("reset", Empty)
    assert watcher.wait_for(lambda pose: pose.x == START).theta == 0.0
    graph = scene.user.context.graph
    view = graph.wait_for(
        lambda view: not view.publishers("/other/pose"), TIMEOUT, "no other turtle"
    )
    assert [token.entity_id for token in view.publishers("/turtle1/pose")] == publishers


def test_reset_brings_the_first_back(scene: Scene) -> None:
    scene.call("kill", Kill, "turtle1")
    eventually(lambda: not [name for name in served(scene) if "turtle1" in name], "no turtle1")
    scene.call("reset", Empty)
    assert scene.watch().wait_for().x == START


def test_background_parameters(scene: Scene) -> None:
    params = scene.user.params
    channels = [f"/turtlesim/background_{channel}" for channel in "rgb"]
    assert [params[name] for name in channels] == [69, 86, 255]
    params["/turtlesim/background_g"] = 255
    assert image_of(scene).at(0, 0) == (69, 86, 255)
    scene.call("clear", Empty)
    assert image_of(scene).at(0, 0) == (69, 255, 255)


def test_parameters_set_before_the_start_are_used(network: Network) -> None:
    network.node("before").params["/turtlesim/background_r"] = 1
    node = network.node("turtlesim")
    Simulator(node)
    assert node.params.get("~") == {"background_r": 1, "background_g": 86, "background_b": 255}
    user = network.node("user")
    wait_for_turtle(user, "/turtle1")
    image = png.read(fetch(user.context.session, user.context.domain).png)
    assert image.at(0, 0) == (1, 86, 255)


@pytest.mark.parametrize(
    ("value", "red"), [("blue", 69), (True, 69), (1000, 255), (-1, 0), (7.6, 8), (math.nan, 69)]
)
def test_invalid_backgrounds(scene: Scene, value: object, red: int) -> None:
    scene.sim.params["~background_r"] = value
    scene.call("clear", Empty)
    assert image_of(scene).at(0, 0)[0] == red


def test_pen_and_color_sensor(scene: Scene) -> None:
    colors: list[Color] = []
    scene.user.subscription("turtle1/color_sensor", Color, colors.append)
    watcher = scene.watch()
    eventually(lambda: colors, "a colour")
    assert colors[-1] == Color(69, 86, 255)
    scene.call("turtle1/set_pen", SetPen, 255, 0, 0, 9, 0)
    scene.call("turtle1/teleport_relative", TeleportRelative, 3.0, 0.0)
    eventually(lambda: colors[-1] == Color(255, 0, 0), "a red line")
    scene.call("turtle1/set_pen", SetPen, 0, 0, 0, 0, 1)
    scene.call("turtle1/teleport_relative", TeleportRelative, 2.0, math.pi / 2)
    eventually(lambda: colors[-1] == Color(69, 86, 255), "the background")
    watcher.wait_for(lambda pose: pose.y > START + 1)
    image = image_of(scene)
    assert image.at(300, 246) == (255, 0, 0)
    assert image.at(385, 200) == (69, 86, 255)


def test_pictures_by_name(network: Network) -> None:
    user = network.node("user")
    session, domain = user.context.session, user.context.domain
    with pytest.raises(NotFoundError, match="no turtlesim is running: start"):
        fetch(session, domain)
    for namespace in ("one", "two"):
        Simulator(network.node("sim", namespace=namespace))
        Watcher(user, f"/{namespace}/turtle1").wait_for()  # published after pictures are served
    assert fetch(session, domain, "/two/sim").node == "/two/sim"
    with pytest.raises(UsageError, match="by --node: /one/sim, /two/sim"):
        fetch(session, domain)
    with pytest.raises(NotFoundError, match="did you mean '/one/sim'"):
        fetch(session, domain, "/ones/sim")


def test_spawning_killing_and_stepping_at_once(scene: Scene) -> None:
    failed: list[BaseException] = []

    def churn(name: str) -> None:
        try:
            for _ in range(5):
                scene.call("spawn", Spawn, 1.0, 1.0, 0.0, name)
                scene.call("kill", Kill, name)
        except Exception as error:  # noqa: BLE001  # told below
            failed.append(error)

    threads = [threading.Thread(target=churn, args=(f"t{number}",)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed
    first = {name for name in served(scene) if "turtle1" in name or not name.startswith("/t")}
    eventually(lambda: served(scene) == first, "only the first turtle is left")
    scene.watch().wait_for()


def test_reset_may_be_called_as_soon_as_it_is_served(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = network.node("turtlesim")
    serve = node.service

    def serve_and_call(name: str, service_type: Any, handler: Callable[[Any], Any]) -> Service:
        service = serve(name, service_type, handler)
        if name == "reset":
            handler(Empty.Request())
        return service

    monkeypatch.setattr(node, "service", serve_and_call)
    _, _, (turtle,) = Simulator(node).view(0)
    assert (turtle.x, turtle.y) == (START, START)
