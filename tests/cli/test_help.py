"""Help: every fact of a declaration, nothing cut, on a terminal of any width; and the manual."""

from __future__ import annotations

import pytest

from rosz.cli import system
from rosz.cli.commands import COMMANDS, load
from rosz.cli.declare import Option
from rosz.cli.main import run

LINES = [(name, command) for name in COMMANDS for command in ("", *load(name).commands)]


def told(capsys: pytest.CaptureFixture[str], *words: str, code: int = 0) -> str:
    """Return what a command prints to stdout."""
    assert run(words) == code
    out, err = capsys.readouterr()
    assert err == ""
    return out


def joined(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.parametrize("columns", ["40", "80", "200"])
@pytest.mark.parametrize(("name", "command"), LINES, ids=" ".join)
def test_help_holds_the_whole_declaration(
    name: str,
    command: str,
    columns: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    words = [word for word in (name, command) if word]
    text = told(capsys, *words, "--help")
    assert joined(text).startswith(f"Usage: rosz {' '.join(words)} ")
    assert "\033" not in text
    assert "╭" not in text
    app = load(name)
    declared = app.commands.get(command)
    if declared is None:
        assert app.help in joined(text)
        return
    assert joined(declared.help) in joined(text)
    for one in declared.parameters():
        if one.mark is None or (isinstance(one.mark, Option) and one.mark.help is None):
            continue
        for fact in (*one.spellings, one.mark.metavar or "", one.mark.help or ""):
            assert fact in joined(text)


def test_a_group_lists_its_commands(capsys: pytest.CaptureFixture[str]) -> None:
    text = told(capsys, "topic", code=2)
    assert text == told(capsys, "topic", "-h") == told(capsys, "help", "topic")
    assert "  info   Print the type, the publishers and the subscribers of a topic.\n" in text
    assert "..." not in text.replace("[ARGS]...", "")


def test_one_command(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    expected = """\
Usage: rosz param get [OPTIONS] {NAME}

  Print a parameter, or all parameters below a namespace, as YAML.

Arguments:
  NAME <str>  [required]

Options:
  -p          Print for reading; it may not be valid YAML.
  -v          Print each step.
  --json      Print JSON.
  -h, --help  Show this message and exit.
"""
    assert told(capsys, "param", "get", "-h") == expected
    assert told(capsys, "help", "param", "get") == expected


@pytest.mark.parametrize("columns", ["0", "-3", "abc", "", "²"])
def test_columns_that_are_no_number(
    columns: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    assert "\n  --log  " in told(capsys, "launch", "-h")


def test_help_of_what_is_run_belongs_to_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for words in (["-p", "gdb", "-h"], ["-d", "--help"]):
        assert told(capsys, "run", *words).startswith("Usage: rosz run ")
    for words in (["nope", "x", "-h"], ["-p", "gdb", "nope", "-h"]):
        assert run(["run", *words]) == 1
        assert capsys.readouterr().err.startswith("ERROR: package 'nope' not found")


def test_a_mistake_points_at_the_help_of_its_command(capsys: pytest.CaptureFixture[str]) -> None:
    for words, place in (
        (["topic", "echo"], "topic echo"),
        (["topic", "nope", "--help"], "topic"),
        (["launch", "--nope"], "launch"),
    ):
        assert run(words) == 2
        assert capsys.readouterr().err.rstrip().endswith(f"see 'rosz {place} --help'")


def test_the_manual_lists_its_pages(capsys: pytest.CaptureFixture[str]) -> None:
    text = told(capsys, "help")
    for topic, title in system.topics().items():
        assert f"  {topic} " in text
        assert f" {title}\n" in text
    assert {"commands", "security"} <= system.topics().keys()


@pytest.mark.parametrize("topic", system.pages())
def test_the_manual_prints_a_page(topic: str, capsys: pytest.CaptureFixture[str]) -> None:
    page = system.pages()[topic].read_text(encoding="utf-8")
    assert page.startswith("# ")
    assert told(capsys, "help", topic) == page


def test_an_unknown_page(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["help", "securty"]) == 1
    assert capsys.readouterr().err == (
        "ERROR: no page of the manual is called 'securty'; did you mean 'security'?\n"
    )


def test_the_page_of_commands_names_them_all() -> None:
    page = system.pages()["commands"].read_text(encoding="utf-8")
    for name in COMMANDS:
        assert f"rosz {name}" in page
        for command in filter(None, load(name).commands):
            assert command in page
