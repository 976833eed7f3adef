"""Trees of frames, compared with real tf2, and over a network."""

from __future__ import annotations

import random
import threading
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually
from oracle import same

from rosz.errors import (
    ExtrapolationNeeded,
    FrameNotFound,
    FramesNotConnected,
    TransformArgument,
    TransformError,
    UsageError,
)
from rosz.graph import View
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs import msg as geometry
from rosz.msgs.geometry_msgs.msg import (
    Point,
    PointStamped,
    PoseStamped,
    Quaternion,
    TransformStamped,
    Vector3,
    Vector3Stamped,
    Wrench,
    WrenchStamped,
)
from rosz.msgs.rosgraph_msgs.msg import Clock as ClockMessage
from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.node import Clock
from rosz.qos import CLOCK
from rosz.ros1.client.point_cloud2 import create_cloud_xyz32, read_points
from rosz.transforms import (
    IDENTITY,
    Buffer,
    Monitor,
    Pose,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformListener,
    compose,
    invert,
    transform_message,
)

S = 10**9
_REAL = "tf2_ros", "python3-tf2-ros"

_SETUP = """
import tf2_ros
from genpy import Duration, Time
from geometry_msgs.msg import TransformStamped
buffer = tf2_ros.Buffer(Duration(10), debug=False)
def tell(parent, child, seconds, numbers, static=False):
    made = TransformStamped()
    made.header.frame_id, made.child_frame_id = parent, child
    made.header.stamp = Time.from_sec(seconds)
    t, r = made.transform.translation, made.transform.rotation
    t.x, t.y, t.z, r.x, r.y, r.z, r.w = numbers
    (buffer.set_transform_static if static else buffer.set_transform)(made, "me")
def known(target, source, seconds):
    return bool(buffer.can_transform_core(target, source, Time.from_sec(seconds))[0])
def ask(target, source, seconds):
    try:
        found = buffer.lookup_transform_core(target, source, Time.from_sec(seconds))
    except Exception as error:
        name = type(error).__name__
        return [{"FrameNotFound": "LookupException",
                 "FramesNotConnected": "ConnectivityException",
                 "ExtrapolationNeeded": "ExtrapolationException",
                 "TransformArgument": "InvalidArgumentException"}.get(name, name), str(error)]
    t, r = found.transform.translation, found.transform.rotation
    return [found.header.stamp.to_sec(), found.header.frame_id, found.child_frame_id] + [
        round(x, 6) + 0.0 for x in (t.x, t.y, t.z, r.x, r.y, r.z, r.w)]
"""


def numbers(chance: random.Random) -> list[float]:
    rotation = [chance.gauss(0, 1) for _ in range(4)]
    length = sum(part * part for part in rotation) ** 0.5
    return [chance.uniform(-5, 5) for _ in range(3)] + [part / length for part in rotation]


def random_tree(seed: int) -> list[str]:
    """Return lines that fill a new buffer, and add what it is asked to the result."""
    chance = random.Random(seed)
    lines = ["buffer = tf2_ros.Buffer(Duration(10), debug=False)"]
    frames = ["f0", "other"]
    for number in range(1, 8):
        parent = chance.choice(frames[:1] + frames[2:]) if number < 7 else "other"
        child = f"f{number}"
        frames.append(child)
        if chance.random() < 0.3:
            lines.append(f"tell({parent!r}, {child!r}, 0, {numbers(chance)}, static=True)")
            continue
        times = sorted(round(chance.uniform(1, 6), 2) for _ in range(chance.randint(1, 4)))
        chance.shuffle(times)
        lines += [f"tell({parent!r}, {child!r}, {time}, {numbers(chance)})" for time in times]
    questions = [
        (chance.choice(frames), chance.choice(frames), chance.choice([0, 0, 2.5, 3.5, 9.0]))
        for _ in range(60)
    ]
    return [*lines, f"result += [[ask(*one), known(*one)] for one in {questions}]"]


@pytest.mark.ros1
def test_random_trees() -> None:
    lines = [line for seed in range(6) for line in random_tree(seed)]
    same(_SETUP + "\n".join(["result = []", *lines]) + "\n", *_REAL)


