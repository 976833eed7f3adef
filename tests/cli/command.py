"""The ``rosz`` command as a process of its own, in a folder and an environment of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from network import free_port

ROOT = Path(__file__).parents[2]
ROSZ = [sys.executable, "-P", "-m", "rosz"]


def free_endpoint() -> str:
    """Return a rendezvous that nobody uses."""
    return f"tcp/127.0.0.1:{free_port()}"


def environ(folder: Path, **more: str) -> dict[str, str]:
    """Return variables that hide the ROS of this machine."""
    kept = {name: os.environ[name] for name in ("PATH", "LANG") if name in os.environ}
    return {**kept, "HOME": str(folder), "PYTHONPATH": str(ROOT), **more}


def rosz(
    folder: Path, *words: str, text: str = "", variables: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run one command to its end."""
    return subprocess.run(
        [*ROSZ, *words],
        cwd=folder,
        env=environ(folder, **(variables or {})),
        input=text,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def read_all(screen: int) -> bytes:
    """Return what is written to a terminal until its other side is closed, and close this one."""
    written = b""
    with os.fdopen(screen, "rb", buffering=0) as file, suppress(OSError):  # raised at the end
        while more := file.read(65536):
            written += more
    return written


def package(folder: Path, name: str, **scripts: str) -> Path:
    """Make a package with scripts; a double underscore in a name stands for a dot."""
    path = folder / name
    (path / "scripts").mkdir(parents=True)
    (path / "package.xml").write_text(f"<package><name>{name}</name></package>")
    for script, text in scripts.items():
        file = path / "scripts" / script.replace("__", ".")
        file.write_text(text)
        file.chmod(0o755)
    return path
