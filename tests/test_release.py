"""What is released: the wheel and the sdist, as `rosz help contributing` says they are made."""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
import venv
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MANUAL = ROOT / "rosz" / "share" / "manual"
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
LARGEST_WHEEL = 6_000_000
NEEDED = (
    *("eclipse_zenoh", "zenoh", "msgspec", "yaml", "_yaml", "typer", "rich", "click", "pygments"),
    *("markdown_it", "mdurl", "shellingham", "typing_extensions"),
)


def run(*command: str | Path, cwd: Path | None = None) -> str:
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000", "PYTHONSAFEPATH": "1"}
    done = subprocess.run(
        list(map(str, command)),
        check=False,
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def build(sources: Path, target: Path) -> list[Path]:
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", target, sources)
    return sorted(target.iterdir())


def digests(files: list[Path]) -> dict[str, str]:
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


@pytest.fixture(scope="module")
def released(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return build(ROOT, tmp_path_factory.mktemp("released"))


def test_a_release_is_reproducible(released: list[Path], tmp_path: Path) -> None:
    wheel, sdist = f"rosz-{VERSION}-py3-none-any.whl", f"rosz-{VERSION}.tar.gz"
    assert [file.name for file in released] == [wheel, sdist]
    assert digests(build(ROOT, tmp_path / "again")) == digests(released)
    # The sdist holds all that a wheel is made of; its folder and the times of its files are others.
    shutil.unpack_archive(released[1], tmp_path)
    from_sdist = build(tmp_path / f"rosz-{VERSION}", tmp_path / "from_sdist")
    assert digests(from_sdist[:1]) == digests(released[:1])


def test_a_release_may_be_uploaded(released: list[Path]) -> None:
    run(sys.executable, "-m", "twine", "check", "--strict", *released)
    assert released[0].stat().st_size < LARGEST_WHEEL


def test_a_wheel_alone_is_enough(released: list[Path], tmp_path: Path) -> None:
    """The packages that rosz runs on are those of this environment."""
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    run(python, "-m", "pip", "install", "--no-deps", "--no-index", released[0])
    (own,) = (tmp_path / "venv" / "lib").glob("python*/site-packages")
    for name in NEEDED:
        for path in Path(sys.prefix).glob(f"lib/python*/site-packages/{name}*"):
            (own / path.name).symlink_to(path)
    rosz = tmp_path / "venv" / "bin" / "rosz"
    assert run(rosz, "--version", cwd=tmp_path) == (
        f"rosz {VERSION}, Zenoh {version('eclipse-zenoh')}, Python {platform.python_version()}\n"
    )
    for page in MANUAL.glob("*.md"):
        assert run(rosz, "help", page.stem, cwd=tmp_path) == page.read_text()
    assert "string data" in run(rosz, "msg", "show", "std_msgs/String", cwd=tmp_path)
    launch = own / "rosz" / "share" / "launch" / "pub_and_sub.launch"
    assert "/publisher" in run(rosz, "launch", "--nodes", launch, cwd=tmp_path)


def test_the_version_is_that_of_the_newest_change() -> None:
    text = (MANUAL / "changelog.md").read_text()
    versions = re.findall(r"^## \[(.+?)\]", text, re.MULTILINE)
    assert next(name for name in versions if name != "Unreleased") == VERSION
