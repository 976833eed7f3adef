from __future__ import annotations

import re
import signal
from collections.abc import Iterator

import pytest
from network import TIMEOUT, Network, eventually

from rosz.msgs.geometry_msgs.msg import Twist
from rosz.node import Node
from rosz.wire import Kind, Token, format_token

from .shell import Shell

NODE = """
    from rosz.node import Node
    node = Node("victim")
    print("ready", flush=True)
    node.spin()
    print("ended", flush=True)
"""


@pytest.fixture
def foreign(network: Network) -> Iterator[str]:
    """A node as ROS 2 has them: it tells no process, and answers nothing. Gives its name."""
    session = network.session()
    token = Token(network.domain, session.zid, 0, 0, Kind.NODE, "/", "foreign")
    declared = session.token(format_token(token))
    yield "/foreign"
    declared.close()


def test_list(shell: Shell, talker: Node, network: Network) -> None:
    network.node("arm", namespace="/robot")
    assert shell("node", "list").lines == ["/robot/arm", "/talker"]
    assert shell("node", "list", "/robot").lines == ["/robot/arm"]
    place = f"{talker.process.host}, pid {talker.process.pid}"
    assert f"{place} \t/talker" in shell("node", "list", "-a").lines
    assert shell("node", "list", "-u", "/talker").lines == [place]


def test_list_as_json(shell: Shell, talker: Node) -> None:
    (found,) = shell("node", "list", "--json").json
    assert found["name"] == "/talker"
    assert found["pid"] == talker.process.pid


@pytest.mark.usefixtures("talker")
def test_list_has_nodes_of_ros_2(shell: Shell, foreign: str) -> None:
    assert foreign in shell("node", "list").lines
    assert any(
        re.fullmatch(rf"session [0-9a-f]+ \t{foreign}", line)
        for line in shell("node", "list", "-a").lines
    )


def test_a_killed_node_is_gone(shell: Shell, network: Network) -> None:
    network.node("stays")
    victim = network.program(NODE)
    victim.wait_for("ready")
    assert "/victim" in shell("node", "list").lines
    victim.kill()
    eventually(lambda: "/victim" not in shell("node", "list").lines, "the end")


def test_info(shell: Shell, talker: Node, network: Network) -> None:
    driver = network.node("driver")
    driver.publisher("/cmd_vel", Twist).wait_for_subscribers(timeout=TIMEOUT)
    text = shell("node", "info", "/talker").out
    assert text.startswith(
        f"{'-' * 80}\nNode [/talker]\nPublications: \n"
        " * /robot/pose [geometry_msgs/PoseStamped]\n"
        " * /robot/text [std_msgs/String]\n"
        " * /rosout [rosgraph_msgs/Log]\n"
        "\nSubscriptions: \n * /cmd_vel [geometry_msgs/Twist]\n"
    )
    place = f"{driver.process.host}, pid {driver.process.pid}"
    assert f"contacting node {place} ...\nPid: {talker.process.pid}\n" in text
    assert (
        "Connections:\n"
        " * topic: /cmd_vel\n"
        f"    * to: /driver ({place})\n"
        "    * direction: inbound\n"
        "    * transport: Zenoh\n"
    ) in text


@pytest.mark.usefixtures("talker")
def test_quiet_info_sends_no_request(shell: Shell, foreign: str) -> None:
    assert "contacting" not in shell("node", "info", "-q", "/talker").out
    assert shell("node", "info", "-q", foreign).out == (
        f"{'-' * 80}\nNode [/foreign]\nPublications: None\n\nSubscriptions: None\n\n"
        "Services: None\n\n"
    )


@pytest.mark.usefixtures("talker")
def test_info_of_a_node_that_takes_no_requests(shell: Shell, foreign: str) -> None:
    assert "node '/foreign' does not take requests: it is not a rosz node" in (
        shell("node", "info", foreign).out
    )


def test_info_as_json(shell: Shell, talker: Node, foreign: str) -> None:
    found = shell("node", "info", "--json", "/talker", foreign).json
    assert [one["name"] for one in found] == ["/talker", "/foreign"]
    assert found[0]["pid"] == talker.process.pid
    assert found[0]["argv"]
    assert found[0]["subscriptions"][0]["type"] == "geometry_msgs/Twist"
    assert "pid" not in found[1]


@pytest.mark.usefixtures("talker")
@pytest.mark.parametrize("question", ["info", "ping", "kill"])
def test_an_unknown_node_names_the_near_miss(shell: Shell, question: str) -> None:
    result = shell("node", question, "/taker")
    assert result.code == 1
    assert "'/taker'; did you mean '/talker'?" in result.err


