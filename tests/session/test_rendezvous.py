"""The rendezvous of the sessions of one machine, also after the death of the first session."""

from __future__ import annotations

import signal
import socket
import threading
from collections.abc import Iterator

import pytest
from network import TIMEOUT, Network, Program, eventually, free_port

from rosz.environment import Environment
from rosz.errors import TransportError
from rosz.node import Context, Node
from rosz.session import Session, SessionConfig, config, zenoh_workarounds

PEER = """
    import sys
    import rosz
    from rosz.msgs.std_msgs.msg import String

    with rosz.Node(sys.argv[1]) as node:
        heard = set()

        def hear(message):
            if message.data not in heard:
                heard.add(message.data)
                print("heard", message.data, flush=True)

        node.subscription("names", String, hear)
        names = node.publisher("names", String)
        print("ready", flush=True)
        for tick in node.rate(50):
            names.publish(sys.argv[1])
"""


@pytest.fixture(params=["unixsock", "private", "tcp"])
def place(request: pytest.FixtureRequest) -> Iterator[Network]:
    made = Network()
    if request.param == "private":
        made.folder.chmod(0o700)
    if request.param == "tcp":
        made.rendezvous = f"tcp/127.0.0.1:{free_port()}"
    yield made
    made.close()


def peer(place: Network, name: str) -> Program:
    program = place.program(PEER, name)
    program.wait_for("ready")
    return program


def test_two_scripts_find_each_other(place: Network) -> None:
    one, two = peer(place, "one"), peer(place, "two")
    one.wait_for("heard two")
    two.wait_for("heard one")


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM], ids=["killed", "ended"])
def test_the_first_dies(place: Network, number: signal.Signals) -> None:
    """The others keep their links, and find newcomers."""
    first, second, third = (peer(place, name) for name in ("first", "second", "third"))
    third.wait_for("heard second")
    second.wait_for("heard third")
    first.send(number)
    first.exit_code()
    for name in ("fourth", "fifth"):
        newcomer = peer(place, name)
        for other in (second, third):
            other.wait_for(f"heard {name}")
        newcomer.wait_for("heard second")
        newcomer.wait_for("heard third")


def test_many_at_once(place: Network) -> None:
    """All meet, whichever is first."""
    names = [f"n{number}" for number in range(4)]
    programs = [place.program(PEER, name) for name in names]
    for name, program in zip(names, programs, strict=True):
        for other in names:
            if other != name:
                program.wait_for(f"heard {other}")


def test_a_router_takes_the_place(place: Network) -> None:
    """Peers and clients find each other through it."""
    router = Session.open(SessionConfig(mode="router", rendezvous=place.rendezvous))
    with router:
        nodes = [
            place.node("peer", context=place.context()),
            place.node("client", context=place.context(mode="client")),
        ]
        for node in nodes:
            graph = node.context.graph
            graph.wait_for(lambda view: len(view.nodes()) == 2, TIMEOUT, "the other node")


def test_client_waits_for_its_router(place: Network) -> None:
    """A user who starts both cannot know which of them is up first."""
    program = place.program(PEER, "early", ROSZ_MODE="client")
    with Session.open(SessionConfig(mode="router", rendezvous=place.rendezvous)):
        program.wait_for("ready")
        late = place.node("late", context=place.context(mode="client"))
        late.context.graph.wait_for_node("/early", TIMEOUT)


