"""Programs that use npm's ``@foxglove/ws-protocol`` in Node.js, and decode what it receives."""

from __future__ import annotations

import shutil
import subprocess
from array import array
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, Program, eventually

from rosz.msgs.rosgraph_msgs.msg import Clock
from rosz.msgs.sensor_msgs.msg import LaserScan
from rosz.msgs.std_msgs.msg import Header, String, Time
from rosz.msgs.std_srvs.srv import SetBool
from rosz.node import Node, simulate

from .bridge import bridge_on, package_in

pytestmark = [pytest.mark.system]

_PACKAGES = (
    "@foxglove/ws-protocol@0.8",
    "@foxglove/rosmsg@5",
    "@foxglove/rosmsg2-serialization@3",
    "ws@8",
)

SCRIPT = """
import protocol from "@foxglove/ws-protocol";
import rosmsg from "@foxglove/rosmsg";
import serialization from "@foxglove/rosmsg2-serialization";
import WebSocket from "ws";
const [port] = process.argv.slice(2);
const { FoxgloveClient } = protocol;
const { MessageReader, MessageWriter } = serialization;
const url = `ws://127.0.0.1:${port}`;
const subprotocol = [FoxgloveClient.SUPPORTED_SUBPROTOCOL];
const client = new FoxgloveClient({ ws: new WebSocket(url, subprotocol) });
const shown = (_, one) => typeof one === "bigint" ? Number(one)
  : ArrayBuffer.isView(one) ? Array.from(one) : one;
const say = (...words) =>
  console.log(...words.map((one) => typeof one === "string" ? one : JSON.stringify(one, shown)));
const once = (event, fits = () => true) => new Promise((done) => {
  const hear = (value) => { if (fits(value)) { client.off(event, hear); done(value); } };
  client.on(event, hear);
});
const parsed = (schema) => rosmsg.parse(schema, { ros2: true });
const channels = new Map();
const services = new Map();
const changed = [];
const wake = () => changed.splice(0).forEach((one) => one());
client.on("advertise", (found) => {
  found.forEach((one) => channels.set(one.topic, one));
  wake();
});
client.on("advertiseServices", (found) => {
  found.forEach((one) => services.set(one.name, one));
  wake();
});
const get = async (known, name) => {
  while (!known.has(name)) await new Promise((done) => changed.push(done));
  return known.get(name);
};
client.on("error", (error) => say("error", error.message));
client.on("status", (status) => say("status", status.message));
const info = await once("serverInfo");
say("capabilities", info.capabilities, info.supportedEncodings, info.metadata.ROS_DISTRO);

for (const topic of ["/scan", "/time"]) {
  const channel = await get(channels, topic);
  const id = client.subscribe(channel.id);
  const message = await once("message", (one) => one.subscriptionId === id);
  client.unsubscribe(id);
  const reader = new MessageReader(parsed(channel.schema));
  say(topic, channel.schemaName, reader.readMessage(message.data), Number(message.timestamp));
}
client.on("time", (time) => say("time", Number(time.timestamp)));
say("go");

const text = parsed("string data");
const bytes = new MessageWriter(text).writeMessage({ data: "cdr from npm" });
const cdr = { topic: "/up", encoding: "cdr", schemaName: "std_msgs/msg/String" };
const first = client.advertise(cdr);
client.sendMessage(first, bytes);
const second = client.advertise({ ...cdr, encoding: "json" });
client.sendMessage(second, new TextEncoder().encode('{"data": "json from npm"}'));
client.unadvertise(first);

const flip = await get(services, "/flip");
const writer = new MessageWriter(parsed(flip.request.schema));
const reader = new MessageReader(parsed(flip.response.schema));
const call = (callId, data) => client.sendServiceCallRequest(
  { serviceId: flip.id, callId, encoding: "cdr", data: writer.writeMessage({ data }) });
call(1, true);
say("response", reader.readMessage((await once("serviceCallResponse")).data));
call(2, false);
say("failure", (await once("serviceCallFailure")).message);

client.getParameters(["/gains/p"], "one");
say("got", (await once("parameterValues", (one) => one.id === "one")).parameters);
client.subscribeParameterUpdates(["/gains/p"]);
client.setParameters([{ name: "/gains/p", value: 3, type: "float64" }], "two");
say("updated", (await once("parameterValues", (one) => one.id === undefined)).parameters);
client.unsubscribeParameterUpdates(["/gains/p"]);

client.subscribeConnectionGraph();
const graph = await once("connectionGraphUpdate");
say("graph", graph.publishedTopics.find((one) => one.name === "/scan"));
client.unsubscribeConnectionGraph();

for (const uri of ["package://arm/meshes/base%20link.stl", "package://arm/%2e%2e/other.stl"]) {
  client.fetchAsset(uri, 7);
  const asset = await once("fetchAssetResponse");
  say("asset", asset.requestId, asset.status, asset.data?.byteLength ?? asset.error);
}
client.on("close", () => say("closed"));
const scan = channels.get("/scan").id;
const ends = [
  once("unadvertise", (gone) => gone.includes(scan)),
  once("unadvertiseServices", (gone) => gone.includes(flip.id)),
];
say("ready");
await Promise.all(ends);
say("gone");
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("foxglove")
    (folder / "package.json").write_text('{"type": "module"}')
    try:
        done = subprocess.run(
            ["npm", "install", "--no-audit", "--no-fund", *_PACKAGES],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    except (FileNotFoundError, subprocess.TimeoutExpired) as error:
        pytest.skip(f"needs npm and its registry: {error}")
    if done.returncode:
        pytest.skip(f"npm cannot install {_PACKAGES[0]}: {done.stderr[-200:]}")
    (folder / "viewer.js").write_text(SCRIPT)
    return folder / "viewer.js"


def flip(request: Any) -> Any:
    if not request.data:
        raise ValueError("never false")
    return True, "flipped"


def publish(node: Node) -> Any:
    """Publish what the viewer reads, and return what it sees the end of."""
    scan = LaserScan(Header(frame_id="laser"), ranges=array("f", [1.5, 2.5]))
    scan.header.stamp.sec = 7
    publisher = node.publisher("scan", LaserScan, latch=True)
    publisher.publish(scan)
    time = Time()
    time.data.sec = 9
    node.publisher("time", Time, latch=True).publish(time)
    node.params["/gains/p"] = 1.5
    return publisher, node.service("flip", SetBool, flip)


def test_a_viewer(script: Path, network: Network) -> None:
    node = network.node("other")
    seen = publish(node)
    clock = node.publisher("/clock", Clock)
    heard: SimpleQueue[String] = SimpleQueue()
    node.subscription("up", String, heard.put)
    node_js = shutil.which("node")
    assert node_js is not None
    with bridge_on(network, package_in(network.folder)) as bridge:
        simulate(bridge.node)
        eventually(lambda: bridge.node.params.has("/gains/p"), "the parameter")
        bridge.wait_for_subscription("/up")
        variables = network.variables()
        program = Program([node_js, str(script), str(bridge.server.port)], variables, script.parent)
        try:
            program.wait_for("go")
            clock.wait_for_subscribers(1, TIMEOUT)
            tick = Clock()
            tick.clock.sec = 42
            clock.publish(tick)
            program.wait_for("time 42000000000")
            assert heard.get(timeout=TIMEOUT).data == "cdr from npm"
            assert heard.get(timeout=TIMEOUT).data == "json from npm"
            program.wait_for("ready")
            for part in seen:
                part.close()
            program.wait_for("gone")
            bridge.server.close()
            program.wait_for("closed")
        finally:
            program.close()
        lines = {line.partition(" ")[0]: line for line in program.lines}
        assert "status" not in lines
        assert "error" not in lines
        assert '["cdr","json"] jazzy' in lines["capabilities"]
        assert '"services","connectionGraph","assets","time"]' in lines["capabilities"]
        assert '"stamp":{"sec":7,"nanosec":0}' in lines["/scan"]
        assert '"ranges":[1.5,2.5]' in lines["/scan"]
        assert '"data":{"sec":9,"nanosec":0}' in lines["/time"]
        assert lines["response"] == 'response {"success":true,"message":"flipped"}'
        assert "never false" in lines["failure"]
        assert lines["got"] == 'got [{"name":"/gains/p","value":1.5,"type":"float64"}]'
        assert lines["updated"] == 'updated [{"name":"/gains/p","value":3,"type":"float64"}]'
        assert lines["graph"] == 'graph {"name":"/scan","publisherIds":["/other"]}'
        assert "asset 7 0 5" in program.lines
        assert "leads out of package 'arm'" in lines["asset"]
