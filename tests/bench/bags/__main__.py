"""How fast ``rosz bag record`` records, beside Debian's rosbag and the library ``mcap``.

Each line is one run: what was published, what is in the bag, CPU time and memory of the recorder.
``--images RATE…`` runs messages of 1 MB at these rates only, for two seconds each, also for rosz
with shared memory (``ROSZ_SHM``) and for a bare subscriber of Zenoh, which writes nothing.
With ``--real-time``, all run before the other programs of the machine, which takes root.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer

from rosz.bags import Channel, McapWriter, open_reader

from .conditions import prepare  # tests is no package

HERE = Path(__file__).parent
IMAGE = 1 << 20
RUNS = (
    (IMAGE, 50, 150),
    (IMAGE, 100, 300),
    (IMAGE, 200, 600),
    (0, 5000, 15_000),
    (0, 20_000, 60_000),
)
"""Size, rate and number of messages; size 0 is a Twist."""
SYSTEMS = ("rosz", "rosbag")
IMAGE_SYSTEMS = ("zenoh", "rosz", "rosz, shared memory", "rosbag")


def cpu_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def memory(pid: int, kind: str) -> int:
    """Return megabytes of memory of a kind that ``/proc/PID/status`` has."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith(kind):
            return round(int(line.split()[1]) / 1024)
    return 0


def commands(system: str, python: str, bag: Path) -> tuple[list[str], list[str]]:
    """Return the programs that publish and that record."""
    talker = str(HERE / "talker.py")
    if system == "zenoh":
        bare = [python, str(HERE / "bare.py")]
        return [*bare, "talker"], [*bare, "receiver", str(bag)]
    if system == "rosbag":
        return [python, talker, "rospy"], ["/usr/lib/rosbag/record", "/bench", "-O", str(bag)]
    record = [python, "-m", "rosz", "bag", "record"]
    return [python, talker, "rosz"], [*record, "/bench", "-O", str(bag)]


def count_of(system: str, bag: Path) -> int:
    """Return how many messages were recorded, or received by Zenoh alone."""
    if system == "zenoh":
        return int(bag.read_text())
    with open_reader(bag) as reader:
        return sum(reader.count(one) for one in reader.channels if one.topic == "/bench")


def run(system: str, size: int, rate: int, count: int, folder: Path) -> dict[str, Any]:
    """Record one publisher."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    ours = system != "rosbag"
    python = sys.executable if ours else "/usr/bin/python3"
    variables = dict(os.environ)
    started: list[subprocess.Popen[str]] = []
    if ours:
        variables |= {"ROS_DOMAIN_ID": "173", "ROSZ_RENDEZVOUS": f"tcp/127.0.0.1:{port}"}
        if "shared" in system:
            variables["ROSZ_SHM"] = "65536"
    else:
        variables |= {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1"}
        variables.pop("PYTHONPATH", None)

    def start(*command: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            command,
            env=variables,
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        started.append(process)
        return process

    try:
        if not ours:
            start("/usr/bin/rosmaster", "--core", "-p", str(port))
            time.sleep(3)
        words = map(str, (size, rate, count))
        bag = folder / ("x.mcap" if ours else "x.bag")
        talking, recording = commands(system, python, bag)
        talker = start(*talking, *words)
        assert talker.stdout is not None
        talker.stdout.readline()
        recorder = start(*recording)
        talker.stdout.readline()
        before, idle = cpu_seconds(recorder.pid), memory(recorder.pid, "VmRSS")
        kept = json.loads(talker.stdout.readline())["rate"]
        used, peak = cpu_seconds(recorder.pid) - before, memory(recorder.pid, "VmHWM")
        own = memory(recorder.pid, "RssAnon")
        recorder.send_signal(signal.SIGINT)
        recorder.wait(60)
        found = count_of(system, bag)
        megabytes = max(count * max(size, 52) / 1e6, 1e-9)
        bag.unlink()
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()
    return {
        "system": system,
        "size": size,
        "wanted/s": rate,
        "published/s": round(kept),
        "lost": count - found,
        "CPU ms/MB": round(used * 1000 / megabytes, 2),
        "CPU us/message": round(used * 1e6 / count, 1),
        "memory MB before, at most, of its own": (idle, peak, own),
        "load": round(os.getloadavg()[0], 1),
    }


def write_alone(folder: Path) -> dict[str, float]:
    """Return how many 1 MB messages per second are written: here, by the library, by the disk."""
    data, count = os.urandom(IMAGE), 300
    begun = time.perf_counter()
    with (folder / "raw").open("wb", buffering=0) as file:
        for _ in range(count):
            file.write(data)
    disk = count / (time.perf_counter() - begun)
    begun = time.perf_counter()
    with McapWriter(folder / "ours.mcap") as ours:
        handle = ours.add(Channel("/a", "std_msgs/msg/String"))
        for number in range(count):
            ours.write(handle, number, data)
    rate = count / (time.perf_counter() - begun)
    begun = time.perf_counter()
    library = Writer(str(folder / "library.mcap"), compression=CompressionType.NONE)
    library.start()
    channel = library.register_channel("/a", "cdr", 0)
    for number in range(count):
        library.add_message(channel, number, data, number)
    library.finish()  # type: ignore[no-untyped-call]
    other = count / (time.perf_counter() - begun)
    return {"rosz": round(rate), "mcap": round(other), "disk": round(disk)}


def chosen() -> tuple[tuple[str, ...], list[tuple[int, int, int]]]:
    """Return the systems and the runs that the command line asks for."""
    if "--images" not in sys.argv:
        return SYSTEMS, list(RUNS)
    rates = [int(one) for one in sys.argv if one.isdigit()]
    return IMAGE_SYSTEMS, [(IMAGE, rate, 2 * rate) for rate in rates]


def main() -> None:
    prepare()
    folder = Path(tempfile.mkdtemp(prefix="rosz-bench-"))
    try:
        print(json.dumps({"1 MB messages written per second": write_alone(folder)}))
        systems, runs = chosen()
        for size, rate, count in runs:
            for system in systems:
                if system == "rosbag" and not Path("/usr/lib/rosbag/record").exists():
                    continue
                print(json.dumps(run(system, size, rate, count, folder)), flush=True)
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