def test_client_without_a_router(place: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(config, "_ROUTER_TIMEOUT", 0.2)
    with pytest.raises(
        TransportError,
        match=f"^nobody answers at '{place.rendezvous}' within 0.2 s: start 'rosz core', ",
    ):
        place.context(mode="client")


def test_command_finds_nobody(place: Network) -> None:
    with pytest.raises(TransportError, match=r"nobody answers at .* within 0\.2 s"):
        Session.open(SessionConfig.command(place.environment(), timeout=0.2))


def test_command_sees_all_at_once(place: Network) -> None:
    """The first query of a new session gets all tokens."""
    for name in ("one", "two", "three"):
        place.node(name)
    for _ in range(5):
        with Session.open(SessionConfig.command(place.environment())) as session:
            tokens = session.live_tokens("@ros2_lv/42/*/*/*/NN/**", TIMEOUT)
        assert sorted(token.rpartition("/")[2] for token in tokens) == ["one", "three", "two"]


def test_links_heal(network: Network) -> None:
    """A peer whose rendezvous comes and goes finds the next one."""
    node = network.node("lasting")
    for number in range(3):
        with Session.open(SessionConfig.node(network.environment())) as session:
            eventually(lambda: node.context.session.zid in session.peers(), f"link {number}")
        eventually(lambda: not node.context.session.peers(), f"end of link {number}")


def test_domain_and_rendezvous_of_the_environment() -> None:
    env = Environment.read({"ROS_DOMAIN_ID": "7", "ROSZ_RENDEZVOUS": "tcp/localhost:7448"})
    found = SessionConfig.node(env)
    assert (found.mode, found.rendezvous) == ("peer", "tcp/localhost:7448")


def test_several_contexts_of_one_process(network: Network) -> None:
    """Each has a session of its own; those of one domain see each other."""
    one, two, other = network.context(), network.context(), network.context(domain=7)
    nodes = [
        Node(name, context=context) for name, context in zip("abc", (one, two, other), strict=True)
    ]
    one.graph.wait_for_node("/b", TIMEOUT)
    two.graph.wait_for_node("/a", TIMEOUT)
    eventually(lambda: other.graph.view().nodes() == ["/c"], "one node there")
    one.close()
    assert [node.is_shutdown for node in nodes] == [True, False, False]
    two.graph.wait_for(lambda view: view.nodes() == ["/b"], TIMEOUT, "the end of a")


def test_stop_and_go(network: Network) -> None:
    """Contexts that open and close at the same time, from many threads."""
    network.context()
    errors: list[BaseException] = []

    def work() -> None:
        try:
            for _ in range(3):
                with Context(network.environment()) as context:
                    Node("n", context=context, anonymous=True)
        except BaseException as error:  # noqa: BLE001  # any exception is a failure
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(TIMEOUT * 2)
    assert not errors
    assert not any(thread.is_alive() for thread in threads)


def test_killed_processes_leave_no_private_sockets(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    network.folder.chmod(0o700)
    killed, _ = peer(network, "killed"), peer(network, "lasting")
    before = set(network.folder.glob("z.sock.*.lock"))
    assert len(before) == 2
    killed.kill()
    monkeypatch.setattr(zenoh_workarounds, "_MIN_AGE", 0.0)
    network.session()
    (left,) = before & set(network.folder.glob("z.sock.*.lock"))
    sockets = {path.name for path in network.folder.glob("z.sock.*[0-9a-f]")}
    assert left.name.removesuffix(".lock") in sockets
    assert len(sockets) == 2  # that one, and the new session's
    network.node("other").context.graph.wait_for_node("/lasting", TIMEOUT)


def test_a_unix_socket_in_no_folder(network: Network) -> None:
    nowhere = SessionConfig(rendezvous=f"unixsock-stream/{network.folder}/nowhere/z.sock")
    with pytest.raises(TransportError, match=r"there is no folder '.*/nowhere'"):
        Session.open(nowhere)


def test_a_client_waits_for_another_machine(network: Network) -> None:
    """What accepts its connections at first, such as a forwarded port, does not speak Zenoh."""
    port = free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    with socket.create_server(("127.0.0.1", port)):
        early = network.program(PEER, "early", ROSZ_CONNECT=endpoint)
        early.wait_for(f"waiting for {endpoint}")
    with Session.open(SessionConfig(mode="router", rendezvous=endpoint)):
        early.wait_for(f"connected to {endpoint}")
        early.wait_for("ready")


def test_ctrl_c_ends_a_client_that_waits(network: Network) -> None:
    nobody = f"tcp/127.0.0.1:{free_port()}"
    early = network.program(PEER, "early", ROSZ_CONNECT=nobody)
    early.wait_for(f"waiting for {nobody}")
    early.send(signal.SIGINT)
    assert early.exit_code() == -signal.SIGINT
    assert "Traceback" not in early.output
