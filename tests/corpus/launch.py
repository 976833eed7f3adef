"""Compares what rosz and roslaunch make of launch files."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from plan.roslaunch_oracle import Roslaunch, Rosz, differences, environment

from rosz.environment import Environment, package_index

from .packages import Corpus, Repository

__all__ = ("compare",)

_ROOT = re.compile(rb"<launch[\s>]")


def compare(corpus: Corpus, repositories: list[Repository], limit: int) -> Iterator[dict[str, Any]]:
    """Yield a row for each launch file: both errors, the differences, and whether it is equal.

    A file that both refuse, without arguments, is equal. Of each repository so many files are
    read as `limit` says, from all over it.
    """
    for repository in repositories:
        yield from _rows(corpus, repository, limit)


def _files(repository: Repository) -> Iterator[Path]:
    """Yield the launch files of a repository."""
    for suffix in ("launch", "xml", "test"):
        for path in sorted(repository.path.rglob(f"*.{suffix}")):
            # Includes are often called NAME.launch.xml, or lie in a folder of launch files.
            if path.is_file() and path.name != "package.xml" and _ROOT.search(path.read_bytes()):
                yield path


def _rows(corpus: Corpus, repository: Repository, limit: int) -> Iterator[dict[str, Any]]:
    found = list(_files(repository))
    if not found:
        return
    found = found[:: -(-len(found) // limit)]
    with TemporaryDirectory() as home:
        shipped = list(map(str, package_index(Environment()).roots))
        paths = [
            corpus.path(repository, real=True),
            ":".join([corpus.path(repository, real=False), *shipped]),
        ]
        variables = [environment(Path(), Path(home)) | {"ROS_PACKAGE_PATH": path} for path in paths]
        roslaunch, rosz = Roslaunch(variables[0]), Rosz(variables[1])
        # Each side has its own package path, and its own programs of ROS 1's packages.
        own = [(path, "PATH") for path in paths]
        own += [(f"{root}/", "INSTALLED/") for root in shipped]
        own += [("/usr/lib/", "INSTALLED/"), ("/usr/share/", "INSTALLED/")]
        try:
            for path in found:
                print(f"launch {path}", file=sys.stderr, flush=True)
                real = roslaunch.ask([path.name], path.parent)
                ours = rosz.ask([path.name], path.parent)
                if not (real["error"] or ours["error"]):
                    _drop_programs(ours["args"], real["args"])
                    ours, real = _renamed(ours, own), _renamed(real, own)
                differing = differences(ours, real)
                yield {
                    "case": f"{repository.name}:{path.relative_to(repository.path)}",
                    "rosz": ours["error"],
                    "ros1": real["error"],
                    "differences": [text[:2000] for text in differing],
                    "equal": not differing,
                }
        finally:
            roslaunch.close()


def _drop_programs(ours: dict[str, Any], real: dict[str, Any]) -> None:
    """Drop the command lines of programs that only one side has installed."""
    for name in [name for name in real if (ours.get(name) is None) != (real[name] is None)]:
        del real[name]
        ours.pop(name, None)


def _renamed(value: Any, names: list[tuple[str, str]]) -> Any:
    """Return a report with other names for places."""
    if isinstance(value, dict):
        return {key: _renamed(one, names) for key, one in value.items()}
    if isinstance(value, list):
        return [_renamed(one, names) for one in value]
    if isinstance(value, str):
        for old, new in names:
            value = value.replace(old, new)
    return value
