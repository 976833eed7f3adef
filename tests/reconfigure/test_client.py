from __future__ import annotations

import signal
import threading
from queue import SimpleQueue

import pytest
from network import TIMEOUT, Network, eventually

from rosz.errors import ClosedError, ParamError, ServiceError, ServiceNotFound, WaitTimeout
from rosz.reconfigure import Client, Config, Description, find_servers
from rosz.reconfigure import client as client_module

from .robots import ROBOT, Robot

SERVER = """
    import rosz, sys
    from rosz.reconfigure import Description, Server, Setting
    with rosz.Node("robot") as node:
        server = Server(node, Description([Setting("steps", 50, min=0, max=int(sys.argv[1]))]))
        print("ready", flush=True)
        node.spin()
"""


def test_it_reads_and_changes(network: Network) -> None:
    robot = Robot(network.node("robot"))
    with Client(network.node("other"), "robot") as client:
        client.wait()
        assert client.config() == robot.server.config
        assert client.update({"gain": "3", "size": "large"}) == robot.server.config
        assert client.config().gain == 3.0
        assert client.config().size == 2
        assert client.update_groups({"Deep": False}) == robot.server.config
        assert robot.server.config.groups.groups.Filter.groups.Deep.state is False


def test_the_description_is_the_servers(network: Network) -> None:
    Robot(network.node("robot"))
    client = Client(network.node("other"), "/robot")
    found = client.description()
    assert found.settings == ROBOT.settings
    assert [(group.name, group.type, parent) for group, parent in found.groups] == [
        (group.name, group.type, parent) for group, parent in ROBOT.groups
    ]


def test_callbacks(network: Network) -> None:
    robot = Robot(network.node("robot"))
    told: SimpleQueue[Config | Description] = SimpleQueue()
    client = Client(
        network.node("other"), "robot", config_callback=told.put, description_callback=told.put
    )
    assert isinstance(told.get(timeout=TIMEOUT), Description)
    first = told.get(timeout=TIMEOUT)
    assert isinstance(first, Config)
    assert first.steps == 50
    robot.server.update({"steps": 1})
    assert told.get(timeout=TIMEOUT) == robot.server.config
    client.update({"steps": 2})
    assert told.get(timeout=TIMEOUT) == robot.server.config


def test_what_it_gives_is_the_callers_own(network: Network) -> None:
    Robot(network.node("robot"))
    client = Client(network.node("other"), "robot")
    client.config().groups.state = "spoilt"
    assert client.config().groups.state is True


def test_a_callback_may_change_settings(network: Network, monkeypatch: pytest.MonkeyPatch) -> None:
    # Were it to wait for the announcement, which is its own to take in, it would take that long.
    monkeypatch.setattr(client_module, "_UPDATE_TIMEOUT", 2 * TIMEOUT)
    robot = Robot(network.node("robot"))
    done = threading.Event()

    def told(config: Config) -> None:
        if config.steps == 7:
            client.update({"steps": 8})
            done.set()

    client = Client(network.node("other"), "robot", config_callback=told)
    robot.server.update({"steps": 7})
    assert done.wait(TIMEOUT)
    eventually(lambda: client.config().steps == 8, "the change of the callback")
    assert robot.server.config.steps == 8


def test_a_change_holds_here_before_it_is_announced(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_module, "_UPDATE_TIMEOUT", 0.0)
    Robot(network.node("robot"))
    client = Client(network.node("other"), "robot")
    assert client.config().steps == 50
    client.update({"steps": 7})
    assert client.config().steps == 7


