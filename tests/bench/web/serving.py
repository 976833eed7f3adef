"""A server of pages that is measured."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path

from network import Network, Program

__all__ = ("TIMEOUT", "percent_used", "serve")

TIMEOUT = 180.0


def serve(network: Network) -> tuple[Program, str]:
    """Start a server; return it with its address."""
    server = network.run("-m", "rosz", "web", "--port", "0")
    found = re.search(r"http://\S+", server.wait_for("the page is at", TIMEOUT))
    assert found is not None
    return server, found.group().rstrip("/")


def percent_used(program: Program, seconds: float) -> float:
    """Return how much of a processor a program uses, in percent, over some seconds."""
    used, begun = _processor_seconds(program), time.monotonic()
    time.sleep(seconds)
    return 100 * (_processor_seconds(program) - used) / (time.monotonic() - begun)


def _processor_seconds(program: Program) -> float:
    fields = Path(f"/proc/{program.pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")
