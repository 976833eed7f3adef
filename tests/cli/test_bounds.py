"""Numbers of command lines that make no sense are refused, whoever reads the line."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosz.cli.commands import COMMANDS, load
from rosz.cli.reading import read
from rosz.cli.typer_app import run as run_typer
from rosz.errors import UsageError

COUNTS = ["0", "-1", "2000000000"]
LIMITS = ["-1", "2000000000"]
"""Of numbers whose zero means that there is no limit."""
TIMES = ["0", "-1", "nan", "inf", "1e300"]
LINES = {
    "core --owner {}": ["-1", "2000000000"],
    "launch --sigint-timeout {} x.launch": TIMES,
    "launch --sigterm-timeout {} x.launch": TIMES,
    "launch --lost-after {} x.launch": TIMES,
    "param watch -n {} /a": COUNTS,
    "reconfigure get --timeout {} /a": TIMES,
    "reconfigure set --timeout {} /a b 1": TIMES,
    "reconfigure set_from_parameters --timeout {} /a": TIMES,
    "reconfigure dump --timeout {} /a a.yaml": TIMES,
    "reconfigure load --timeout {} /a a.yaml": TIMES,
    "reconfigure describe --timeout {} /a": TIMES,
    "reconfigure watch --timeout {} /a": TIMES,
    "reconfigure watch -n {} /a": COUNTS,
    "topic echo -n {} /a": COUNTS,
    "topic echo -w {} /a": ["0", "1", "-1", "2000000000"],
    "topic hz --window {} /a": ["0", "1", "2000000000"],
    "topic bw --window {} /a": ["0", "1", "2000000000"],
    "topic delay --window {} /a": ["0", "1", "2000000000"],
    "topic pub --rate {} /a std_msgs/String b": TIMES,
    "service call --timeout {} /a": TIMES,
    "node ping -c {} /a": COUNTS,
    "log -n {}": COUNTS,
    "keys init --days {} keys": COUNTS,
    "keys add --days {} robot": COUNTS,
    "doctor --wait {}": TIMES[1:],
    "bag record --size {} /a": LIMITS,
    "bag record --max-splits {} /a": LIMITS,
    "bag record --buffsize {} /a": LIMITS,
    "bag record --chunksize {} /a": COUNTS,
    "bag record --limit {} /a": LIMITS,
    "bag record --snapshot {} /a": TIMES[1:],
    "bag play --queue {} a.bag": LIMITS,
    "bag play --hz {} a.bag": TIMES,
    "bag play --rate {} a.bag": TIMES,
    "bag play --start {} a.bag": TIMES[1:],
    "bag play --delay {} a.bag": TIMES[1:],
    "bag play --duration {} a.bag": TIMES[1:],
    "bag play --skip-empty {} a.bag": TIMES[1:],
    "bag play --rate-control-max-delay {} a.bag": TIMES[1:],
    "bag export --format mp4 --fps {} a.bag d": TIMES,
    "bag plot --start {} a.bag /a/b -o a.png": TIMES[1:],
    "bag plot --end {} a.bag /a/b -o a.png": TIMES[1:],
    "action send --timeout {} /a std_msgs/a {{}}": TIMES,
    "tf list --wait {}": TIMES,
    "tf tree --wait {}": TIMES,
    "tf echo --rate {} a b": TIMES,
    "tf echo -n {} a b": COUNTS,
    "tf echo --timeout {} a b": TIMES,
    "tf monitor --period {}": TIMES,
    "tf monitor -n {}": COUNTS,
    "bag filter --start {} a.bag b.bag": TIMES[1:],
    "bag filter --end {} a.bag b.bag": TIMES[1:],
    "bag cat --start {} a.bag": TIMES[1:],
    "bag cat --end {} a.bag": TIMES[1:],
    "bag cat -n {} a.bag": COUNTS,
    "bag export --start {} a.bag b": TIMES[1:],
    "bag export --end {} a.bag b": TIMES[1:],
    "bag split --duration {} a.bag": TIMES[1:],
    "bag split --size {} a.bag": LIMITS,
    "bridge websocket --port {}": ["-1", "65536"],
    "bridge foxglove --port {}": ["-1", "65536"],
    "graph --group {}": ["-1"],
    "web --port {}": ["-1", "65536"],
}


def _call(name: str, words: list[str], *, typer: bool) -> None:
    app = load(name)
    if typer:
        run_typer(app, words, "x")
        return
    ready = read(app, words)
    assert ready is not None
    ready()


def _refusal(name: str, words: list[str], *, typer: bool) -> str:
    with pytest.raises(UsageError) as refused:
        _call(name, words, typer=typer)
    return str(refused.value)


@pytest.mark.parametrize(
    ("line", "value"), [(line, value) for line, values in LINES.items() for value in values]
)
def test_a_number_out_of_bounds_is_refused(
    line: str, value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("x.launch").write_text("<launch/>")
    Path("a.yaml").write_text("a: 1")
    name, *words = [word.format(value) for word in line.split()]
    told = _refusal(name, words, typer=True)
    assert "; expected " in told
    if not value.startswith("-"):  # which only typer reads
        assert _refusal(name, words, typer=False) == told


def test_no_number_is_left_out() -> None:
    tried = {
        (name, words[0] if load(name).help else "", option)
        for name, *words in map(str.split, LINES)
        for option in words
        if option.startswith("-")
    }
    for name in COMMANDS:
        for command, declared in load(name).commands.items():
            for one in declared.parameters():
                if one.spellings and one.kind in {int, float}:
                    assert any((name, command, word) in tried for word in one.spellings), one.name
