"""The launch files in ``launch/`` that need one machine; `hosts.test_machine` has the other one."""

from __future__ import annotations

import re
import signal

import pytest
from network import Network, Program, eventually

from rosz.msgs.std_msgs.msg import Float64
from rosz.msgs.turtlesim.msg import Pose
from rosz.reconfigure import Client

from .command import ROOT
from .launching import Start, runs, started

EXAMPLES = ROOT / "launch"
TESTED = (
    "parameters",
    "pub_and_sub",
    "reconfigure",
    "services",
    "several_machines",
    "turtle_mimic",
)


@pytest.fixture
def example(launch: Start) -> Start:
    """Starts an example by its name."""

    def start(name: str, *args: str) -> Program:
        return launch(str(EXAMPLES / f"{name}.launch"), *args)

    return start


def end(run: Program) -> None:
    """End an example as a person does, and check that nothing of it is left."""
    pids = started(run)
    run.send(signal.SIGINT)
    assert run.exit_code() == 0, run.output
    assert not any(map(runs, pids.values()))
    assert "Traceback" not in run.output
    assert "WARNING" not in run.output


def test_every_example_has_a_test() -> None:
    assert tuple(sorted(file.stem for file in EXAMPLES.iterdir())) == TESTED


def test_services(example: Start) -> None:
    run = example("services", "rate:=20")
    run.wait_for("[client-2] waiting for service /add_two_ints")
    run.wait_for("7 + 7 = 14")
    run.wait_for(re.compile(r"7 \+ 7$"))  # the log of the server
    end(run)


def test_parameters(example: Start, network: Network) -> None:
    run = example("parameters", "speed:=0.5", "slow:=true")
    run.wait_for("unit is {")
    run.wait_for("marvin is ready")
    run.wait_for("speed is 0.25")
    run.wait_for("serial is '007'")
    with network.node("asker") as node:
        params = node.context.params
        assert params.get("/robot/gripper") == {"force": 20, "width": 0.12}
        params.set("/robot/watcher/speed", 0.9)
        run.wait_for("/robot/watcher/speed changed from 0.25 to 0.9")
    end(run)


def test_reconfigure(example: Start, network: Network) -> None:
    run = example("reconfigure", "amplitude:=3")
    run.wait_for("amplitude 3.0, frequency 0.5 Hz")
    with network.node("asker") as node:
        values: list[float] = []
        node.subscription("/wave", Float64, lambda message: values.append(message.data))
        with Client(node, "/wave") as client:
            client.update({"amplitude": 8.0, "frequency": 5.0})
        run.wait_for("amplitude 8.0, frequency 5.0 Hz")
        eventually(lambda: max(map(abs, values), default=0.0) > 3.0, "a higher wave")
        assert max(map(abs, values)) <= 8.0
    end(run)


def test_turtle_mimic(example: Start, network: Network) -> None:
    with network.node("asker") as node:
        first = node.subscription("/turtlesim1/turtle1/pose", Pose)
        second = node.subscription("/turtlesim2/turtle1/pose", Pose)
        run = example("turtle_mimic", "headless:=true")
        eventually(lambda: first.get().theta > 0.5, "a turn of the first turtle")
        eventually(lambda: second.get().theta > 0.5, "the same turn of the second one")
    end(run)
