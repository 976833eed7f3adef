"""Machines on which something usual is missing: the IPv4 loopback, the home of the user."""

from __future__ import annotations

import re

from hosts.world import World

LAUNCH = """<launch>
  <node pkg="rosz_tutorials" type="subscriber.py" name="hears" output="screen"/>
</launch>"""


def test_a_machine_with_the_loopback_of_ipv6_alone(world: World) -> None:
    robot = world.host("robot")
    robot.namespace.run("ip", "address", "delete", "127.0.0.1/8", "dev", "lo")
    core = robot.rosz("core")
    core.wait_for("listening on tcp/[::1]:")
    core.wait_for("started core")
    file = robot.home / "one.launch"
    file.write_text(LAUNCH)
    launch = robot.rosz("launch", str(file))
    robot.rosz("run", "rosz_tutorials", "publisher.py")
    launch.wait_for("I heard")
    robot.rosz("bridge", "foxglove", "-p", "0").wait_for(re.compile(r"ws://\[::1\]:\d+"))
    core.kill()  # its nodes meet each other without it
    assert {"/publisher", "/hears"} <= set(robot.ask("node", "list").splitlines())


def test_a_service_without_a_home_logs_in_that_of_its_user(world: World) -> None:
    robot = world.host("robot")
    del robot.variables["HOME"]
    file = robot.home / "one.launch"
    file.write_text(LAUNCH)
    launch = robot.rosz("launch", str(file))
    launch.wait_for(f"logging to {robot.home}/.ros/log/")
    assert list((robot.home / ".ros/log").iterdir())
