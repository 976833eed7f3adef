"""Faults between machines, each injected and named."""

from __future__ import annotations

import json
import re
import signal
import struct
import threading
import time
from collections.abc import Callable

import pytest
from network import Network, Program, eventually

from rosz.msgs.std_msgs.msg import String
from rosz.node.control import control_key
from rosz.params.wire import Keys, ReplicaMember, SyncReply, encode
from rosz.session import Query, Session, is_stopped
from rosz.wire import entity_key, pack_attachment

from .conftest import Doctor
from .test_tokens import stranger

Sample = Callable[[Callable[[], bytes]], None]
NODE = """
    import sys
    import rosz
    node = rosz.Node(sys.argv[1])
    node.params.get("/speed", 0)
    print("up", flush=True)
    node.spin()
    """


def start(network: Network, name: str, **variables: str) -> Program:
    program = network.program(NODE, name, **variables)
    program.wait_for("up")
    return program


def answering(network: Network, session: Session, key: str, payload: bytes) -> None:
    """Have a session answer a key."""

    def answer(query: Query) -> None:
        with query:
            query.reply(key, payload)

    network._keep(
        session.queryable(key, lambda query: threading.Thread(target=answer, args=(query,)).start())
    )


def stop(program: Program) -> None:
    program.send(signal.SIGSTOP)
    eventually(lambda: is_stopped(program.pid), "the program is stopped")


def test_the_wrong_domain(doctor: Doctor, network: Network) -> None:
    network.node("talker").publisher("/chatter", String)
    finding = doctor(domain=7)["wrong-domain"]
    assert finding.level == "error"
    assert finding.evidence == ("domain 42: /talker",)
    assert "here it is 7" in finding.remedy


def test_a_wrong_domain_beside_a_right_one(doctor: Doctor, network: Network) -> None:
    network.node("talker", context=network.context(domain=7)).publisher("/chatter", String)
    here = network.node("listener")
    assert "wrong-domain" not in doctor()
    here.subscription("/chatter", String, lambda _: None)
    assert doctor()["wrong-domain"].evidence == (
        "/chatter: /talker of domain 7 is what /listener of domain 42 lacks",
    )


def test_a_node_that_hangs(doctor: Doctor, network: Network) -> None:
    network.node("holder")
    program = start(network, "stopped")
    stop(program)
    try:
        found = doctor(somebody_hangs=True)
    finally:
        program.send(signal.SIGCONT)
    assert found["unreachable-node"].level == "error"
    assert found["unreachable-node"].text == "1 node is listed without an answer"
    assert found["unreachable-node"].evidence[0].startswith("/stopped (")
    assert found["unreachable-node"].evidence[0].endswith(f"pid {program.pid}): it is stopped")
    assert found["stopped-process"].evidence[0].endswith(f"(pid {program.pid})")
    assert f"'kill -CONT {program.pid}'" in found["stopped-process"].remedy
    assert found["replica-silent"].evidence[0].endswith(")")


def test_answers_that_make_no_sense(doctor: Doctor, network: Network) -> None:
    network.node("holder")
    session = network.context().session
    for number in ("99", "x"):
        key = control_key(network.domain, session.zid, number)
        answering(network, session, key, b"\xc1")
    assert "unreachable-node" not in doctor()


def test_who_holds_the_meeting_point_is_stopped(doctor: Doctor, network: Network) -> None:
    program = start(network, "stopped")
    stop(program)
    try:
        alone = doctor(somebody_hangs=True)
        start(network, "newcomer")
        found = doctor(somebody_hangs=True)
    finally:
        program.send(signal.SIGCONT)
    assert list(alone) == ["stopped-process", "nobody-there"]
    assert (
        f"(pid {program.pid}), which holds the meeting point"
        in (found["stopped-process"].evidence[0])
    )
    assert not {"rendezvous-held", "unreachable-peer", "nobody-there"} & set(found)


def test_nodes_that_do_not_see_each_other(doctor: Doctor, network: Network) -> None:
    network.node("holder")
    for name in ("left", "right"):
        start(network, name, ZENOH_CONFIG_OVERRIDE="scouting/gossip/enabled=false")
    finding = doctor()["unreachable-peer"]
    (line,) = finding.evidence
    assert {"/left", "/right"} < set(line.split())
    assert line.endswith("do not see each other")


