"""What reads sound lines itself understands them as typer does, and leaves it all others."""

from __future__ import annotations

from typing import Annotated, Any

import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import Struct
from typer.exceptions import TyperException

from rosz.cli.declare import App, Argument, Option, values_last
from rosz.cli.reading import read
from rosz.cli.typer_app import translate

app = App("Try it.", is_remapping=lambda word: ":=" in word)
lone = App()
seen: list[tuple[Any, ...]] = []


class TakeOptions(Struct, frozen=True, kw_only=True):
    """The options of ``take``."""

    flag: Annotated[bool, Option("-f --flag")] = False
    count: Annotated[int | None, Option("-n COUNT")] = None
    rate_of_all: Annotated[float, Option("--rate-of-all HZ")] = 1.5
    each: Annotated[list[str] | None, Option("--each")] = None


@app.command("take")
def take(
    remappings: tuple,  # type: ignore[type-arg]  # called as a type
    first: Annotated[str, Argument("FIRST")],
    options: TakeOptions,
    more: Annotated[list[str] | None, Argument("MORE")] = None,
) -> None:
    """Take what there is."""
    rest = options.flag, options.count, options.rate_of_all, options.each or None
    seen.append((remappings, first, more or None, *rest))


@app.command("set", arrange=values_last("-t"))
def set_(
    name: Annotated[str, Argument("NAME")],
    value: Annotated[int, Argument("VALUE")] = 7,
    *,
    text: Annotated[str, Option("-t")] = "",
) -> int:
    """Take a value that may begin as an option does."""
    seen.append((name, value, text))
    return 3


@app.command("run", interspersed=False)
def run(
    words: Annotated[list[str], Argument("WORD")], *, flag: Annotated[bool, Option("-f")] = False
) -> None:
    """Leave options behind a word to what that names."""
    seen.append((words, flag))


@lone.command()
def only(
    what: Annotated[str, Argument("WHAT")] = "", *, flag: Annotated[bool, Option("-f")] = False
) -> None:
    """Be alone."""
    seen.append((what, flag))


def by_typer(group: App, argv: list[str]) -> tuple[Any, Any]:
    """Return what the function got, and returned, when typer called it; no Nones: it refused."""
    seen.clear()
    remappings, words = group.split(argv)
    try:
        code = translate(group, remappings)(args=words, prog_name="x", standalone_mode=False)
    except (TyperException, typer.Exit):
        return None, None
    return (seen[-1], code) if seen else (None, None)


def by_reading(group: App, argv: list[str]) -> tuple[Any, Any]:
    """Return the same of the reading; Nones where it leaves the line to typer."""
    seen.clear()
    ready = read(group, argv)
    if ready is None:
        return None, None
    code = ready()
    return seen[-1], code


SOUND = [
    "take a",
    "take a b c",
    "take -f a -n 3 b",
    "take a -n 0",
    "take a --rate-of-all 2 --flag",
    "take a --rate-of-all=2.5",
    "take a --each x --each=y",
    "take from:=to a _x:=1",
    "take -- -f -n",
    "take - -",
    "set /x 1",
    "set /x -1",
    "set -t file /x -12",
    "set /x",
    "run -f a -f --flag -- b",
    "run a",
]
UNSOUND = [
    "",
    "take",
    "take -x a",
    "take a --bogus",
    "take a -n x",
    "take a -n",
    "take a -fn 3",
    "take a -n3",
    "take a --flag=1",
    "take a --fla",
    "take --help",
    "set /x y",
    "set /x 1 2",
    "set /x -t",
    "--help",
    "bogus",
    "run",
]


@pytest.mark.parametrize("line", SOUND)
def test_a_sound_line_needs_no_typer(line: str) -> None:
    found = by_reading(app, line.split())
    assert found != (None, None)
    assert found == by_typer(app, line.split())


@pytest.mark.parametrize("line", UNSOUND)
def test_all_others_are_left_to_typer(line: str) -> None:
    assert read(app, line.split()) is None


def test_a_lone_command() -> None:
    for line in ("", "word", "-f word", "word -f"):
        assert by_reading(lone, line.split()) == by_typer(lone, line.split()) != (None, None)
    assert read(lone, ["a", "b"]) is None


def test_a_value_may_begin_like_an_option() -> None:
    arrange = values_last("-t")
    line = "a -t file -1 b -v -- -x"
    assert " ".join(arrange(line.split())) == "-t file -v -- a -1 b -x"
    assert arrange(["-t"]) == ["-t", "--"]


WORDS = [
    *("take", "set", "run", "a", "", "-", "--", "-f", "--flag", "-n", "3", "-1", "x:=y", "-n3"),
    *("--each", "--rate-of-all", "--rate-of-all=4", "--each=", "-t", "-ft", "1.5", "-h", "--fl"),
]


@settings(max_examples=300)
@given(st.sampled_from(["take", "set", "run"]), st.lists(st.sampled_from(WORDS), max_size=7))
def test_no_line_means_something_else_to_typer(command: str, words: list[str]) -> None:
    found = by_reading(app, [command, *words])
    if found != (None, None):
        assert found == by_typer(app, [command, *words])
