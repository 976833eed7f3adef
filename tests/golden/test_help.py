"""Commands as they are declared, and what ``--help`` prints of each."""

from __future__ import annotations

import pytest

from rosz.cli.main import run

from .declarations import as_json, lines
from .golden import check, check_files

LINES = lines()


def file(line: str) -> str:
    return f"{'_'.join(['rosz', *line.split()])}.txt"


@pytest.mark.parametrize("line", LINES)
def test_help(
    line: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setenv("NO_COLOR", "1")
    code = run([*line.split(), "--help"])
    out, err = capsys.readouterr()
    assert (code, err) == (0, "")
    check(f"help/{file(line)}", out)


def test_every_file_is_of_a_command() -> None:
    check_files("help", map(file, LINES))


def test_declarations() -> None:
    check("commands.json", as_json())
