"""A new user with two machines, who types what the manual says."""

from __future__ import annotations

import signal
import sys

import pytest
from network import eventually

from hosts.host import Host, HostProgram
from hosts.manual import block, line, word
from hosts.scripts import LISTENER, TALKER
from hosts.sshd import befriend, install_rosz, serve_ssh
from hosts.world import World


def type_in(host: Host, command: str) -> HostProgram:
    """Type a line into a terminal of a host, in the home folder."""
    own = "exec " if command.startswith("rosz ") and "&&" not in command else ""
    return host.execute("bash", "-lc", f"cd && {own}{command}")


def output_of(host: Host, command: str) -> list[str]:
    """Type a line whose command must end well, and return what it prints."""
    program = type_in(host, command)
    code = program.exit_code()
    assert code == 0, f"{command}: exit code {code}\n{program.output}"
    return program.lines


def core(host: Host, beginning: str) -> list[str]:
    """Start a core as the manual says, and return what it says."""
    started = type_in(host, line(beginning))
    started.wait_for("started core")
    return started.lines


def setting(host: Host, export: str) -> None:
    """Have an ``export`` in the profile of a host."""
    with (host.home / ".profile").open("a") as file:
        file.write(f"export {export}\n")


def wait_for_nodes(host: Host, *names: str) -> None:
    eventually(lambda: output_of(host, "rosz node list") == [*names], "one graph")


@pytest.fixture
def machines(world: World) -> tuple[Host, Host]:
    """``robot1`` and ``laptop``, with rosz on each."""
    robot, laptop = world.hosts("robot1", "laptop")
    for host in (robot, laptop):
        install_rosz(host)
    return robot, laptop


def test_a_core_on_each(machines: tuple[Host, Host]) -> None:
    robot, laptop = machines
    said = core(robot, "rosz core --listen")
    assert said[:2] == ["listening on tcp/0.0.0.0:7447", "listening on tcp/[::1]:7447"]
    assert core(laptop, "rosz core --connect")[1].endswith(" tcp/robot1:7447")
    robot.program(TALKER).wait_for("talking")
    listener = laptop.program(LISTENER)
    listener.wait_for("heard")
    for host in machines:
        wait_for_nodes(host, "/listener", "/talker")
    output_of(laptop, "rosz param set /speed 3")
    assert output_of(robot, "rosz param get /speed") == ["3"]
    laptop.link.cut()
    own = laptop.program(TALKER, "own", "own")
    own.wait_for("talking")
    assert output_of(laptop, "rosz topic echo -n 1 /own")
    assert output_of(laptop, "rosz param get /speed") == ["3"]


def test_without_a_core_of_its_own(machines: tuple[Host, Host]) -> None:
    robot, laptop = machines
    core(robot, "rosz core --listen")
    robot.program(TALKER).wait_for("talking")
    assert output_of(laptop, line("ROSZ_CONNECT=")) == ["/chatter", "/rosout"]


def user_pi(robot: Host) -> None:
    """Give a robot a user ``pi``, with a home and what loads the environment there."""
    robot.run("mount", "-t", "tmpfs", "tmpfs", "/home")
    with (robot.home / ".passwd").open("a") as file:
        file.write("pi:x:0:0::/home/pi:/bin/bash\n")
    load = f'#!/bin/sh\n. {robot.home}/.profile\nexec "$@"\n'
    keys = (robot.home / ".ssh/authorized_keys").read_text()
    robot.run("mkdir", "-p", "-m", "700", "/home/pi/.ssh")
    robot.namespace.write("/home/pi/.ssh/authorized_keys", keys)
    robot.namespace.write("/home/pi/env.sh", load)
    robot.run("chmod", "755", "/home/pi/env.sh")
    robot.run("cp", f"{robot.home}/.profile", "/home/pi/.profile")


def test_nodes_on_another_machine(world: World, machines: tuple[Host, Host]) -> None:
    robot, laptop = machines
    second = world.host("robot2")
    install_rosz(second)
    for host in (robot, second):
        serve_ssh(host)
        befriend(laptop, host)
        user_pi(host)
    core(laptop, "rosz core --listen")
    node = line("<node").replace('"..."', '"{}"').format("rosz_tutorials", "publisher.py", "pub")
    hear = '<node pkg="rosz_tutorials" type="subscriber.py" name="sub" output="screen"/>'
    file = laptop.home / "file.launch"
    file.write_text(f"<launch>{line('<machine')}{node}{hear}</launch>")
    run = type_in(laptop, "rosz launch file.launch")
    assert run.wait_for("process[pub-1]: started").endswith("on robot1")
    run.wait_for("I heard")
    end(run)
    run = type_in(laptop, line("rosz launch --machine far="))
    assert run.wait_for("process[pub-1]: started").endswith("on robot2")
    run.wait_for("I heard")
    end(run)
    anywhere = node.replace('machine="far"', "")
    file.write_text(f"<launch>{anywhere}{hear}</launch>")
    run = type_in(laptop, line("rosz launch --machine pi@"))
    assert run.wait_for("process[pub-1]: started").endswith("on robot1")
    assert run.wait_for("process[sub-2]: started").endswith("on robot1")
    run.wait_for("I heard")
    end(run)


