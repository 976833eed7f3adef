"""What tests build once per machine, in a folder that outlives clones.

It is ``$ROSZ_TEST_CACHE``, or else ``rosz-tests`` in the user's folder of caches. The tests of a
part that cannot be built, as on a machine without network, skip.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest

__all__ = ("build_once", "old_zenoh", "run_step")

OLD_ZENOH = "eclipse-zenoh==1.7.2"
"""The newest release before 1.9 of which the registry has wheels."""
_STEP_SECONDS = 900


class _NotBuiltError(Exception):
    """A part cannot be built here."""


def _folder() -> Path:
    """Return the folder of all parts."""
    given = os.environ.get("ROSZ_TEST_CACHE")
    caches = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(given) if given else Path(caches) / "rosz-tests"


def build_once(name: str, sources: bytes, build: Callable[[Path], None]) -> Path:
    """Return the folder of a part, which is built if it is not there yet.

    A part that could not be built is tried again by each process of tests, once.

    Args:
        name: Name of the part.
        sources: What it is built from; another text makes another folder.
        build: Function that builds it into a folder.
    """
    place = _folder() / f"{name}-{sha256(sources).hexdigest()[:16]}"
    place.parent.mkdir(parents=True, exist_ok=True)
    with place.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        finished = place / "finished"
        if not finished.exists():
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir()
            try:
                build(place)
            except _NotBuiltError as error:
                pytest.skip(f"cannot build {name}: {error}")
            finished.touch()
    return place


def run_step(*command: str | Path, **variables: str) -> None:
    """Run a step of a build."""
    what = " ".join(map(str, command[:4]))
    try:
        done = subprocess.run(
            command,
            env={**os.environ, **variables},
            capture_output=True,
            text=True,
            timeout=_STEP_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise _NotBuiltError(f"{what}: {error}") from error
    if done.returncode:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["no output"]
        raise _NotBuiltError(f"{what}: {last[0]}")


def old_zenoh() -> Path:
    """Return a Python interpreter with a Zenoh as old as that of ROS 2 Jazzy."""

    def build(place: Path) -> None:
        run_step(sys.executable, "-m", "venv", place / "env")
        pip = (place / "env/bin/python", "-m", "pip", "install", "-q", "--only-binary", ":all:")
        run_step(*pip, OLD_ZENOH)

    sources = f"{OLD_ZENOH} {sys.version} {sys.executable}".encode()
    return build_once("old-zenoh", sources, build) / "env/bin/python"
