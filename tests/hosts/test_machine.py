"""``<machine>``: nodes on another machine, by a real ssh, and what becomes of them."""

from __future__ import annotations

import os
import re
import resource
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import pytest
from network import eventually, repeats

from hosts.host import Host, HostProgram
from hosts.sshd import befriend, install_rosz, serve_ssh
from hosts.world import World

SERVANTS = re.compile(r"sshd: |sshd \[|rosz core|rosz launch -|bash|sftp")
"""What runs on hosts beside the nodes and agents of a launch."""

EXAMPLE = Path(__file__).parents[2] / "launch/several_machines.launch"

SLEEPER = '<node pkg="tools" type="sleeper.sh" name="sleeper" machine="far" output="screen" {}/>'


class Scene(NamedTuple):
    """A laptop that may come into a robot by ssh."""

    laptop: Host
    robot: Host

    def launch(self, nodes: str, *options: str, machine: str = 'address="robot"') -> HostProgram:
        """Start a launch on the laptop."""
        file = self.laptop.home / "test.launch"
        file.write_text(f'<launch><machine name="far" {machine}/>{nodes}</launch>')
        return self.laptop.rosz("launch", *options, str(file))


def find_process(host: Host, command: str) -> int:
    """Return the process of a host whose command line begins so, by its number outside."""
    for pid in host.namespace.pids():
        with suppress(OSError):  # it ended meanwhile
            words = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
            if words.startswith(command):
                return pid
    pytest.fail(f"no process '{command}' on {host.name}")


