"""Names and texts of a bag that a terminal would obey are printed escaped."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from rosz.bags import Channel, McapWriter
from rosz.cli.main import run
from rosz.msgs.std_msgs.msg import String

ODD = "\x1b]0;title\x07\x1b[31m\x9b2J\r\x7f"
"""What sets the title of a terminal, its color, clears it, and goes to the begin of the line."""
TOPICS = (f"/chat{ODD}", f"/of{ODD}: [", "/emoji\U0001f600", "/plain")


def write(path: Path, *, odd_type: bool) -> None:
    """Write a bag with names that no node of ROS may have."""
    with McapWriter(path) as writer:
        for topic in TOPICS:
            channel = Channel(topic, "std_msgs/msg/String", definition="string data\n")
            writer.write(writer.add(channel), 5, String(data=f"text{ODD}").to_cdr())
        if odd_type:
            channel = Channel("/type", f"std_msgs/msg/A{ODD}", definition=f"string {ODD}\n")
            writer.write(writer.add(channel), 5, String().to_cdr())


@pytest.mark.parametrize("odd_type", [False, True])
@pytest.mark.parametrize(
    "line",
    [
        "info a.mcap",
        "info -y a.mcap",
        "info -y -k topics a.mcap",
        "info --json a.mcap",
        "check a.mcap",
        "cat a.mcap",
        "cat -p a.mcap",
        "cat --json a.mcap",
        "cat a.mcap /chot",
        "export a.mcap out",
        "convert a.mcap b.bag",
        "convert a.mcap b",
        "filter a.mcap b.mcap True",
        "reindex a.mcap",
        "fix a.mcap b.mcap",
        "merge b.mcap a.mcap",
    ],
)
def test_bags(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    line: str,
    odd_type: bool,
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "a.mcap", odd_type=odd_type)
    run(["bag", *line.split()])
    printed = "".join(capfd.readouterr())
    assert printed
    assert [letter for letter in printed if letter < " " or "\x7f" <= letter < "\xa0"] == [
        "\n"
    ] * printed.count("\n")


def test_the_description_stays_yaml(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write(tmp_path / "a.mcap", odd_type=False)
    assert run(["bag", "info", "-y", str(tmp_path / "a.mcap")]) == 0
    topics = yaml.safe_load(capfd.readouterr().out)["topics"]
    assert {row["topic"] for row in topics} == set(TOPICS)
