"""Full disks and no more descriptors: what a node cannot have, it does without, and says so."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from network import Network, Program, eventually

from rosz.errors import PartlyWritten
from rosz.msgs.std_msgs.msg import String


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of one megabyte."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(place)]
    if os.geteuid() != 0 or shutil.which("mount") is None:
        pytest.skip("only root can make a small disk")
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no file system can be mounted here")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def fill(disk: Path) -> Path:
    """Leave no room on a disk, by a file that is returned."""
    filler = disk / "filler"
    with filler.open("wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            return filler


def test_no_room_for_logs(network: Network, small_disk: Path) -> None:
    """One word about it; the node goes on, and so does its log once there is room."""
    program = network.program(
        """
        import sys
        import rosz
        with rosz.Node("writer") as node:
            print("up")
            for line in sys.stdin:
                for number in range(2000):
                    node.log.debug("x" * 100)
                    node.log.info("%s %d", line.strip(), number)
                print("did", line.strip())
        """,
        ROS_LOG_DIR=str(small_disk),
    )
    program.wait_for("up")
    filler = fill(small_disk)
    program.say("full")
    program.wait_for("did full")
    program.wait_for("No space left")  # may come after what made it so
    told = [line for line in program.output.splitlines() if "No space left" in line]
    assert len(told) == 1, told
    filler.unlink()
    program.say("empty")
    program.wait_for("did empty")
    (file,) = small_disk.glob("writer*.log")
    eventually(lambda: "empty 1999" in file.read_text(), "the log to go on")
    assert "Traceback" not in program.output


CORE = ("-m", "rosz", "core", "--store")


def test_no_room_for_the_store(network: Network, small_disk: Path) -> None:
    """What cannot be kept is said; what was kept is there after kill -9."""
    store = str(small_disk / "params.db")
    core = network.run(*CORE, store)
    core.wait_for("started core")
    node = network.node()
    node.params.set("/early", "kept")
    filler = fill(small_disk)
    with pytest.raises(PartlyWritten, match=r"'/large' is written, .*(full|No space left)"):
        node.params.set("/large", "x" * 600_000)
    assert node.params.get("/early") == "kept"
    filler.unlink()
    core.wait_for("parameters are saved again")
    node.params.set("/late", "kept")
    eventually(lambda: core.process.poll() is None, "the core")
    core.kill()
    node.close()
    again = network.run(*CORE, store)
    again.wait_for("started core")
    assert ask(network, "/early") == "kept"
    assert ask(network, "/late") == "kept"


def ask(network: Network, name: str) -> str:
    program = network.run("-m", "rosz", "param", "get", name)
    assert program.exit_code() == 0, program.output
    return program.output


def test_no_more_descriptors(network: Network) -> None:
    """A node that can open nothing goes on with what it has; newcomers reach it afterwards."""
    hungry = network.program(
        """
        import os, resource, sys
        import rosz
        from rosz.msgs.std_msgs.msg import String
        with rosz.Node("hungry") as node:
            out = node.publisher("chatter", String)
            node.timer(0.02, lambda event: out.publish("still here"))
            print("up")
            taken = []
            for line in sys.stdin:
                if line.strip() == "take":
                    limit = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
                    resource.setrlimit(resource.RLIMIT_NOFILE, (200, limit))
                    try:
                        while True:
                            taken.append(os.open("/dev/null", os.O_RDONLY))
                    except OSError as error:
                        print("took", error.errno)
                else:
                    while taken:
                        os.close(taken.pop())
                    print("gave")
        """
    )
    hungry.wait_for("up")
    old = network.node("old")
    messages = iter(old.subscription("chatter", String))
    next(messages)
    hungry.say("take")
    hungry.wait_for("took 24")
    for _ in range(20):
        assert next(messages).data == "still here"
    new = network.program(LISTENER)
    hungry.say("give")
    hungry.wait_for("gave")
    new.wait_for("heard still here")
    assert "Traceback" not in hungry.output


LISTENER = """
    import rosz
    from rosz.msgs.std_msgs.msg import String
    with rosz.Node("new") as node:
        node.subscription("chatter", String, lambda message: print("heard", message.data))
        node.spin()
"""


@pytest.fixture
def clock(tmp_path: Path) -> Path:
    """A file that says by how much the clock of a program is wrong."""
    file = tmp_path / "clock"
    file.write_text("+0\n")
    return file


def faked(network: Network, clock: Path, script: str) -> Program:
    """Start a program whose clock goes wrong by what a file says at any time."""
    found = [*Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1")]
    if not found or sys.platform != "linux":
        pytest.skip("libfaketime is not installed")
    return network.program(
        script,
        LD_PRELOAD=str(found[0]),
        FAKETIME_TIMESTAMP_FILE=str(clock),
        FAKETIME_NO_CACHE="1",
        FAKETIME_DONT_FAKE_MONOTONIC="1",
    )


JUMPER = """
    import threading
    import time
    import rosz
    from rosz.msgs.std_msgs.msg import String

    starved = 0.0  # the longest that the machine has kept a thread from running

    def sleep():
        global starved
        while True:
            began = time.monotonic()
            time.sleep(0.02)
            starved = max(starved, time.monotonic() - began)

    threading.Thread(target=sleep, daemon=True).start()
    with rosz.Node("jumper") as node:
        out = node.publisher("chatter", String)
        last = time.monotonic()
        def tick(event):
            global last
            now = time.monotonic()
            if now - last > 1 + starved:
                print("a timer waited for", now - last)
            last = now
            out.publish(str(time.time()))
        node.timer(0.02, tick)
        node.params.set("/count", 0)
        print("up")
        for number in node.rate(20):
            node.params.set("/count", number)
"""


@pytest.mark.parametrize("jump", [3600.0, -3600.0], ids=["ahead", "back"])
def test_the_clock_jumps(network: Network, clock: Path, jump: float) -> None:
    """Timers, rates, messages and writes go on; nothing is stamped into oblivion."""
    jumper = faked(network, clock, JUMPER)
    jumper.wait_for("up")
    node = network.node("listener")
    messages = iter(node.subscription("chatter", String))
    before = float(next(messages).data)
    count = node.params.get("/count")
    clock.write_text(f"{jump:+g}\n")
    eventually(lambda: abs(float(next(messages).data) - before - jump) < 600, "the jump")
    eventually(lambda: node.params.get("/count") > count + 20, "the writes to go on")
    node.params.set("/count", -1)
    eventually(lambda: node.params.get("/count") > count + 25, "the writer to write after others")
    clock.write_text("+0\n")
    eventually(lambda: abs(float(next(messages).data) - before) < 600, "the jump back")
    later = node.params.get("/count")
    eventually(lambda: node.params.get("/count") > later + 20, "the writes to go on")
    assert "waited" not in jumper.output
