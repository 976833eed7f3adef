"""``python -m tests.bench.containers [ROUNDS]``: messages per second into a callback.

Two processes and one are measured in turn. With small messages two processes use two processors,
and one uses one, since Python runs on one at a time; there the gain is small.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from rosz.program import ProgramSpec

_NODE = str(Path(__file__).with_name("node.py"))
_ROUNDS = 5
_SYSTEMS = {
    "two processes": ("rosz", False),
    "one, by reference": ("rosz", True),
    "one, copies": ("rosz-copies", True),
    "two, rospy programs": ("rospy", False),
    "one, rospy programs": ("rospy", True),
    "one, rospy by ref.": ("rospy --by-reference", True),
}


def rate(library: str, kind: str, variables: dict[str, str], *, together: bool) -> float:
    """Return the messages per second that arrive."""
    quiet = {"env": variables, "stderr": subprocess.DEVNULL, "text": True}
    if together:
        import msgspec

        library, *options = library.split()
        specs = [
            msgspec.json.encode(
                ProgramSpec(name=role, script=_NODE, arguments=(role, library, kind))
            ).decode()
            for role in ("hear", "pour")
        ]
        command = [
            sys.executable,
            "-P",
            "-m",
            "rosz.script",
            "--container",
            "/bench",
            *options,
            *specs,
        ]
        found = subprocess.run(command, stdout=subprocess.PIPE, check=True, **quiet)  # type: ignore[call-overload]
        return float(found.stdout.split()[-1])
    script = [sys.executable, "-P", "-m", "rosz.script", _NODE]
    with subprocess.Popen([*script, "pour", library, kind], **quiet) as pour:  # type: ignore[call-overload]
        try:
            command = [*script, "hear", library, kind]
            found = subprocess.run(command, stdout=subprocess.PIPE, check=True, **quiet)  # type: ignore[call-overload]
        finally:
            pour.kill()
    return float(found.stdout.split()[-1])


def main() -> None:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else _ROUNDS
    for kind in ("Twist", "LaserScan", "Image"):
        found: dict[str, list[float]] = {name: [] for name in _SYSTEMS}
        for _ in range(rounds):
            for name, (library, together) in _SYSTEMS.items():
                with tempfile.TemporaryDirectory(prefix="rosz-") as folder:
                    variables = dict(
                        os.environ,
                        ROS_DOMAIN_ID="61",
                        ROSZ_RENDEZVOUS=f"unixsock-stream/{folder}/z.sock",
                        ROS_HOME=folder,
                    )
                    found[name].append(rate(library, kind, variables, together=together))
        base = {one: statistics.median(figures) for one, figures in found.items()}
        for name, median in base.items():
            other = base["two, rospy programs" if "rospy" in name else "two processes"]
            print(f"{kind:10} {name:20} {median:10.0f} per s  {median / other:6.1f} x")


if __name__ == "__main__":
    main()
