"""A bridge beyond this machine: passwords, keys, rules and origins."""

from __future__ import annotations

import json
import ssl
from pathlib import Path
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually, free_port
from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from rosz.bridges.rosbridge import RosbridgeSettings, open_bridge
from rosz.errors import UsageError
from rosz.msgs.geometry_msgs.msg import TransformStamped
from rosz.msgs.std_msgs.msg import Header
from rosz.security import Authority, KeyFolder
from rosz.transforms import StaticTransformBroadcaster

from .bridge import Client

pytestmark = pytest.mark.system

EVERYWHERE = "0.0.0.0"  # what is tested
PAGE = Origin("https://robot.example")
RULES = "websocket: {subscribe: ['/odom'], get: true}\n"


def test_keys(network: Network, tmp_path: Path) -> None:
    """Links are encrypted with the keys of the machine, and its rules hold for clients."""
    authority = Authority.create(tmp_path / "keys")
    folder = authority.add("robot")
    (folder / "rules.yaml").write_text(RULES)
    authority_file = KeyFolder.find(folder, "robot").authority
    node = network.node("bridge", context=network.context(keys=folder))
    bridge, lines = open_bridge(node, RosbridgeSettings(host=EVERYWHERE, port=0))
    assert len(lines) == 1, lines
    scheme, _, address = lines[0].split()[-1].partition("://")
    assert scheme == "wss"
    place, _, token = address.partition("/?token=")
    assert place.endswith(f":{bridge.port}")
    trusting = ssl.create_default_context(cafile=authority_file)
    url = f"wss://127.0.0.1:{bridge.port}/"
    options: dict[str, Any] = {"ssl": trusting, "server_hostname": "robot", "open_timeout": TIMEOUT}
    with bridge:
        for origin in (None, PAGE):
            known = connect(f"{url}?token={token}", origin=origin, **options)
            with known as connection:
                client = Client(connection)
                client.sync()
                assert isinstance(connection.socket, ssl.SSLSocket)
                assert connection.socket.session is not None
                assert not connection.socket.session.has_ticket  # it would come unasked
                client.send("advertise", topic="/odom", type="std_msgs/String")
                assert "the rules of this machine" in client.receive_op("status")["msg"]
                client.send("subscribe", topic="/odom", type="std_msgs/String")
                client.sync()
        with pytest.raises(InvalidStatus, match="401"):
            connect(f"{url}?token=wrong", **options)
        with pytest.raises(InvalidStatus, match="403"):
            connect(url, origin=PAGE, **options)
        with pytest.raises(ssl.SSLCertVerificationError):
            connect(url, ssl=ssl.create_default_context(), server_hostname="robot")
        with pytest.raises((InvalidMessage, ConnectionError)):
            connect(f"ws://127.0.0.1:{bridge.port}/?token={token}")


def test_a_password_file(network: Network, tmp_path: Path) -> None:
    file = tmp_path / "password"
    settings = RosbridgeSettings(host=EVERYWHERE, port=0, password_file=str(file))
    node = network.node("bridge")
    with pytest.raises(UsageError, match="cannot read the password"):
        open_bridge(node, settings)
    file.write_text("\n")
    with pytest.raises(UsageError, match="no password in its first line"):
        open_bridge(node, settings)
    file.write_text("secret\n")
    bridge, lines = open_bridge(node, settings)
    with bridge:
        assert "secret" not in "".join(lines)
        assert "unencrypted" in lines[1]
        with connect(f"ws://127.0.0.1:{bridge.port}/?token=secret") as connection:
            Client(connection).sync()


def test_a_password_on_this_machine(network: Network) -> None:
    settings = RosbridgeSettings(port=0, authenticate=True, fragment_size=50)
    bridge, lines = open_bridge(network.node("bridge"), settings)
    with bridge:
        with connect(f"ws://127.0.0.1:{bridge.port}") as connection:
            Client(connection).send("subscribe", topic="/x")
            with pytest.raises(ConnectionClosed, match="password is missing"):
                connection.recv(timeout=TIMEOUT)
        with connect(lines[0].split()[-1]) as connection:
            client = Client(connection)
            client.send("call_service", service="/rosapi/nodes")
            assert len(client.receive_op("fragment")["data"]) == 50


LAUNCH = """
<launch>
  <include file="$(find rosbridge_server)/launch/rosbridge_websocket.launch">
    <arg name="port" value="$(env PORT)" />
    <arg name="authenticate" value="true" />
    <arg name="max_message_size" value="50" />
    <arg name="unregister_timeout" value="10" />
    <arg name="topics_glob" value="[/tf, /tf_static, /tf2_web_republisher/*]" />
  </include>
  <node pkg="tf2_web_republisher" type="tf2_web_republisher" name="tf2_web_republisher" />
</launch>
"""


def joined(client: Client) -> str:
    """Return the next text that comes in parts."""
    parts = [client.receive_op("fragment")]
    while len(parts) < parts[0]["total"]:
        parts.append(client.receive_op("fragment"))
    return "".join(part["data"] for part in parts)


def test_launch_files(network: Network) -> None:
    """The programs of a launch file for web pages start, with arguments as rosbridge_suite's."""
    node = network.node("other")
    transform = TransformStamped(Header(frame_id="map"), "base")
    StaticTransformBroadcaster(node).send(transform)
    port = free_port()
    file = network.folder / "pages.launch"
    file.write_text(LAUNCH)
    launch = network.run("-m", "rosz", "launch", str(file), PORT=str(port))
    graph = node.context.graph
    graph.wait_for_service("/republish_tfs", 4 * TIMEOUT)
    graph.wait_for_service("/rosapi/topics", 4 * TIMEOUT)
    url = launch.wait_for("rosbridge clients connect", 4 * TIMEOUT).split()[-1]
    with connect(url, open_timeout=TIMEOUT) as connection:
        client = Client(connection)
        request = {"source_frames": ["base"], "target_frame": "map", "rate": 20}

        def values() -> Any:
            client.send("call_service", service="/republish_tfs", args=request)
            return json.loads(joined(client))["values"]

        # The bridge may come to know of the service later than this process.
        eventually(lambda: values() == {"topic_name": "/tf_repub_1"}, "a topic of transforms")
        client.send("subscribe", topic="/odom", type="std_msgs/String")
        assert "patterns of this bridge" in joined(client)