@pytest.mark.ros1
def test_texts_are_those_of_tf2() -> None:
    same(
        _SETUP
        + """
q = [0, 0, 0, 1]
tell("map", "odom", 1, [1, 0, 0] + q); tell("map", "odom", 2, [2, 0, 0] + q)
tell("odom", "base", 1.5, [3, 0, 0] + q); tell("x", "y", 1, [0, 0, 0] + q)
tell("/m", "/n", 1, [0, 0, 0] + q); tell("base", "tool", 0, [1, 2, 3] + q, static=True)
result = [ask(target, source, seconds) for target, source, seconds in [
    ("map", "base", 0), ("map", "base", 1.5), ("map", "base", 3), ("map", "base", 0.5),
    ("map", "y", 0), ("map", "nope", 0), ("nope", "map", 0), ("map", "odom", 5),
    ("map", "odom", 0.5),
    ("odom", "map", 1.25), ("base", "map", 1.5), ("base", "base", 0), ("map", "map", 0),
    ("m", "n", 0), ("/m", "n", 0), ("map", "tool", 0), ("base", "tool", 7), ("base", "tool", 0),
    ("tool", "y", 0), ("", "map", 0),
]] + [
    buffer.all_frames_as_yaml(), buffer.all_frames_as_string(),
    list(buffer.can_transform("map", "nope", Time(0), return_debug_tuple=True)),
    list(buffer.can_transform("nope", "map", Time(0), return_debug_tuple=True)),
    bool(buffer.can_transform("map", "base", Time(0))),
    buffer.get_latest_common_time("map", "base").to_sec(),
    ask("map", "base", 1.5) == ask("map", "base", 0),
]
""".replace("all_frames_as_yaml()", "all_frames_as_yaml().strip()"),
        *_REAL,
    )


@pytest.mark.ros1
def test_fixed_frames() -> None:
    same(
        _SETUP
        + """
for seconds in (1, 2, 3):
    tell("map", "a", seconds, [seconds, 0, 0, 0, 0, 0, 1])
    tell("map", "b", seconds, [0, seconds, 0, 0, 0, 0.6, 0.8])
found = buffer.lookup_transform_full("a", Time(3), "b", Time.from_sec(1.5), "map")
result = [found.header.stamp.to_sec(), found.header.frame_id, found.child_frame_id,
          [round(getattr(found.transform.translation, axis), 6) for axis in "xyz"]]
""",
        *_REAL,
    )


def test_old_transforms_are_dropped() -> None:
    buffer = Buffer(length_ns=2 * S)
    assert buffer.set("map", "base", 10 * S, IDENTITY)
    assert not buffer.set("map", "base", 10 * S, IDENTITY)
    assert not buffer.set("map", "base", 7 * S, IDENTITY)
    assert buffer.set("map", "base", 9 * S, IDENTITY)
    assert buffer.set("map", "base", 12 * S, IDENTITY)
    with pytest.raises(ExtrapolationNeeded):
        buffer.lookup("map", "base", 9 * S)
    buffer.set("base", "arm", 0, IDENTITY, static=True)
    buffer.clear()
    assert buffer.frames() == ["arm", "base"]


def test_a_frame_can_change_its_parent() -> None:
    buffer = Buffer()
    buffer.set("shelf", "cup", 1 * S, Pose((1.0, 0.0, 0.0), IDENTITY.rotation))
    buffer.set("hand", "cup", 2 * S, Pose((2.0, 0.0, 0.0), IDENTITY.rotation))
    assert buffer.lookup("shelf", "cup", S)[0].translation[0] == 1.0
    assert buffer.lookup("hand", "cup", 2 * S)[0].translation[0] == 2.0
    assert buffer.lookup("shelf", "cup", 3 * S // 2)[0].translation[0] == 1.0
    with pytest.raises(FramesNotConnected):
        buffer.lookup("shelf", "cup")


def test_loops_are_reported() -> None:
    buffer = Buffer()
    for parent, child in (("a", "b"), ("b", "c"), ("c", "a"), ("d", "e")):
        buffer.set(parent, child, S, IDENTITY)
    with pytest.raises(TransformError, match="loop"):
        buffer.lookup("e", "a", S)
    with pytest.raises(TransformError, match="loop"):
        buffer.lookup("e", "a")


@pytest.mark.parametrize(
    ("parent", "child", "pose", "text"),
    [
        ("", "b", IDENTITY, "no frame_id"),
        ("a", "", IDENTITY, "without a child_frame_id"),
        ("a", "/a", IDENTITY, "to itself"),
        (
            "a",
            "b",
            Pose((float("nan"), 0.0, 0.0), IDENTITY.rotation),
            "a number that is not finite",
        ),
        ("a", "b", Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)), "of length 0; expected 1"),
    ],
)
def test_invalid_transforms(parent: str, child: str, pose: Pose, text: str) -> None:
    with pytest.raises(TransformArgument, match=text):
        Buffer().set(parent, child, 0, pose)


