"""``rosz pkg check``, catkin_make's successor: nothing is built, all is looked at."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from rosz.cli.group import print_json, takes_escapes
from rosz.environment import Environment, package_index
from rosz.errors import NotFoundError
from rosz.introspect.shells import SHELLS, Shell
from rosz.workspace import Checked, Problem, check, find_packages, write_setup

__all__ = ("check_packages", "set_up")

_TARGETS = frozenset({"all", "clean", "install", "run_tests", "tests", "test"})
_COLORS = {"error": "31", "warning": "33"}


def check_packages(words: Sequence[str], *, as_json: bool) -> int:
    """Check packages and return the exit code.

    Args:
        words: Folders and names; catkin_make's options and targets are passed over.
        as_json: Print JSON.

    Raises:
        NotFoundError: There is no such package, or none at all.
    """
    cwd = Path.cwd()
    environment = Environment.read()
    folders = find_packages(_meant(words, cwd), cwd, package_index(environment))
    done = check(folders, environment, os.environ)
    if as_json:
        checked = list(done)
        print_json(checked)
    else:
        checked = _show(done, len(folders), cwd, colored=environment.color)
    return int(any(one.level == "error" for each in checked for one in each.problems))


def set_up() -> None:
    """Write the files that course documents source after catkin_make.

    Raises:
        NotFoundError: There is no workspace here.
        UsageError: catkin has its own files there.
    """
    cwd = Path.cwd()
    workspace = next((f for f in (cwd, *cwd.parents) if (f / "src").is_dir()), None)
    if workspace is None:
        raise NotFoundError(f"no workspace around {cwd}: expected a folder 'src' with packages")
    files = write_setup(workspace, {shell: _evaluate(shell) for shell in SHELLS})
    sys.stdout.write(f"in a new shell: source {_near(str(files[0]), cwd)}\n")


def _evaluate(shell: Shell) -> str:
    """Return the line by which a shell takes what ``rosz env`` prints at that time."""
    command = f"{shlex.quote(sys.executable)} -P -m rosz env {shell}"
    return f"{command} | source\n" if shell == "fish" else f'eval "$({command})"\n'


def _meant(words: Sequence[str], cwd: Path) -> list[str]:
    """Leave out what tells catkin_make how to build."""
    found: list[str] = []
    before = ""
    for word in words:
        counts = before in {"-j", "-l"} and word.isdecimal()
        target = word in _TARGETS and not (cwd / word).is_dir()
        if not word.startswith("-") and not counts and not target:
            found.append(word)
        before = word
    return found


def _show(done: Iterable[Checked], count: int, cwd: Path, *, colored: bool) -> list[Checked]:
    """Print what is wrong, package by package, and a summary."""
    terminal = takes_escapes(sys.stderr)
    colored = colored and takes_escapes(sys.stdout)
    checked: list[Checked] = []
    for each in done:
        checked.append(each)
        if terminal:
            sys.stderr.write(f"\r\033[K[{100 * len(checked) // count:3d}%] {each.name}")
            sys.stderr.flush()
        if each.problems and terminal:
            sys.stderr.write("\r\033[K")
        for problem in each.problems:
            sys.stdout.write(_line(problem, cwd, colored=colored))
        sys.stdout.flush()
    if terminal:
        sys.stderr.write("\r\033[K")
    sys.stdout.write(_summary(checked))
    return checked


def _line(problem: Problem, cwd: Path, *, colored: bool) -> str:
    level: str = problem.level
    if colored:
        level = f"\033[{_COLORS[level]}m{level}\033[0m"
    return f"{_near(problem.place, cwd)}: {level}: {problem.text}\n"


def _near(place: str, cwd: Path) -> str:
    """Shorten a place below the working folder."""
    return place.removeprefix(f"{cwd}/")


def _summary(checked: list[Checked]) -> str:
    problems = [one for each in checked for one in each.problems]
    errors = sum(one.level == "error" for one in problems)
    counts = f"{_count(errors, 'error')}, {_count(len(problems) - errors, 'warning')}"
    verdict = "" if errors else "; nothing needs building"
    return f"checked {_count(len(checked), 'package')}: {counts}{verdict}\n"


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"
