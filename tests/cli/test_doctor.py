"""``rosz doctor`` as a person and as a program sees it."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest
from doctor.conftest import be_patient
from network import Network

from rosz.doctor import Examination
from rosz.msgs.std_msgs.msg import Int32, String

from .shell import Shell


@pytest.fixture(autouse=True)
def _doctor(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A doctor who waits for a busy machine, and does not look at its shared memory."""
    be_patient(monkeypatch)
    monkeypatch.setattr("rosz.doctor.Examination", partial(Examination, memory=tmp_path))


def test_a_healthy_system(shell: Shell, network: Network) -> None:
    network.node("talker")
    assert shell("doctor").lines == ["looked at 1 node: all is well"]
    assert shell("doctor", "--json").json == []


def test_an_empty_system_is_not_an_error(shell: Shell) -> None:
    result = shell("doctor")
    assert result.lines[0].startswith("WARNING nobody-there: ")
    assert result.lines[-1] == "looked at 0 nodes: 0 errors, 1 warning"


def test_an_error_is_printed_with_evidence_and_remedy(shell: Shell, network: Network) -> None:
    network.node("talker").publisher("/chatter", String)
    network.node("listener").subscription("/chatter", Int32, lambda _: None)
    result = shell("doctor")
    assert result.code == 1
    title, first, second, remedy, gap, summary = result.out.splitlines()
    assert title.startswith("ERROR type-mismatch: topic /chatter has several types")
    assert first.startswith("  - /listener (")
    assert second.startswith("  - /talker (")
    assert remedy.startswith("  what to do: give all sides one type")
    assert gap == ""
    assert summary == "looked at 2 nodes: 1 error, 0 warnings"
    as_json = shell("doctor", "--json")
    assert as_json.code == 1
    assert '"name": "type-mismatch"' in as_json.out


def test_much_evidence_is_counted(shell: Shell, network: Network) -> None:
    node = network.node("talker")
    for number in range(12):
        node.publisher(f"/topic{number}", String)
    result = shell("doctor")
    assert result.lines[9] == "  - and 4 more"
    assert len(shell("doctor", "--json").json[0]["evidence"]) == 12


def test_an_invalid_wait(shell: Shell) -> None:
    result = shell("doctor", "--wait", "-1")
    assert result.code == 2
    assert "--wait is -1; expected seconds above 0" in result.err
