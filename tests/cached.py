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
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from unittest import SkipTest

__all__ = ("build_once", "hiroz_peer", "old_zenoh", "run_step", "zenohd")

OLD_ZENOH = "1.7.2"
"""The newest release before 1.9 of which the registry has wheels."""
_STEP_SECONDS = float(os.environ.get("ROSZ_TEST_BUILD_SECONDS", "900"))
_AGAIN_SECONDS = 3600.0
"""Seconds after which a build that failed is tried again."""
_HIROZ = Path(__file__).parent / "peers/hiroz"


class _NotBuiltError(Exception):
    """A part cannot be built here."""


def _folder() -> Path:
    """Return the folder of all parts."""
    given = os.environ.get("ROSZ_TEST_CACHE")
    caches = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(given) if given else Path(caches) / "rosz-tests"


def build_once(name: str, sources: bytes, build: Callable[[Path], None]) -> Path:
    """Return the folder of a part, which is built if it is not there yet.

    A part that could not be built is not tried again for some time: its tests skip.

    Args:
        name: Name of the part.
        sources: What it is built from; another text makes another folder.
        build: Function that builds it into a folder.
    """
    place = _folder() / f"{name}-{sha256(sources).hexdigest()[:16]}"
    place.parent.mkdir(parents=True, exist_ok=True)
    with place.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        finished, failed = place / "finished", place.with_suffix(".failed")
        if not finished.exists():
            if failed.exists() and time.time() - failed.stat().st_mtime < _AGAIN_SECONDS:
                raise SkipTest(failed.read_text())
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir()
            try:
                build(place)
            except _NotBuiltError as error:
                failed.write_text(f"cannot build {name}: {error}")
                raise SkipTest(failed.read_text()) from error
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


def old_zenoh(version: str = OLD_ZENOH) -> Path:
    """Return a Python interpreter with another Zenoh: by default one as old as that of ROS 2 Jazzy.

    Args:
        version: Its version.
    """
    release = f"eclipse-zenoh=={version}"

    def build(place: Path) -> None:
        run_step(sys.executable, "-m", "venv", place / "env")
        pip = (place / "env/bin/python", "-m", "pip", "install", "-q", "--only-binary", ":all:")
        run_step(*pip, release)

    sources = f"{release} {sys.version} {sys.executable}".encode()
    return build_once("old-zenoh", sources, build) / "env/bin/python"


def _peers() -> Path:
    """Return the folder of the programs of ``peers/hiroz``, and of Zenoh's router."""

    def build(place: Path) -> None:
        # What they depend on takes minutes, and is built once for all versions of the program.
        target = _folder() / "hiroz-target"
        manifest = ("--manifest-path", _HIROZ / "Cargo.toml")
        packages = ("-p", "hiroz-peer", "-p", "zenohd")
        run_step("cargo", "build", "--locked", *manifest, *packages, CARGO_TARGET_DIR=str(target))
        for program in ("hiroz-peer", "zenohd"):
            shutil.copy2(target / "debug" / program, place)

    files = [_HIROZ / "Cargo.toml", _HIROZ / "Cargo.lock", *sorted(_HIROZ.glob("src/*.rs"))]
    sources = b"".join(file.read_bytes() for file in files)
    return build_once("hiroz", sources, build)


def hiroz_peer() -> Path:
    """Return the program of ``peers/hiroz``, a node of hiroz, which speaks rmw_zenoh."""
    return _peers() / "hiroz-peer"


def zenohd() -> Path:
    """Return Zenoh's own router, of the crates that hiroz uses, too."""
    return _peers() / "zenohd"


if __name__ == "__main__":  # before pytest is there, beside other work
    _peers()