def resident(pid: int) -> int:
    """Return the kilobytes of memory that a process has."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * resource.getpagesize() // 1024


def nodes_on(host: Host) -> list[str]:
    """Return what a launch has started on a host and not ended."""
    return [line for line in host.processes() if not SERVANTS.search(line)]


def kill_sleeper(host: Host) -> None:
    """Kill the node that sleeps, once it does."""
    eventually(lambda: any("sleep 1000" in line for line in nodes_on(host)), "the sleep")
    (pid,) = host.run("pgrep", "-x", "sleep").split()
    host.run("kill", "-9", pid)


def package(host: Host, **scripts: str) -> None:
    """Give a host a package ``tools`` of shell scripts, in its home as a workspace."""
    folder = host.home / "src/tools"
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>tools</name></package>")
    for name, text in scripts.items():
        script = folder / f"{name}.sh"
        script.write_text(f"#!/bin/bash\n{text}\n")
        script.chmod(0o755)


@pytest.fixture
def scene(world: World) -> Scene:
    laptop, robot = world.hosts("laptop", "robot")
    serve_ssh(robot)
    befriend(laptop, robot)
    install_rosz(robot)
    package(
        robot,
        sleeper='echo "asleep on $(hostname)"; exec sleep 1000',
        stubborn='trap "" INT TERM; echo still here; setsid sleep 1000 & while :; do sleep 1; done',
        show='echo "domain $ROS_DOMAIN_ID connect $ROSZ_CONNECT load $LOADED greet $GREET $*"',
        fail='echo "going down" >&2; exit 7',
        flood='exec yes "all of it, and no end in sight"',
        talk='for i in $(seq 20000); do echo "line $i of many, all of which arrive"; done',
    )
    return Scene(laptop, robot)


def core_of(laptop: Host) -> None:
    laptop.rosz("core", "--listen", "tcp/0.0.0.0:7447").wait_for("started core")


def test_nodes_run_there_and_are_one_system(scene: Scene) -> None:
    laptop, robot = scene
    core_of(laptop)
    began = time.monotonic()
    run = scene.launch(
        '<node pkg="rosz_tutorials" type="publisher.py" name="pub" machine="far"/>'
        '<node pkg="rosz_tutorials" type="subscriber.py" name="sub" output="screen"/>'
        '<param name="start" value="3"/>'
    )
    run.wait_for("I heard")
    print(f"launch on two machines: first message after {time.monotonic() - began:.2f} s")
    run.wait_for("process[pub-1]: started with pid [")
    assert "MACHINES\n * far\n" in run.output
    assert run.wait_for("process[pub-1]").endswith("] on robot")
    assert laptop.ask("node", "list").split() == ["/pub", "/sub"]
    table = laptop.ask("launch", "--status").splitlines()
    assert table[1].split()[-1] == "MACHINE"
    assert re.match(r"  /pub +running +\d+ +0 +\d+ % +\d+ MB .* robot$", table[2])
    assert table[3].split()[-1] == "laptop"
    assert (robot.home / ".ros/log/latest/pub-1-stdout.log").exists()
    run.send(signal.SIGINT)
    assert run.exit_code() == 0, run.output
    assert nodes_on(robot) == nodes_on(laptop) == []


def test_the_example(scene: Scene) -> None:
    laptop, robot = scene
    laptop.rosz("core", ROSZ_LISTEN="tcp/0.0.0.0:7447").wait_for("started core")
    run = laptop.rosz("launch", str(EXAMPLE), "robot:=robot")
    assert run.wait_for("process[publisher-1]").endswith("] on robot")
    run.wait_for("I heard 5")
    run.send(signal.SIGINT)
    assert run.exit_code() == 0, run.output
    assert nodes_on(robot) == nodes_on(laptop) == []


def test_output_ends_and_refusals_come_back(scene: Scene) -> None:
    run = scene.launch(
        '<node pkg="tools" type="fail.sh" name="fail" machine="far"/>'
        '<node pkg="tools" type="nothing.sh" name="nothing" machine="far"/>'
        '<node pkg="tools" type="talk.sh" name="talk" machine="far" output="screen"/>'
    )
    assert run.exit_code() == 1
    assert "going down" in run.lines
    assert re.search(r"\[fail-1\] process has died \[pid \d+, exit code 7", run.output)
    assert "log file: robot:" in run.output
    assert "ERROR: cannot launch node of type [tools/nothing.sh]: on 'robot': " in run.output
    told = [line for line in run.lines if line.startswith("line ")]
    wrong = [
        (number, line)
        for number, line in enumerate(told, 1)
        if line != f"line {number} of many, all of which arrive"
    ]
    assert (len(told), wrong[:1]) == (20000, [])
    assert "[talk-3] process has finished cleanly" in run.output
    assert nodes_on(scene.robot) == []


def test_the_environment_there(scene: Scene) -> None:
    loader = scene.robot.home / "env.sh"
    loader.write_text(
        f'#!/bin/sh\n. {scene.robot.home}/.profile\nexport LOADED=yes\necho noise\nexec "$@"\n'
    )
    loader.chmod(0o755)
    scene.laptop.variables["ROS_DOMAIN_ID"] = "17"
    core_of(scene.laptop)
    run = scene.launch(
        '<node pkg="tools" type="show.sh" name="show" output="screen" args="$(find tools)">'
        '<env name="GREET" value="hello there"/></node>'
        '<rosparam command="load" file="$(find tools)/p.yaml"/>',
        machine=f'address="robot" env-loader="{loader}" user="root" timeout="20" default="true"',
    )
    assert run.exit_code() == 1
    assert "package 'tools' not found" in run.output  # resolved here, as roslaunch does
    package(scene.laptop)
    (scene.laptop.home / "src/tools/p.yaml").write_text("speed: 4\n")
    variables = {"ROSZ_PACKAGE_PATH": str(scene.laptop.home / "src")}
    run = scene.laptop.rosz("launch", str(scene.laptop.home / "test.launch"), **variables)
    here = scene.laptop.home / "src/tools"
    address = scene.laptop.address
    assert run.wait_for("domain").startswith(
        f"domain 17 connect tcp/{address}:7447 load yes greet hello there {here} __name:=show"
    )
    assert run.exit_code() == 0, run.output


def test_machines_of_the_command_line(scene: Scene) -> None:
    node = SLEEPER.format("").replace('machine="far"', "")
    run = scene.launch(node, "--machine", "root@robot")
    run.wait_for("asleep on robot")
    run.send(signal.SIGINT)
    assert run.exit_code() == 0
    run = scene.launch(
        SLEEPER.format(""), "--machine", "far=root@robot:22", machine='address="nowhere"'
    )
    run.wait_for("asleep on robot")
    run.kill()
    run = scene.launch(SLEEPER.format(""), "--machine", "fare=robot")
    assert run.exit_code() == 2
    assert "--machine: no file declares a machine 'fare'; did you mean 'far'?" in run.output


def test_a_node_there_respawns_and_is_required(scene: Scene) -> None:
    run = scene.launch(
        '<node pkg="tools" type="fail.sh" name="fail" machine="far" respawn="true"/>'
        '<node pkg="tools" type="sleeper.sh" name="sleeper" machine="far" required="true"/>'
    )
    run.wait_for("[fail-1] restarting process", times=2)
    kill_sleeper(scene.robot)
    assert run.exit_code() == 1
    assert "REQUIRED process [sleeper-2] has died!" in run.output
    assert nodes_on(scene.robot) == []


def test_ctrl_c_ends_what_will_not_end(scene: Scene) -> None:
    run = scene.launch(
        '<node pkg="tools" type="stubborn.sh" name="stubborn" machine="far" output="screen"/>',
        *("--sigint-timeout", "0.3", "--sigterm-timeout", "0.3"),
    )
    run.wait_for("still here")
    run.send(signal.SIGINT)
    assert run.exit_code() == 0, run.output
    assert "[stubborn-1] escalating to SIGKILL" in run.output
    assert nodes_on(scene.robot) == []


def test_nobody_reads_what_comes_from_there(scene: Scene) -> None:
    """A screen that takes nothing holds up neither the end of nodes nor memory."""
    nodes = '<node pkg="tools" type="flood.sh" name="flood" machine="far" output="screen"/>'
    (scene.laptop.home / "test.launch").write_text(
        f'<launch><machine name="far" address="robot"/>{nodes}</launch>'
    )
    python, file = sys.executable, scene.laptop.home / "test.launch"
    options = "--sigint-timeout 0.5 --sigterm-timeout 0.5"
    command = f"{python} -m rosz launch {options} {file} | exec sleep 1000"
    scene.laptop.execute("bash", "-c", command)
    launch = f"-m rosz launch {options}"
    eventually(lambda: any("no end in sight" in line for line in nodes_on(scene.robot)), "the node")
    pid = find_process(scene.laptop, f"{python} {launch}")
    first = last = resident(pid)
    since = time.monotonic()

    def still() -> bool:
        """Tell whether it has taken in nothing for a while."""
        nonlocal last, since
        now, memory = time.monotonic(), resident(pid)
        if memory != last:
            last, since = memory, now
        return now - since > 2

    eventually(still, "an end of what it reads", 60)
    assert last - first < 50_000
    os.kill(pid, signal.SIGINT)
    eventually(lambda: nodes_on(scene.robot) == [], "the end of the node there", 60)
    eventually(lambda: not any(launch in line for line in nodes_on(scene.laptop)), "its end", 60)


@pytest.mark.parametrize("again", range(repeats(1, 10)))
def test_a_killed_launch_leaves_nothing_there(scene: Scene, again: int) -> None:
    del again
    run = scene.launch(
        SLEEPER.format("")
        + '<node pkg="tools" type="stubborn.sh" name="s" machine="far" output="screen"/>',
        *("--sigint-timeout", "0.3", "--sigterm-timeout", "0.3"),
    )
    run.wait_for("asleep on robot")
    run.wait_for("still here")
    began = time.monotonic()
    run.kill()
    eventually(lambda: nodes_on(scene.robot) == [], "the end of all nodes there")
    print(f"killed launch: nothing left there after {time.monotonic() - began:.2f} s")


def test_a_killed_agent_takes_its_nodes_along(scene: Scene) -> None:
    run = scene.launch(
        SLEEPER.format("")
        + '<node pkg="tools" type="stubborn.sh" name="s" machine="far" output="screen"/>'
        + '<node pkg="rosz_tutorials" type="publisher.py" name="pub" machine="far" required="true"'
        ' launch-prefix="nice"/>'
    )
    run.wait_for("asleep on robot")
    run.wait_for("still here")
    run.wait_for("process[pub-3]: started with pid [")
    began = time.monotonic()
    os.kill(find_process(scene.robot, f"{sys.executable} -m rosz launch --agent"), signal.SIGKILL)
    run.wait_for("remote[robot-0]: 'robot' is lost: ")
    eventually(lambda: nodes_on(scene.robot) == [], "the end of all nodes there")
    print(f"killed agent: nothing left there after {time.monotonic() - began:.2f} s")
    assert run.exit_code() == 1
    found = re.search(
        r"\[sleeper-1\] process is lost with its machine \[pid \d+ on robot, ", run.output
    )
    assert found, run.output
    assert "exit code unknown, cmd" in run.output
    assert "REQUIRED process [pub-3] has died!" in run.output
    assert "has died [pid" not in run.output
    assert "/sleeper [sleeper-1] is lost with its machine after" in run.output


def lost(scene: Scene, lose: Callable[[], None], *, cut: bool) -> None:
    """Lose the robot during a launch, and see where that ends."""
    package(scene.laptop, here="echo here; exec sleep 1000")
    scene.laptop.variables["ROSZ_PACKAGE_PATH"] = str(scene.laptop.home / "src")
    run = scene.launch(
        SLEEPER.format('required="false"')
        + '<node pkg="tools" type="here.sh" name="here" output="screen"/>',
        *("--lost-after", "3", "--sigint-timeout", "0.5"),
    )
    run.wait_for("asleep on robot")
    run.wait_for("here")
    began = time.monotonic()
    lose()
    run.wait_for("remote[robot-0]: 'robot' is lost: ", 60)
    print(f"lost machine: noticed after {time.monotonic() - began:.2f} s")
    run.wait_for("[sleeper-1] process is lost with its machine [pid ")
    if cut:
        eventually(lambda: nodes_on(scene.robot) == [], "the end of the nodes there", 60)
        print(f"lost machine: its nodes had ended after {time.monotonic() - began:.2f} s")
    table = scene.laptop.ask("launch", "--status")
    assert re.search(r"/sleeper +ended: .*robot\n", table), table
    assert re.search(r"/here +running +.*laptop", table)
    run.send(signal.SIGINT)
    assert run.exit_code() == 0, run.output
    assert "machine 'far': 'robot' is lost: " in run.output.partition("DIED")[2]
    assert nodes_on(scene.laptop) == []


def test_a_reboot_of_the_far_side(scene: Scene) -> None:
    lost(scene, scene.robot.kill, cut=False)


def test_a_far_side_without_power(scene: Scene) -> None:
    lost(scene, scene.robot.power_off, cut=False)


def test_a_cut_cable(scene: Scene) -> None:
    lost(scene, scene.robot.link.cut, cut=True)


def test_a_link_that_comes_back_in_time_is_no_loss(scene: Scene) -> None:
    run = scene.launch(SLEEPER.format('required="true"'), "--lost-after", "20")
    run.wait_for("asleep on robot")
    scene.robot.link.cut()
    time.sleep(2)  # how long the link is cut
    scene.robot.link.heal()
    kill_sleeper(scene.robot)
    run.wait_for("REQUIRED process [sleeper-1] has died!")
    assert "is lost" not in run.output
    assert run.exit_code() == 1


def refused(scene: Scene, machine: str = 'address="robot"') -> str:
    """Return what a launch says that cannot have its machine."""
    run = scene.launch(
        SLEEPER.format("") + '<node pkg="rosz_tutorials" type="publisher.py" name="here"/>',
        machine=machine,
    )
    assert run.exit_code() == 1, run.output
    assert "process[" not in run.output
    assert "Traceback" not in run.output
    assert nodes_on(scene.laptop) == []
    return next(line for line in run.lines if line.startswith("ERROR: "))


def test_an_unknown_host_key(scene: Scene) -> None:
    known = scene.laptop.home / ".ssh/known_hosts"
    right = known.read_text()
    known.unlink()
    assert refused(scene) == (
        "ERROR: machine 'far': the host key of 'robot' is not known: run 'ssh robot' once, and"
        " compare its fingerprint"
    )
    scene.laptop.run("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", f"{known}.key")
    known.write_text(f"robot {Path(f'{known}.key.pub').read_text()}")
    assert "shows another host key than known_hosts has" in refused(scene)
    known.write_text(right)


def test_a_user_who_may_not_come_in(scene: Scene) -> None:
    assert refused(scene, 'address="robot" user="nobody"') == (
        "ERROR: machine 'far': 'robot' does not let user 'nobody' in without a password: run:"
        " ssh-copy-id nobody@robot"
    )


def test_a_password_is_not_used(scene: Scene) -> None:
    (scene.robot.home / ".ssh/authorized_keys").unlink()
    run = scene.launch(SLEEPER.format(""), machine='address="robot" password="secret"')
    assert run.exit_code() == 1
    assert "the password of machine 'far' is not used" in run.output
    assert "ssh-copy-id robot" in run.output
    assert "secret" not in run.output


def test_no_rosz_there(scene: Scene) -> None:
    (scene.robot.home / "bin/rosz").unlink()
    (scene.robot.home / ".profile").write_text("export PATH=/usr/bin:/bin\necho welcome\n")
    assert refused(scene).startswith("ERROR: machine 'far': no rosz on 'robot': install it there")
    told = refused(scene, 'address="robot" env-loader="/no/env.sh"')
    assert told.startswith("ERROR: machine 'far': env-loader '/no/env.sh' cannot be run on 'robot'")


def test_a_version_that_does_not_fit(scene: Scene) -> None:
    (scene.robot.home / "bin/rosz").write_text(
        '#!/bin/sh\necho \'{"type":"hello","protocol":99,"version":"9.9","host":"robot"}\'\n'
        "exec cat >/dev/null\n"
    )
    told = refused(scene)
    assert "rosz 9.9 on 'robot' does not work with rosz " in told
    assert told.endswith("install the same version on both")
    eventually(lambda: nodes_on(scene.robot) == [], "the end of the other agent")


def test_nobody_there(scene: Scene) -> None:
    assert "no ssh server answers at robot:2222" in refused(
        scene, 'address="robot" ssh-port="2222"'
    )
    assert "'atlantis' is not a known host name" in refused(scene, 'address="atlantis"')
    scene.robot.link.cut()
    assert "'robot' does not answer within 2 s" in refused(scene, 'address="robot" timeout="2"')


def test_nobody_else_reaches_an_agent(scene: Scene) -> None:
    """Nodes not in Python would have a master of ROS 1 there, which is part of the network."""
    script = scene.robot.home / "src/tools/sleeper.py"
    script.write_text(
        "#!/usr/bin/env python3\nimport time\nprint('asleep', flush=True)\ntime.sleep(1000)\n"
    )
    script.chmod(0o755)
    run = scene.launch(SLEEPER.format("").replace("sleeper.sh", "sleeper.py"))
    run.wait_for("asleep")
    assert scene.robot.listening() == ["0.0.0.0:22", "[::]:22"]
    assert scene.laptop.listening() == []
    ports = scene.robot.run("ss", "-Hlntx")
    assert "rosz" not in ports
    run.send(signal.SIGINT)
    assert run.exit_code() == 0


def test_a_far_side_that_will_not_find_this_launch(scene: Scene) -> None:
    run = scene.launch(SLEEPER.format(""))
    warning = run.wait_for("WARNING: remote[robot-0]: nodes there will not find this launch")
    assert "rosz core --listen tcp/0.0.0.0:7447" in warning
    run.wait_for("asleep on robot")
