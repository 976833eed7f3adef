"""Programs that use npm's roslib in Node.js."""

from __future__ import annotations

import shutil
import subprocess
import threading
from array import array
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, Program, eventually, free_port

from rosz.actions import GoalState
from rosz.bridges.rosbridge import WebsocketBridge
from rosz.msgs.actionlib.action import Test
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from rosz.msgs.sensor_msgs.msg import LaserScan
from rosz.msgs.std_msgs.msg import Header, String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.node import Node
from rosz.transforms import StaticTransformBroadcaster

from .bridge import Doubling, bridge_on

pytestmark = [pytest.mark.system]

SCRIPT = """
import * as ROSLIB from "roslib";
const [port] = process.argv.slice(2);
const url = `ws://127.0.0.1:${port}`;
const ros = new ROSLIB.Ros({});
const shown = (one) => typeof one === "string" ? one : JSON.stringify(one);
const say = (...words) => console.log(...words.map(shown));
const once = (topic) => new Promise((done) => {
  const hear = (message) => { topic.unsubscribe(hear); done(message); };
  topic.subscribe(hear);
});
const called = (service, request) => new Promise((done) =>
  service.callService(request, done, (error) => done({ refused: String(error) })));
ros.on("error", () => {});
await ros.connect(url);

for (const compression of ["none", "png", "cbor"]) {
  const options = { name: "/scan", messageType: "sensor_msgs/LaserScan", compression };
  const scan = new ROSLIB.Topic({ ros, ...options });
  const message = await once(scan);
  say(compression, Array.from(message.ranges), message.header.stamp.secs);
}
const chatter = new ROSLIB.Topic({ ros, name: "/up", messageType: "std_msgs/String" });
chatter.publish({ data: "from roslib" });

const flip = new ROSLIB.Service({ ros, name: "/flip", serviceType: "std_srvs/SetBool" });
say("flip", await called(flip, { data: true }));
say("flip", await called(flip, { data: false }));

const rate = new ROSLIB.Param({ ros, name: "/rate" });
await new Promise((done) => rate.set({ hz: [1, 2.5] }, done));
say("rate", await new Promise((done) => rate.get(done)));
say("topics", (await new Promise((done) => ros.getTopics(done))).topics.includes("/scan"));
say("nodes", (await new Promise((done) => ros.getNodes(done))).includes("/other"));
const defs = await new Promise((done) => ros.getMessageDetails("geometry_msgs/Pose", done));
say("details", ros.decodeTypeDefs(defs));

const fib = new ROSLIB.Action({ ros, name: "/fib", actionType: "example_interfaces/Fibonacci" });
say("result", await new Promise((done) =>
  fib.sendGoal({ order: 3 }, done, (feedback) => say("feedback", feedback), done)));

const frames = { ros, fixedFrame: "map", angularThres: 0.01, transThres: 0.01, rate: 20 };
for (const Kind of [ROSLIB.TFClient, ROSLIB.ROS2TFClient]) {
  const client = new Kind(frames);
  const frame = await new Promise((done) => client.subscribe("base", done));
  say("frame", frame.translation);
  client.dispose();
}

const served = new ROSLIB.Service({ ros, name: "/served", serviceType: "std_srvs/SetBool" });
await served.advertise((request, response) => {
  response.success = !request.data;
  response.message = "from roslib";
  return true;
});
const again = new ROSLIB.Topic({ ros, name: "/again", messageType: "std_msgs/String" });
again.subscribe((message) => say("again", message.data));
say("ready");
let down = false;
ros.on("close", () => {
  if (!down) say("lost");
  down = true;
  setTimeout(() => ros.connect(url).then(() => say("back")).catch(() => {}), 50);
});
process.stdin.on("data", () => process.exit(0));
"""