def test_inverse() -> None:
    chance = random.Random(3)
    for _ in range(50):
        x, y, z, *rotation = numbers(chance)
        a, b, c, d = rotation
        pose = Pose((x, y, z), (a, b, c, d))
        back = compose(invert(pose), pose)
        assert back.translation == pytest.approx((0, 0, 0), abs=1e-9)
        assert back.rotation == pytest.approx((0, 0, 0, 1), abs=1e-9)


def transform(parent: str, child: str, x: float, seconds: int = 1) -> TransformStamped:
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id = parent
    made.header.stamp.sec = seconds
    made.transform.translation.x = x
    made.transform.rotation.w = 1.0
    return made


def test_over_the_network(network: Network) -> None:
    robot, viewer = network.node("robot"), network.node("viewer")
    static = StaticTransformBroadcaster(robot)
    static.send(transform("base", "laser", 0.5))
    static.send([transform("base", "arm", 0.25)])
    buffer = Buffer()
    with pytest.raises(FrameNotFound):
        buffer.lookup("map", "laser")
    listener = TransformListener(buffer, viewer)
    moving = TransformBroadcaster(robot)
    moving._publisher.wait_for_subscribers()
    moving.send(transform("map", "base", 2.0))
    assert listener.can_transform("map", "laser", timeout=TIMEOUT)
    assert buffer.wait(lambda: buffer.has("arm"), int(TIMEOUT) * S, viewer.clock)
    pose, stamp = listener.lookup("map", "laser")
    assert (pose.translation[0], stamp) == (2.5, S)
    assert not listener.can_transform("map", "nothing")
    assert not listener.can_transform("map", "nothing", timeout=0.01)
    with pytest.raises(FrameNotFound):
        listener.lookup("map", "nothing", timeout=0.01)
    assert not buffer.wait(lambda: False, S // 100, viewer.clock)
    listener.close()


def test_messages_in_other_frames(network: Network) -> None:
    node = network.node("viewer")
    listener = TransformListener(Buffer(), node)
    turned = Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.5**0.5, 0.5**0.5))  # a quarter turn to the left
    listener.buffer.set("map", "base", 0, turned, static=True)
    header = Header(stamp=Time.from_nsec(S), frame_id="base")
    moved = listener.transform(PointStamped(header, Point(1.0, 0.0, 0.5)), "map", timeout=1.0)
    assert moved.header == Header(stamp=Time.from_nsec(S), frame_id="map")
    assert _numbers(moved.point) == [1.0, 3.0, 3.5]
    at = geometry.Pose(Point(0.0, 1.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
    moved = listener.transform(PoseStamped(header, at), "map")
    assert _numbers(moved.pose.position) == [0.0, 2.0, 3.0]
    assert _numbers(moved.pose.orientation) == [0.0, 0.0, 0.707107, 0.707107]
    vector = Vector3(1.0, 0.0, 2.0)
    moved = listener.transform(Vector3Stamped(header, vector), "map")
    assert _numbers(moved.vector) == [0.0, 1.0, 2.0]
    moved = listener.transform(WrenchStamped(header, Wrench(vector, Vector3(0.0, 1.0, 0.0))), "map")
    assert _numbers(moved.wrench.force) == [0.0, 1.0, 2.0]
    assert _numbers(moved.wrench.torque) == [-1.0, 0.0, 0.0]
    cloud = create_cloud_xyz32(header, [(1.0, 0.0, 0.5)])
    assert list(read_points(listener.transform(cloud, "map"))) == [(1.0, 3.0, 3.5)]
    with pytest.raises(UsageError, match="cannot transform a Header; expected one of PointCloud2"):
        transform_message(header, turned, header)
    with pytest.raises(TransformError):
        listener.transform(cloud, "nowhere", timeout=0.01)


def _numbers(message: Any) -> list[float]:
    return [round(getattr(message, name), 6) + 0.0 for name in message.__struct_fields__]


def test_static_transforms_are_copied(network: Network) -> None:
    static = StaticTransformBroadcaster(network.node("robot"))
    reused = transform("base", "laser", 1.0)
    static.send(reused)
    reused.child_frame_id, reused.transform.translation.x = "camera", 2.0
    static.send(reused)
    buffer = Buffer()
    TransformListener(buffer, network.node("viewer"))
    eventually(lambda: buffer.frames() == ["base", "camera", "laser"], "both for who comes late")
    assert buffer.lookup("base", "laser")[0].translation[0] == 1.0


def test_a_transform_may_arrive_before_the_token_of_its_publisher(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monitor = Monitor(network.node("viewer"))
    with monkeypatch.context() as patch:
        patch.setattr(View, "publishers", lambda *_: [])
        StaticTransformBroadcaster(network.node("robot")).send(transform("base", "laser", 1.0))
        eventually(lambda: [one.node for one in monitor.frames()] == [""], "the transform")
        assert [one.node for one in monitor.broadcasters()] == ["(static)"]
    network.node("later").publisher("/tf", TFMessage)
    eventually(lambda: [one.node for one in monitor.frames()] == ["/robot"], "the name of the node")
    assert [one.node for one in monitor.broadcasters()] == ["/robot(static)"]


def test_a_time_jump_back_clears_the_buffer(network: Network) -> None:
    robot = network.node("robot")
    robot.params.set("/use_sim_time", True)
    clock = robot.publisher("/clock", ClockMessage, qos=CLOCK)
    viewer = network.node("viewer")
    buffer = Buffer()
    TransformListener(buffer, viewer)
    clock.wait_for_subscribers()

    def set_clock(seconds: int) -> None:
        message = ClockMessage()
        message.clock.sec = seconds
        clock.publish(message)
        eventually(lambda: viewer.now() == seconds * S, "the time")

    set_clock(10)
    buffer.set("map", "base", S, IDENTITY)
    set_clock(11)
    assert buffer.has("base")
    set_clock(5)
    eventually(lambda: not buffer.has("base"), "the empty buffer")


class Waiting:
    """A wait for a transform on a thread of its own, which counts how often it looks."""

    def __init__(self, buffer: Buffer, clock: Clock, timeout_ns: int) -> None:
        self.looks = 0
        self.result: SimpleQueue[bool] = SimpleQueue()
        self.began = threading.Event()
        self._buffer = buffer
        work = lambda: self.result.put(buffer.wait(self._known, timeout_ns, clock))  # noqa: E731
        threading.Thread(target=work, daemon=True).start()
        assert self.began.wait(TIMEOUT)

    def _known(self) -> bool:
        self.looks += 1
        self.began.set()
        return not self._buffer.why_not("a", "b")


def test_a_wait_ends_when_the_transform_comes() -> None:
    buffer = Buffer()
    waiting = Waiting(buffer, Clock(), 3600 * 10**9)
    buffer.set("a", "other", 1, IDENTITY)
    buffer.set("a", "b", 1, IDENTITY)
    assert waiting.result.get(timeout=TIMEOUT)
    assert waiting.looks <= 4  # at its begin, for each transform, at its end


def test_a_wait_ends_by_simulated_time() -> None:
    clock = Clock()
    clock.enable_simulation()
    clock.advance(5)
    waiting = Waiting(Buffer(), clock, 10)
    eventually(lambda: clock._source.sleepers, "the sleep")
    clock.advance(14)
    clock.advance(15)
    assert not waiting.result.get(timeout=TIMEOUT)
    assert waiting.looks == 2


def test_a_wait_ends_when_time_goes_back_or_the_clock_closes() -> None:
    clock = Clock()
    clock.enable_simulation()
    clock.advance(5)
    back = Waiting(Buffer(), clock, 10)
    eventually(lambda: clock._source.sleepers, "the sleep")
    clock.advance(4)
    assert not back.result.get(timeout=TIMEOUT)
    closed = Waiting(Buffer(), clock, 10)
    clock.close()
    assert not closed.result.get(timeout=TIMEOUT)
