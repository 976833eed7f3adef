"""Values that ``rosz bag play`` refuses before it opens anything."""

from __future__ import annotations

import pytest

from rosz.cli.main import run


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["-r", "0"], "--rate is 0; expected a factor above 0"),
        (["-r", "-1"], "--rate is -1; expected a factor above 0"),
        (["-r", "nan"], "--rate is nan; expected a factor above 0"),
        (["-r", "1e9"], "at most 1000000, such as 2 to play twice as fast"),
        (["--clock", "0"], "--clock is 0; expected a rate above 0"),
        (["--clock", "-5"], "--clock is -5; expected a rate above 0"),
        (["--clock", "nan"], "--clock is nan; expected a rate above 0"),
        (["--hz", "0"], "--hz is 0; expected a rate above 0"),
        (["-s", "-1"], "--start is -1; expected 0 or more seconds"),
        (["-u", "-1"], "--duration is -1; expected 0 or more seconds"),
        (["--queue", "-1"], "--queue is -1; expected 0 or more messages"),
    ],
)
def test_impossible_values_of_play(
    words: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["bag", "play", "missing.mcap", *words]) == 2
    assert text in capsys.readouterr().err
