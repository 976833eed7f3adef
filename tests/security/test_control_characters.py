"""What strangers name is printed escaped: no command lets them write to a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from cli.shell import Shell
from network import Network, eventually

from rosz.introspect import Echo, EchoOptions, FieldPath, take_survey
from rosz.msgs.std_msgs.msg import String
from rosz.qos import QoS
from rosz.wire import NO_HASH, Kind, Token, format_token

ODD = "\x1b]0;title\x07\x1b[31m\x9b2J\r\x7f"


@pytest.fixture
def shell(
    network: Network, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Shell:
    return Shell(network, monkeypatch, capsys)


@pytest.fixture
def stranger(network: Network) -> Iterator[None]:
    """A session with a node, a topic and a service of odd names."""
    session = network.session()
    common: dict[str, Any] = {
        "domain": network.domain,
        "zid": session.zid,
        "node_id": 1,
        "namespace": "/",
    }
    entity: dict[str, Any] = {
        "type_name": f"std_msgs/msg/String{ODD}",
        "type_hash": f"{NO_HASH}{ODD}",
        "qos": QoS(),
        "node": f"bad{ODD}",
        **common,
    }
    tokens = [Token(entity_id=1, kind=Kind.NODE, node=f"bad{ODD}", **common)]
    for number, kind in enumerate((Kind.PUBLISHER, Kind.SUBSCRIPTION, Kind.SERVICE, Kind.CLIENT)):
        tokens.append(Token(entity_id=number + 2, kind=kind, name=f"/odd{ODD}", **entity))
    declared = [session.token(format_token(token)) for token in tokens]
    looking = network.session()
    eventually(
        lambda: len(take_survey(looking, network.domain).view.tokens) == len(tokens), "the tokens"
    )
    yield
    for token in declared:
        token.close()


@pytest.mark.usefixtures("stranger")
@pytest.mark.parametrize(
    "line",
    [
        "topic list",
        "topic list -v",
        "topic list --json",
        f"topic info /odd{ODD}",
        f"topic type /odd{ODD}",
        "node list",
        "node list -a",
        f"node info /bad{ODD}",
        "node machine",
        "node cleanup",
        "service list",
        "service list -n",
        "service find std_srvs/Empty",
        "action list",
        "param list",
        "doctor --wait 0.1",
        "ros2 topic list -t",
        "ros2 node list",
        "ros2 service list -t",
        "graph",
    ],
)
def test_names_of_strangers(shell: Shell, line: str) -> None:
    done = shell(*line.split())
    assert controls(done.out + done.err) <= set("\n\t")


def controls(text: str) -> set[str]:
    """Return the control characters of a text."""
    return {letter for letter in text if letter < " " or "\x7f" <= letter < "\xa0"}


def test_logs_of_strangers(network: Network) -> None:
    node = network.node("stranger")
    program = network.run("-m", "rosz", "log", "-n", "1")

    def ended() -> bool:
        node.log.info("logged %s", ODD)
        return program.process.poll() is not None

    eventually(ended, "a line of the log")
    assert program.exit_code() == 0
    assert "[/stranger]: logged \\u001b]0;title" in program.output
    assert controls(program.output) <= set("\n")


def test_rows_of_numbers_with_texts() -> None:
    rows = Echo("/t", "std_msgs/String", FieldPath(""), EchoOptions(plot=True), lambda: 0)
    assert controls(rows.text(String(data=ODD)) or ODD) <= set("\n")