def test_a_node_that_sees_one_way(doctor: Doctor, network: Network) -> None:
    network.node("holder")
    rules = {
        "enabled": True,
        "default_permission": "allow",
        "rules": [
            {
                "id": "blind",
                "permission": "deny",
                "flows": ["ingress"],
                "messages": ["liveliness_token"],
                "key_exprs": [f"{space}/{network.domain}/**" for space in ("@ros2_lv", "@rosz")],
            }
        ],
        "subjects": [{"id": "all"}],
        "policies": [{"rules": ["blind"], "subjects": ["all"]}],
    }
    start(network, "blind", ZENOH_CONFIG_OVERRIDE=f"access_control={json.dumps(rules)}")
    finding = doctor()["unreachable-peer"]
    (line,) = finding.evidence
    assert line.startswith("/blind (")
    assert "does not see /holder (" in line
    assert line.endswith(": one way")


def test_a_clock_that_is_off(doctor: Doctor, network: Network) -> None:
    network.node("holder")
    program = network.program(
        """
        import time
        real = time.time_ns
        time.time_ns = lambda: real() + 30_000_000_000
        import rosz
        node = rosz.Node("early")
        print("up", flush=True)
        node.spin()
        """
    )
    program.wait_for("up")
    finding = doctor()["clock-offset"]
    (line,) = finding.evidence
    assert line.startswith("/early (")
    seconds = re.search(r"([\d.]+) s ahead of the one here", line)
    assert seconds is not None
    assert 20 < float(seconds[1]) < 40  # it is off by half the time of a slow answer


@pytest.fixture
def sample(network: Network) -> Sample:
    """Have a ROS 2 node send samples with an attachment, as long as the test goes on."""

    def send(attach: Callable[[], bytes]) -> None:
        session = stranger(network)
        key = entity_key(network.domain, "/scan", "std_msgs/msg/String", String._type_hash)
        stop = threading.Event()

        def run() -> None:
            while not stop.wait(0.02) and not session.closed:
                session.put(key, b"\0\1\0\0\1\0\0\0\0", attachment=attach())

        class Stop:
            def close(self) -> None:
                stop.set()
                thread.join()

        thread = threading.Thread(target=run)
        thread.start()
        network._keep(Stop())

    return send


def test_stamps_of_a_clock_that_is_off(doctor: Doctor, sample: Sample) -> None:
    sample(lambda: pack_attachment(1, time.time_ns() - 60_000_000_000, bytes(16)))
    finding = doctor(listen=15.0)["clock-offset"]
    (line,) = finding.evidence
    assert line.startswith("/stranger (")
    assert "s behind the clock here" in line


def test_samples_of_an_older_release(doctor: Doctor, sample: Sample) -> None:
    sample(lambda: bytes(77))
    finding = doctor(listen=15.0)["old-rmw-zenoh"]
    assert "rmw_zenoh before 0.2.5" in finding.evidence[0]


def test_good_stamps(doctor: Doctor, sample: Sample) -> None:
    sample(lambda: pack_attachment(1, time.time_ns(), bytes(16)))
    assert set(doctor(listen=0.5)) == {"no-subscriber"}


def test_a_replica_out_of_step(doctor: Doctor, network: Network) -> None:
    for name in ("one", "two"):
        network.node(name).params["/speed"] = 3
    session, keys = network.session(), Keys(network.domain)
    odd = SyncReply(digest=b"".join(struct.pack("<BQ", index, 1) for index in range(64)))
    answering(network, session, keys.of(session.zid, "sync"), encode(odd))
    network._keep(session.token(keys.token(ReplicaMember(1, session.zid, "odd one"))))
    eventually(lambda: len(session.peers()) == 2, "links to both")
    finding = doctor()["replica-out-of-step"]
    (line,) = finding.evidence
    assert line.startswith(f"odd one (session {session.zid})")
    assert line.endswith("other writes in 64 of 64 buckets")


def test_writes_on_their_way_are_no_fault(doctor: Doctor, network: Network) -> None:
    one, two = network.node("one"), network.node("two")
    stop = threading.Event()

    def write() -> None:
        number = 0
        while not stop.is_set():
            one.params["/count"] = number
            number += 1

    thread = network.thread(write)
    try:
        assert two.params.get("/count", 0) >= 0
        found = doctor()
    finally:
        stop.set()
        thread.join()
    assert "replica-out-of-step" not in found


def test_an_old_zenoh(doctor: Doctor, network: Network) -> None:
    session = network.session()
    answering(network, session, f"@/{session.zid}/router", b'{"version": "v0.11.0-rc"}')
    finding = doctor()["old-zenoh"]
    assert finding.evidence == (f"router {session.zid}: Zenoh v0.11.0-rc",)


def test_a_new_zenoh_tells_so(doctor: Doctor, network: Network) -> None:
    network.node("holder")
    start(network, "open", ZENOH_CONFIG_OVERRIDE="adminspace/enabled=true")
    assert doctor() == {}
