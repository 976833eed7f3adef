"""Faults that the tokens show, each injected and named."""

from __future__ import annotations

import msgspec
from network import Network

from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.geometry_msgs.msg import Twist
from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.msgs.std_msgs.msg import Int32, String
from rosz.msgs.std_srvs.srv import Empty, SetBool
from rosz.qos import DEFAULT
from rosz.session import Session
from rosz.wire import NO_HASH, Kind, Token, format_token

from .conftest import Doctor


def stranger(network: Network, **changes: object) -> Session:
    """Have a ROS 2 node publish /scan, as far as its tokens tell."""
    session = network.session()
    node = Token(network.domain, session.zid, 0, 0, Kind.NODE, "/", "stranger")
    end = msgspec.structs.replace(
        node,
        entity_id=1,
        kind=Kind.PUBLISHER,
        name="/scan",
        type_name="std_msgs/msg/String",
        type_hash=String._type_hash,
        qos=DEFAULT,
    )
    for token in (node, msgspec.structs.replace(end, **changes)):
        network._keep(session.token(format_token(token)))
    return session


def test_a_healthy_system(doctor: Doctor, network: Network) -> None:
    talker, listener = network.node("talker"), network.node("listener")
    talker.publisher("/chatter", String)
    listener.subscription("/chatter", String, lambda _: None)
    listener.service("/reset", Empty, lambda _: Empty.Response())
    listener.params["/speed"] = 3
    assert doctor() == {}


def test_types_that_differ(doctor: Doctor, network: Network) -> None:
    network.node("talker").publisher("/chatter", String)
    network.node("listener").subscription("/chatter", Int32, lambda _: None)
    finding = doctor()["type-mismatch"]
    assert finding.level == "error"
    assert finding.text.startswith("topic /chatter has several types")
    assert [line.split()[0] for line in finding.evidence] == ["/listener", "/talker"]
    assert finding.evidence[0].endswith("subscribes std_msgs/Int32")


def test_service_types_that_differ(doctor: Doctor, network: Network) -> None:
    network.node("server").service("/do", Empty, lambda _: Empty.Response())
    network.node("caller").client("/do", SetBool)
    assert doctor()["type-mismatch"].text.startswith("service /do has several types")


def test_definitions_that_differ(doctor: Doctor, network: Network) -> None:
    network.node("listener").subscription("/scan", String, lambda _: None)
    stranger(network, type_hash="RIHS01_" + "a" * 64)
    found = doctor()
    assert "different definitions of std_msgs/String" in found["hash-mismatch"].text
    assert "package 'std_msgs'" in found["hash-mismatch"].remedy
    assert found["other-definition"].evidence[0].startswith("/scan: /stranger")


def test_an_rmw_zenoh_without_hashes(doctor: Doctor, network: Network) -> None:
    stranger(network, type_hash=NO_HASH)
    finding = doctor()["old-rmw-zenoh"]
    assert finding.level == "error"
    assert finding.evidence[0].startswith("/stranger (session ")
    assert "old-rmw-zenoh" not in doctor(distro="humble")


def test_a_package_that_is_missing(doctor: Doctor, network: Network) -> None:
    stranger(network, type_name="nowhere_msgs/msg/Thing")
    finding = doctor()["missing-package"]
    assert finding.level == "error"
    assert "there is no package 'nowhere_msgs'" in finding.text
    assert finding.evidence[0].startswith("/scan: /stranger")


def test_a_definition_that_is_broken_here(doctor: Doctor, network: Network) -> None:
    package = network.folder / "src" / "odd_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>odd_msgs</name></package>")
    (package / "msg" / "Odd.msg").write_text("int3 x\n")
    stranger(network, type_name="odd_msgs/msg/Odd")
    finding = doctor(package_roots=(network.folder / "src",))["bad-definition"]
    assert "Odd.msg:1:1" in finding.text


def test_who_waits_for_nobody(doctor: Doctor, network: Network) -> None:
    node = network.node("alone")
    node.publisher("/chatter", String)
    node.subscription("/chater", String, lambda _: None)
    node.subscription("/cmd_vel", Twist, lambda _: None)
    node.client("/reset", Empty)
    found = doctor()
    assert [found[name].level for name in ("no-publisher", "no-subscriber")] == ["warning"] * 2
    assert [line.split()[0] for line in found["no-publisher"].evidence] == [
        "/chater",
        "/cmd_vel",
        "/reset",
    ]
    assert found["no-publisher"].evidence[0].endswith("is it meant for '/chatter'?")
    assert found["no-subscriber"].evidence[0].endswith("is it meant for '/chater'?")


def test_what_action_servers_publish(doctor: Doctor, network: Network) -> None:
    """Nobody has to listen to an action server; but a client of one waits for it."""
    node = network.node("alone")
    node.action_server("/fibonacci", Fibonacci, print)
    assert doctor() == {}
    node.action_client("/dock", Fibonacci)
    found = doctor()
    assert list(found) == ["no-publisher"]
    assert {line.split()[0] for line in found["no-publisher"].evidence} >= {
        "/dock/_action/feedback",
        "/dock/_action/status",
    }


def test_time_that_stands_still(doctor: Doctor, network: Network) -> None:
    simulator = network.node("simulator")
    simulator.params["/use_sim_time"] = True
    network.node("robot")
    finding = doctor()["no-clock"]
    assert finding.level == "error"
    assert [line.split()[0] for line in finding.evidence] == ["/robot"]
    simulator.publisher("/clock", Clock)
    assert "no-clock" not in doctor()


def test_nodes_of_one_name(doctor: Doctor, network: Network) -> None:
    stranger(network)
    stranger(network)
    finding = doctor()["duplicate-node"]
    assert finding.text == "2 nodes are called /stranger"
    assert len(finding.evidence) == 2


def test_names_that_others_refuse(doctor: Doctor, network: Network) -> None:
    stranger(network, name="/my scan")
    (line,) = doctor()["refused-name"].evidence
    assert line.startswith("/stranger (session ")
    assert "'/my scan' is not a valid name" in line


def test_tokens_of_another_form(doctor: Doctor, network: Network) -> None:
    session = network.session()
    network._keep(session.token(f"@ros2_lv/{network.domain}/{session.zid}/0/NN/odd"))
    assert "odd" in doctor()["unreadable-tokens"].evidence[0]
