"""The commands beside ROS 1's: ``python -m tests.bench.commands [ROUNDS]``.

Starts the same nodes in both worlds (those of ``tests/cli/side_by_side``), then runs each command
in both in turn, round by round, from the start of its process to the end; the medians are printed
with their ratio. Where ROS 1 is not installed, only rosz is measured.
"""

from __future__ import annotations

import contextlib
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from ..figures import OWN, Figure, busy, table  # noqa: TID252  # tests is no package

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT / "tests"))

from cli.side_by_side.worlds import Ros1, Rosz, World  # noqa: E402  # found by the line above
from network import TIMEOUT  # noqa: E402

ROS1 = "ROS 1"
AIM = "0.6"
COMMANDS = {
    "param get /robot/name": f"{AIM}, and 130 ms",
    "param list": "-",
    "param set /robot/count 3": "-",
    "topic list": AIM,
    "topic echo -n 1 /robot/pose": "-",
    "service list": AIM,
    "node list": AIM,
    "msg show std_msgs/Header": AIM,
    "launch --nodes {launch}": AIM,
}
LAUNCH = """\
<launch>
  <arg name="count" default="2"/>
  <group ns="left"><node pkg="rosz_tutorials" type="publisher.py" name="publisher"/></group>
  <node pkg="rosz_tutorials" type="subscriber.py" name="subscriber" args="$(arg count)"/>
</launch>
"""
RATES = (10, 1000, 20_000)
SECONDS = 5
"""How long each rate is measured; of that the first and the last second do not count."""


def seconds(world: World, line: str) -> float:
    """Return how long a command takes."""
    begun = time.perf_counter()
    done = subprocess.run(
        world.command(line), env=world.environ, cwd=world.folder, capture_output=True, check=False
    )
    taken = time.perf_counter() - begun
    if done.returncode:
        sys.exit(f"'{line}' fails: {done.stderr.decode()}")
    return taken


def speeds(ours: World, theirs: World | None, rounds: int) -> Iterator[Figure]:
    """Measure each command in both worlds."""
    file = ours.folder / "bench.launch"
    file.write_text(LAUNCH)
    for line, aim in COMMANDS.items():
        figure = Figure(line.partition(" {")[0], "ms", {ROS1: aim})
        for _ in range(rounds):
            figure.add(OWN, seconds(ours, line.format(launch=file)))
            if theirs is not None:
                figure.add(ROS1, seconds(theirs, line.format(launch=file)))
        yield figure
    figure = Figure("--help", "ms", {"": "100 ms"})
    for _ in range(rounds):
        figure.add(OWN, seconds(ours, "--help"))
    yield figure
    figure = Figure("complete 'rostopic echo /'", "ms", {"": "200 ms"})
    for _ in range(rounds):
        begun = time.perf_counter()
        subprocess.run(
            [*ours.command("complete bash"), "rostopic echo /"],
            env=ours.environ,
            stdout=subprocess.DEVNULL,
            check=True,
        )
        figure.add(OWN, time.perf_counter() - begun)
    yield figure


def truths(world: World) -> Iterator[Figure]:
    """Compare what ``topic hz`` says with what a publisher counts."""
    for rate in RATES:
        pacer = world.start(sys.executable, str(Path(__file__).with_name("pacer.py")), str(rate))
        hz = world.start(*world.command("topic hz -w 1000000 /paced"))
        hz.wait_for("")  # that it has subscribed
        pacer.wait_for("", 2 * SECONDS + TIMEOUT, after=SECONDS)
        told = [float(line) for line in pacer.lines[1 : SECONDS + 1]]
        for program in (hz, pacer):
            program.send(signal.SIGTERM)
            program.exit_code()
        said = [
            float(line.partition(":")[2]) for line in hz.lines if line.startswith("average rate")
        ]
        figure = Figure(f"topic hz of what goes out at {rate} Hz", "Hz", {"publisher": "1 ± 0.01"})
        figure.add(OWN, said[-1])
        figure.add("publisher", statistics.mean(told))
        yield figure


def main() -> None:
    """Measure all, and print the table."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    with contextlib.ExitStack() as stack:
        ours = stack.enter_context(Rosz())
        theirs = stack.enter_context(Ros1()) if Ros1.available() else None
        figures = [*speeds(ours, theirs, rounds)]
    with Rosz() as ours:
        figures += truths(ours)
    sys.stdout.write(f"{table(figures)}\n\n{busy()}\n")


if __name__ == "__main__":
    main()