def end(launch: HostProgram) -> None:
    """End a launch as Ctrl-C does."""
    launch.send(signal.SIGINT)
    assert launch.exit_code() == 0, launch.output


def keys(robot: Host, laptop: Host) -> None:
    """Make keys on the laptop, and have each machine use its own."""
    pytest.importorskip("cryptography", reason="keys are made with the extra 'keys'")
    serve_ssh(robot)
    befriend(laptop, robot)
    output_of(laptop, line("rosz keys init"))
    output_of(laptop, line("scp"))
    setting(robot, word(r"(ROSZ_KEYS=\S*rosz-keys)"))
    setting(laptop, word(r"(ROSZ_KEYS=\S*/laptop)"))


PUBLISHER = """
import sys
import rosz
from rosz.msgs.std_msgs.msg import String
with rosz.Node(sys.argv[1]) as node:
    topics = [node.publisher(name, String) for name in sys.argv[2:]]
    node.subscription("cmd_vel", String, lambda message: print("drives", flush=True))
    node.subscription("lift", String, lambda message: print("lifts", flush=True))
    print("up", flush=True)
    for tick in node.rate(20):
        for topic in topics:
            topic.publish(String(data=str(tick)))
"""


def test_keys_and_rules(machines: tuple[Host, Host]) -> None:
    robot, laptop = machines
    keys(robot, laptop)
    rules = robot.home / "rosz-keys/rules.yaml"
    rules.write_text(block("laptop:"))
    assert output_of(robot, "rosz keys check") == [
        "robot1: until " + until(robot),
        str(rules),
        "  laptop: publish /cmd_vel",
        "  laptop: subscribe /odom, /camera/**",
        "  laptop: call /reset",
        "  laptop: set /gains/**",
        "  laptop: get all parameters",
        "  operator: all",
        "1 holder of keys, 0 wrong",
    ]
    said = core(robot, "rosz core --listen")
    assert said[0] == "listening on tls/0.0.0.0:7447#iface=eth0"
    assert core(laptop, "rosz core --connect")[1].endswith(" tls/robot1:7447")
    base = script(robot, "robot", "odom", "camera/left", "secret")
    base.wait_for("up")
    output_of(robot, "rosz param set /gains/p 1 && rosz param set /pin 7")
    script(laptop, "driver", "cmd_vel", "lift").wait_for("up")
    base.wait_for("drives")
    for topic in ("odom", "camera/left"):
        assert output_of(laptop, f"rosz topic echo -n 1 /{topic}")
    assert "/secret" not in output_of(laptop, "rosz topic list")
    output_of(laptop, "rosz param set /gains/p 2")
    assert output_of(robot, "rosz param get /gains/p") == ["2"]
    assert output_of(laptop, "rosz param get /pin") == ["7"]
    type_in(laptop, "rosz param set /pin 0").exit_code()
    assert output_of(robot, "rosz param get /pin") == ["7"]
    assert "lifts" not in base.output


def script(host: Host, *argv: str) -> HostProgram:
    """Run a node in a terminal of a host."""
    file = host.home / "node.py"
    file.write_text(PUBLISHER)
    return type_in(host, f"{sys.executable} node.py {' '.join(argv)}")


def until(robot: Host) -> str:
    """Return when the key of a robot ends, as ``rosz keys list`` says."""
    return output_of(robot, "rosz keys list")[0].rpartition(" ")[2]


def test_nodes_on_another_machine_with_keys(machines: tuple[Host, Host]) -> None:
    robot, laptop = machines
    keys(robot, laptop)
    core(laptop, "rosz core --listen")
    file = laptop.home / "file.launch"
    file.write_text(
        '<launch><node pkg="rosz_tutorials" type="publisher.py" name="pub" machine="far"/>'
        '<machine name="far" address="robot1"/>'
        '<node pkg="rosz_tutorials" type="subscriber.py" name="sub" output="screen"/></launch>'
    )
    run = type_in(laptop, "rosz launch file.launch")
    assert run.wait_for("process[pub-1]: started").endswith("on robot1")
    run.wait_for("I heard")
    end(run)