def test_reading_after_writing_never_finds_the_old_value(network: Network) -> None:
    Robot(network.node("robot"))
    client = Client(network.node("other"), "robot")
    for number in range(50):
        client.update({"steps": number})
        assert client.config().steps == number


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"gian": 1}, "there is no setting 'gian'; did you mean 'gain'?"),
        ({"steps": "x"}, "'steps' cannot be 'x': expected a whole number"),
    ],
)
def test_a_wrong_change_is_not_sent(
    network: Network, changes: dict[str, object], text: str
) -> None:
    robot = Robot(network.node("robot"))
    client = Client(network.node("other"), "robot")
    with pytest.raises(ParamError) as caught:
        client.update(changes)
    assert str(caught.value) == text
    assert len(robot.calls) == 1


def test_the_servers_refusal_arrives(network: Network) -> None:
    robot = Robot(network.node("robot"))
    robot.answer = {"steps": "nonsense"}
    client = Client(network.node("other"), "robot")
    with pytest.raises(ServiceError, match="'steps' cannot be 'nonsense'"):
        client.update({"steps": 1})
    assert client.config().steps == 50


def test_no_server(network: Network) -> None:
    Robot(network.node("robot"))
    node = network.node("other")
    node.context.graph.wait_for_service("/robot/set_parameters", TIMEOUT)
    client = Client(node, "robto", timeout=0.05)
    text = "no node with settings under '/robto' within 0.05 s; did you mean '/robot'?"
    for ask in (client.wait, client.config, client.description):
        with pytest.raises(WaitTimeout) as caught:
            ask()
        assert str(caught.value) == text
    with pytest.raises(WaitTimeout, match=r"within 0\.01 s"):
        client.update({"a": 1}, timeout=0.01)


def test_nobody_at_all(network: Network) -> None:
    client = Client(network.node("other"), "robot", timeout=0.05)
    with pytest.raises(WaitTimeout, match="no node has any on this network"):
        client.config()


def test_closing_ends_a_wait(network: Network) -> None:
    client = Client(network.node("other"), "robot")
    caught: SimpleQueue[Exception] = SimpleQueue()

    def wait() -> None:
        try:
            client.config(30)
        except ClosedError as error:
            caught.put(error)

    network.thread(wait)
    client.close()
    assert "'/robot' is closed" in str(caught.get(timeout=TIMEOUT))


def test_a_killed_and_restarted_server_is_followed(network: Network) -> None:
    program = network.program(SERVER, "100")
    program.wait_for("ready")
    node = network.node("other")
    client = Client(node, "robot")
    assert client.update({"steps": 200}).steps == 100
    program.kill()
    # The client follows its service by itself, and may hear of the end later than the graph.
    eventually(
        lambda: not (find_servers(node.context.graph.view()) or client._service.served),
        "the killed server is taken notice of",
    )
    with pytest.raises(ServiceNotFound):
        client.update({"steps": 1})
    network.program(SERVER, "500").wait_for("ready")
    eventually(lambda: client.description().setting("steps").max == 500, "the new description")
    assert client.update({"steps": 200}).steps == 200


def test_a_stopped_node_blocks_nobody(network: Network) -> None:
    living = Robot(network.node("living"))
    program = network.program(SERVER, "100")
    program.wait_for("ready")
    client = Client(living.server.node, "robot")
    client.config()
    program.send(signal.SIGSTOP)
    try:
        assert client.config().steps == 50
        with pytest.raises(WaitTimeout, match="is busy, stopped or out of reach"):
            client.update({"steps": 1}, timeout=0.5)
        node = network.node("late")
        with pytest.raises(WaitTimeout, match=r"within 0\.5 s"):
            Client(node, "robot", timeout=0.5).config()
        assert Client(node, "living").update({"steps": 1}).steps == 1
    finally:
        program.send(signal.SIGCONT)


def test_servers_are_found_by_their_type(network: Network) -> None:
    from rosz.msgs.rcl_interfaces.srv import SetParameters

    node = network.node("robot")
    Robot(node)
    Robot(node, "left")
    node.service("/ros2_node/set_parameters", SetParameters, lambda _: [])
    names = ["/robot", "/robot/left"]
    eventually(lambda: find_servers(node.context.graph.refresh()) == names, "both servers")
