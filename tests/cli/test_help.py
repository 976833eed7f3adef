"""Help: the same look for all, nothing cut, as wide as the terminal, and never typer's."""

from __future__ import annotations

from importlib import import_module

import pytest

from rosz.cli.declare import App
from rosz.cli.main import COMMANDS, run

LINES = [
    (name, command)
    for name in COMMANDS
    for command in ("", *import_module(f"rosz.cli.{name}").app.commands)
]


def told(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    """Return what a command prints to stdout."""
    assert run(words) == code
    out, err = capsys.readouterr()
    assert err == ""
    return out


@pytest.mark.parametrize("columns", ["40", "80", "200"])
@pytest.mark.parametrize(("name", "command"), LINES, ids=" ".join)
def test_all_help_fits_and_is_whole(
    name: str,
    command: str,
    columns: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    words = [word for word in (name, command) if word]
    text = told(capsys, *words, "--help")
    assert " ".join(text.split()).startswith(f"usage: rosz {' '.join(words)} ")
    # A single word may be longer than a line.
    assert all(len(line) <= int(columns) for line in text.splitlines() if " " in line.strip())
    for typers in ("<str>", "<bool>", "<list", "{", "╭", "[required]", "\033"):
        assert typers not in text
    app: App = import_module(f"rosz.cli.{name}").app
    declared = app.commands.get(command)
    says = app.text if declared is None else declared.help or declared.function.__doc__ or ""
    assert " ".join(says.split()) in " ".join(text.split())


def test_a_group_tells_all_of_its_commands(capsys: pytest.CaptureFixture[str]) -> None:
    text = told(capsys, "topic", code=2)
    assert text == told(capsys, "topic", "-h") == told(capsys, "help", "topic")
    assert "  info   Tell the type of a topic, who publishes it and who subscribes to it.\n" in text
    assert "..." not in text


def test_one_command(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "70")
    expected = """\
usage: rosz service call [OPTIONS] SERVICE [VALUE]...

Call a service and print its answer.

  [VALUE]...  YAML: one dictionary, or a value per field.

  -v                 Print the request too.
  --wait             Wait for the service.
  --timeout SECONDS  Wait for the answer at most so long. [default:
                     3600]
  --json             As JSON.
  -h, --help         Show this message and exit.
"""
    assert told(capsys, "service", "call", "-h") == expected
    assert told(capsys, "service", "call", "/x", "--nope", "--timeout", "-h", "--help") == expected
    assert told(capsys, "help", "service", "call") == expected


@pytest.mark.parametrize("columns", ["0", "-3", "abc", "", "²"])
def test_columns_that_are_none(
    columns: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    assert "\n  --log  " in told(capsys, "launch", "-h")


def test_help_of_what_is_run_belongs_to_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for words in (["-p", "gdb", "-h"], ["-d", "--help"]):
        assert told(capsys, "run", *words).startswith("usage: rosz run ")
    for words in (["nope", "x", "-h"], ["-p", "gdb", "nope", "-h"]):
        assert run(["run", *words]) == 1
        assert capsys.readouterr().err.startswith("rosz: package 'nope' not found")


def test_a_mistake_points_at_the_help_of_its_command(capsys: pytest.CaptureFixture[str]) -> None:
    for words, place in (
        (["topic", "echo"], "topic echo"),
        (["topic", "nope", "--help"], "topic"),
        (["launch", "--nope"], "launch"),
    ):
        assert run(words) == 2
        assert capsys.readouterr().err.rstrip().endswith(f"see 'rosz {place} --help'")
