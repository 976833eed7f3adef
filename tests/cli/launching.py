"""What tests of ``rosz launch`` as a process share."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

from network import Network, Program

from .command import ROOT, ROSZ

EXAMPLE = str(ROOT / "launch/pub_and_sub.launch")
Start = Callable[..., Program]


def started(program: Program) -> dict[str, int]:
    """Return label and process id of all that a launch has started, the last of each."""
    found = re.findall(r"process\[(.*)-\d+\]: started with pid \[(\d+)\]", program.output)
    return {label: int(pid) for label, pid in found}


def runs(pid: int) -> bool:
    """Tell whether a process runs."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):  # gone before, or between opening and reading
        return False


def rosz(network: Network, *words: str) -> subprocess.CompletedProcess[str]:
    """Run another command on the network."""
    return subprocess.run(
        [*ROSZ, *words],
        env=network.variables(),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
