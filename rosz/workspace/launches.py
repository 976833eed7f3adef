"""Checking launch files: each is planned with the defaults of its args, and nothing is run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from rosz.errors import NotFoundError, RoszError
from rosz.launch.plan import NodePlan, SystemContext, describe_args, plan
from rosz.launch.run.command import locate
from rosz.packages import PackageIndex
from rosz.workspace.problem import Problem, error, from_error, warning

__all__ = ("check_launches", "launch_files")

_PATTERNS = ("*.launch", "*.launch.xml", "*.test")


class _Still(SystemContext):
    """A context in which no command is run: its output is empty."""

    def run(self, command: Sequence[str]) -> bytes:  # noqa: ARG002  # what it overrides
        """Return nothing."""
        return b""


def launch_files(folder: Path) -> list[Path]:
    """Return the launch files of a package, sorted."""
    return sorted({file for pattern in _PATTERNS for file in folder.rglob(pattern)})


def check_launches(
    folder: Path, index: PackageIndex, environ: Mapping[str, str]
) -> Iterator[Problem]:
    """Yield what is wrong in the launch files of a package.

    Args:
        folder: The package.
        index: All packages that can be found.
        environ: Variables.
    """
    context = _Still(index, environ, folder, lambda base: f"{base}_1")
    for file in launch_files(folder):
        try:
            missing = [a.name for a in describe_args([file], {}, context) if a.default is None]
            # What asks for values is meant to be included with them, and means nothing without.
            settled = None if missing else plan([file], {}, context)
        except RoszError as fault:
            yield from_error(fault, file)
            continue
        if settled is not None:
            for notice in settled.warnings:
                place = notice.place
                yield warning(Path(place.file), notice.text, place.line, place.column)
            for node in settled.processes:
                yield from _check_node(node, index, lambda path: path.is_relative_to(folder))


def _check_node(
    node: NodePlan, index: PackageIndex, is_ours: Callable[[Path], bool]
) -> Iterator[Problem]:
    """Yield why a node cannot be started."""
    if node.command or node.machine:
        return
    place = Path(node.place.file), node.place.line, node.place.column
    try:
        package = index.find(node.package)
    except RoszError as fault:
        yield warning(place[0], f"node '{node.name}': {fault}", *place[1:])
        return
    try:
        locate(package, node.type)
    except NotFoundError as fault:
        make = error if is_ours(package.path) else warning
        yield make(place[0], f"node '{node.name}': {fault}", *place[1:])