def test_ping(shell: Shell, talker: Node) -> None:
    place = f"{talker.process.host}, pid {talker.process.pid}"
    first, second, *replies, last = shell("node", "ping", "-c", "2", "talker").lines
    assert first == "rosnode: node is [/talker]"
    assert second == "pinging /talker with a timeout of 3.0s"
    assert len(replies) == 2
    for reply in replies:
        assert re.fullmatch(rf"reply from {re.escape(place)}\ttime=\d+\.\d{{6}}ms", reply)
    assert re.fullmatch(r"ping average: \d+\.\d{6}ms", last)


@pytest.mark.usefixtures("talker")
def test_ping_goes_on_until_stopped(shell: Shell) -> None:
    ping = shell.start("node", "ping", "/talker")
    ping.wait_for("reply from")
    ping.send(signal.SIGINT)
    assert ping.exit_code() == 0


@pytest.mark.usefixtures("talker")
def test_ping_everybody(shell: Shell, foreign: str) -> None:
    result = shell("node", "ping", "--all")
    assert result.code == 1
    assert "Will ping the following nodes: \n * /foreign\n * /talker\n" in result.out
    assert f"cannot ping [{foreign}]" in result.err


@pytest.mark.usefixtures("talker")
@pytest.mark.parametrize("words", [["-a", "/talker"], ["-a", "-c", "2"], ["-c", "0", "/x"], []])
def test_wrong_usage_of_ping(shell: Shell, words: list[str]) -> None:
    assert shell("node", "ping", *words).code == 2


def test_machine(shell: Shell, talker: Node) -> None:
    host = talker.process.host
    assert shell("node", "machine").lines == [host]
    assert shell("node", "machine", host).lines == ["/talker"]
    assert shell("node", "machine", "--json", host).json == ["/talker"]
    result = shell("node", "machine", "elsewhere")
    assert result.code == 1
    assert result.err == f"ERROR: no node runs on 'elsewhere'; nodes run on {host}\n"


def test_kill(shell: Shell, network: Network) -> None:
    network.node("stays")
    victim = network.program(NODE)
    victim.wait_for("ready")
    assert shell("node", "kill", "victim").out == "killing /victim\nkilled\n"
    assert shell("node", "list").lines == ["/stays"]
    assert victim.exit_code() == 0


def test_kill_one_of_a_list(shell: Shell, network: Network) -> None:
    network.node("stays")
    victim = network.program(NODE)
    victim.wait_for("ready")
    result = shell("node", "kill", stdin="x\n7\n2\n")
    assert result.code == 0
    assert result.out.startswith(
        "1. /stays\n2. /victim\n\nPlease enter the number of the node you wish to kill.\n> "
        "'x' is not one of them; enter a number from 1 to 2\n"
    )
    assert victim.exit_code() == 0


def test_kill_all(shell: Shell, network: Network) -> None:
    network.session()
    victims = [network.program(NODE.replace("victim", name)) for name in ("a", "b")]
    for victim in victims:
        victim.wait_for("ready")
    assert shell("node", "kill", "-a").out == "killing:\n * /a\n * /b\nkilled\n"
    assert [victim.exit_code() for victim in victims] == [0, 0]
    result = shell("node", "kill", "-a")
    assert (result.code, result.err) == (0, "No nodes running\n")


@pytest.mark.usefixtures("talker")
def test_kill_of_a_node_that_takes_no_requests(shell: Shell, foreign: str) -> None:
    result = shell("node", "kill", foreign)
    assert result.code == 1
    assert (
        "ERROR: Failed to kill:\n * /foreign: node '/foreign' does not take requests" in result.err
    )


@pytest.mark.usefixtures("talker")
def test_kill_of_an_unknown_node_kills_none(shell: Shell) -> None:
    assert shell("node", "kill", "/talker", "/nope").code == 1
    assert shell("node", "list").lines == ["/talker"]
    assert shell("node", "kill", "-a", "/talker").code == 2


def test_cleanup_has_nothing_to_do(shell: Shell) -> None:
    assert "nothing to clean up" in shell("node", "cleanup").out


def test_ping_without_a_node_where_none_runs(shell: Shell) -> None:
    with shell.network.session():
        result = shell("node", "ping")
    assert (result.code, result.out) == (2, "")
    assert result.err == "ERROR: no node is given; none is running\n"
