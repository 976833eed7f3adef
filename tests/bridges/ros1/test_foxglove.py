"""npm's ``@foxglove/ros1``, an independent implementation of ROS 1's protocol."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path
from queue import SimpleQueue

import pytest
from network import TIMEOUT, Network, Program, eventually

from rosz.bridges.ros1 import MasterBridge
from rosz.msgs.std_msgs.msg import String

pytestmark = [pytest.mark.ros1, pytest.mark.system]

_PACKAGES = ("@foxglove/ros1@3", "tslib@2")  # the first needs the other, and does not say so
_INSTALL_SECONDS = 100
_PROGRAM = """
const { RosNode } = require("@foxglove/ros1");
const { TcpServerNode, TcpSocketNode, getPid } = require("@foxglove/ros1/nodejs");
const { HttpServerNodejs } = require("@foxglove/xmlrpc/nodejs");

async function main() {
  const node = new RosNode({
    name: "/foxglove", hostname: "127.0.0.1", pid: getPid(),
    rosMasterUri: process.env.ROS_MASTER_URI,
    httpServer: new HttpServerNodejs(),
    tcpSocketCreate: TcpSocketNode.Create,
    tcpServer: await TcpServerNode.Listen({ host: "127.0.0.1" }),
  });
  node.on("error", (error) => console.log("error", error.message));
  await node.start();
  node.on("paramUpdate", ({ key, value }) => console.log("update", key, JSON.stringify(value)));
  const known = await node.subscribeAllParams();
  console.log("params", JSON.stringify(known.get("/robot/wheels")));
  await node.setParameter("/of_foxglove", [1, "two", 3.5, true]);
  const heard = node.subscribe({ topic: "/of_rosz", dataType: "std_msgs/String" });
  heard.on("message", (message, _data, publisher) =>
    console.log("heard", message.data, publisher.connection.header().get("callerid")));
  await node.advertise({
    topic: "/of_foxglove", dataType: "std_msgs/String", latching: true,
    messageDefinition: [{ definitions: [{ name: "data", type: "string" }] }],
  });
  await node.publish("/of_foxglove", { data: "from npm" });
  console.log("ready");
}
main();
"""


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    network = Network()
    try:
        folder = network.folder / "npm"
        folder.mkdir()
        (folder / "package.json").write_text("{}")
        (folder / "program.js").write_text(_PROGRAM)
        done = subprocess.run(
            ["npm", "install", "--no-audit", "--no-fund", *_PACKAGES],
            cwd=folder,
            check=False,
            capture_output=True,
            text=True,
            timeout=_INSTALL_SECONDS,
        )
        if done.returncode:
            pytest.skip(f"npm cannot install {_PACKAGES[0]}: {done.stderr[-200:]}")
        yield folder
    except (FileNotFoundError, subprocess.TimeoutExpired) as error:
        pytest.skip(f"needs npm and its registry: {error}")
    finally:
        network.close()


def test_another_implementation_of_ros_1_takes_part(folder: Path, network: Network) -> None:
    node = network.node("neighbour")
    node.params["/robot"] = {"name": "r2", "wheels": [1, 2]}
    node.publisher("/of_rosz", String, latch=True).publish("from rosz")
    heard: SimpleQueue[String] = SimpleQueue()
    node.subscription("/of_foxglove", String, heard.put)
    with MasterBridge(network.environment(), port=0) as bridge:
        variables = {
            "PATH": "/usr/local/bin:/usr/bin:/bin",
            "ROS_MASTER_URI": f"http://127.0.0.1:{bridge.port}/",
        }
        program = Program(["node", "program.js"], variables, folder)
        try:
            program.wait_for("params [1,2]")
            program.wait_for("ready")
            assert heard.get(timeout=TIMEOUT).data == "from npm"
            program.wait_for("heard from rosz /neighbour")
            eventually(lambda: node.params.get("/of_foxglove", None) == [1, "two", 3.5, True])
            node.params["/robot/name"] = "c3"
            program.wait_for('update /robot/name "c3"')
            assert "error" not in program.output
        finally:
            program.close()
        eventually(lambda: "/foxglove" not in bridge.nodes())