ACTIONS = """
import * as ROSLIB from "roslib";
const [port] = process.argv.slice(2);
const ros = new ROSLIB.Ros({ url: `ws://127.0.0.1:${port}` });
await new Promise((done) => ros.on("connection", done));
const type = "actionlib/TestAction";
const say = (...words) => console.log(...words);

const classic = new ROSLIB.SimpleActionServer({ ros, serverName: "/simple", actionName: type });
classic.on("goal", (goal) => {
  if (goal.goal < 0) classic.sendFeedback({ feedback: 7 });
  else classic.setSucceeded({ result: 2 * goal.goal });
});
classic.on("cancel", () => classic.setPreempted());
for (const serverName of ["/native", "/classic", "/simple"]) {
  const actionClient = new ROSLIB.ActionClient({ ros, serverName, actionName: type });
  for (const number of [13, -1]) {
    const goal = new ROSLIB.Goal({ actionClient, goalMessage: { goal: number } });
    goal.once("feedback", (feedback) => {
      say(serverName, "feedback", feedback.feedback);
      goal.cancel();
    });
    const ended = new Promise((done) => goal.on("status", (status) =>
      [2, 3].includes(status.status) && done(status.status)));
    const result = new Promise((done) => goal.on("result", done));
    goal.send();
    say(serverName, (await result).result, await ended);
  }
}

const served = new ROSLIB.Action({ ros, name: "/page", actionType: "actionlib/Test" });
served.advertise((goal, id) => {
  if (goal.goal === 0) served.setFailed(id);
  if (goal.goal > 0) served.setSucceeded(id, { result: 2 * goal.goal });
  if (goal.goal < 0) served.sendFeedback(id, { feedback: 7 });
}, (id) => served.setCanceled(id, { result: 5 }));
const native = new ROSLIB.Action({ ros, name: "/native", actionType: "actionlib/Test" });
await new Promise((done) => {
  const id = native.sendGoal({ goal: -1 }, done, undefined, done);
  native.cancelGoal(id);
}).then((result) => say("canceled", String(result)));
await new Promise((done) => native.sendGoal({ goal: 6 }, done))
  .then((result) => say("native", result.result));
say("ready");
process.stdin.on("data", () => { served.unadvertise(); process.exit(0); });
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("roslib")
    (folder / "package.json").write_text('{"type": "module"}')
    try:
        done = subprocess.run(
            ["npm", "install", "--no-audit", "--no-fund", "roslib@2"],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    except (FileNotFoundError, subprocess.TimeoutExpired) as error:
        pytest.skip(f"needs npm and its registry: {error}")
    if done.returncode:
        pytest.skip(f"npm cannot install roslib: {done.stderr[-200:]}")
    (folder / "page.js").write_text(SCRIPT)
    (folder / "actions.js").write_text(ACTIONS)
    return folder / "page.js"


def partner(network: Network, heard: threading.Event) -> Node:
    """Return a node with all that the page uses; it ends a goal when its feedback was heard."""
    node = network.node("other")
    scan = LaserScan(Header(), ranges=array("f", [1.5, 2.5]))
    scan.header.stamp.sec = 7
    node.publisher("scan", LaserScan, latch=True).publish(scan)

    def flip(request: Any) -> Any:
        if not request.data:
            raise ValueError("never false")
        return True, "flipped"

    def execute(goal: Any) -> None:
        goal.feedback(Fibonacci.Feedback([0, 1]))
        heard.wait(TIMEOUT)
        goal.succeed(Fibonacci.Result([0, 1, 1]))

    header = Header(frame_id="map")
    transform = Transform(Vector3(1.0, 2.0, 3.0), Quaternion())
    StaticTransformBroadcaster(node).send(TransformStamped(header, "base", transform))
    node.service("flip", SetBool, flip)
    node.action_server("fib", Fibonacci, execute)
    return node


def test_a_page(script: Path, network: Network) -> None:
    feedback = threading.Event()
    node = partner(network, feedback)
    heard: SimpleQueue[String] = SimpleQueue()
    node.subscription("up", String, heard.put)
    port = free_port()
    bridge = network.node("bridge")
    server = WebsocketBridge(bridge, port=port)
    # It publishes to no subscription, and calls no service, that it does not know.
    bridge.context.graph.wait_for_subscribers("/up", 1, TIMEOUT)
    for service in ("/flip", "/fib/_action/send_goal"):
        bridge.context.graph.wait_for_service(service, TIMEOUT)
    node_js = shutil.which("node")
    assert node_js is not None
    program = Program([node_js, str(script), str(port)], network.variables(), script.parent)
    try:
        program.wait_for('feedback {"sequence":[0,1]}')
        feedback.set()
        program.wait_for("ready")
        assert heard.get(timeout=TIMEOUT).data == "from roslib"
        assert [line for line in program.lines if line.startswith(("none", "png", "cbor"))] == [
            f"{compression} [1.5,2.5] 7" for compression in ("none", "png", "cbor")
        ]
        assert 'flip {"success":true,"message":"flipped"}' in program.lines
        assert any("refused" in line and "never false" in line for line in program.lines)
        assert 'rate {"hz":[1,2.5]}' in program.lines
        assert "topics true" in program.lines
        assert "nodes true" in program.lines
        details = next(line for line in program.lines if line.startswith("details"))
        assert '"position":{"x"' in details
        assert 'result {"sequence":[0,1,1]}' in program.lines
        assert program.lines.count('frame {"x":1,"y":2,"z":3}') == 2
        client = node.client("served", SetBool)
        client.wait_for_service(TIMEOUT)
        response = client(data=False)
        assert (response.success, response.message) == (True, "from roslib")
        server.close()
        program.wait_for("lost")
        server = WebsocketBridge(network.node("bridge2"), port=port)
        program.wait_for("back")
        publisher = node.publisher("again", String, latch=True)
        publisher.publish("after")
        program.wait_for("again after")
        eventually(lambda: server.clients == 1, "one client")
    finally:
        program.close()
        server.close()


def test_actions_of_a_page(script: Path, network: Network) -> None:
    """Actions of ROS 1 and of ROS 2: a page has clients and servers of both."""
    node = network.node("other")
    Doubling(node)
    node_js = shutil.which("node")
    assert node_js is not None
    with bridge_on(network) as bridge:
        bridge.wait_for_service("/native/_action/send_goal")
        command = [node_js, str(script.parent / "actions.js"), str(bridge.server.port)]
        program = Program(command, network.variables(), script.parent)
        try:
            program.wait_for("ready", 4 * TIMEOUT)
            for name, last in (("/native", 5), ("/classic", 5), ("/simple", 0)):
                assert f"{name} 26 3" in program.lines
                assert f"{name} {last} 2" in program.lines
                assert f"{name} feedback 7" in program.lines
            assert "native 12" in program.lines
            canceled = next(line for line in program.lines if line.startswith("canceled"))
            assert '"result":5' in canceled.replace("\\", "")
            client = node.action_client("page", Test)
            client.wait_for_server(TIMEOUT)
            goal = client.send(Test.Goal(4), timeout=TIMEOUT)
            assert goal.result(TIMEOUT).result == 8
            assert client.send(Test.Goal(0), timeout=TIMEOUT).wait(TIMEOUT) is GoalState.ABORTED
            endless = client.send(Test.Goal(-1), timeout=TIMEOUT)
            assert next(iter(endless)).feedback == 7
            assert endless.cancel(TIMEOUT)
            assert endless.wait(TIMEOUT) is GoalState.CANCELED
        finally:
            program.close()
