"""Recording: what is published is in the bag, whatever happens to the recorder."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import random
import signal
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from network import TIMEOUT, Network, Program, eventually, repeats
from oracle import PYTHON, require
from rosbags.highlevel import AnyReader

from bags.messages import MESSAGES
from rosz.bags import Channel, open_reader
from rosz.bags.bag import Payload
from rosz.bags.edit.repair import recover
from rosz.bags.formats.chunk_writer import ChunkWriter
from rosz.bags.record import BagFiles, ParameterRecord, Recorder, RecordOptions, Ring, Selection
from rosz.cli.main import run
from rosz.errors import BagError
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import Trigger, TriggerRequest
from rosz.node import Publisher
from rosz.qos import LATCHED, QoS
from rosz.session import Session
from rosz.typestore import TypeStore

SECOND = 1_000_000_000
CUSTOM = """
import rosz
with rosz.Node("custom") as node:
    cls = node.context.types.message("strange_msgs/Strange")
    inner = node.context.types.message("strange_msgs/Inner")
    publisher = node.publisher("/strange", cls, latch=True)
    publisher.publish(cls(name="x", parts=[inner(a=1), inner(a=2)]))
    print("ready", flush=True)
    node.spin()
"""


@pytest.fixture(autouse=True)
def late_tokens(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have recorders wait for the tokens of publishers, however late these come."""
    monkeypatch.setattr("rosz.bags.record.publishers._TOKEN_TIMEOUT", TIMEOUT)


class Recording:
    """A recorder in this process."""

    def __init__(self, network: Network, options: RecordOptions, selection: Selection) -> None:
        self.node = network.node("record")
        self.said: list[str] = []
        self.files = BagFiles(options, self.said.append)
        self.parameters = ParameterRecord(self.node, self.files, self.said.append)
        self.files.begin = self.parameters.begin
        self.recorder = Recorder(
            self.node, selection, self.files, self.said.append, buffer=options.buffer
        )

    @property
    def count(self) -> int:
        """Number of messages that are no parameters."""
        tracks = list(self.files._tracks)
        return sum(one.count for one in tracks if one.channel.topic != "/parameter_events")

    def count_of(self, topic: str) -> int:
        """Number of messages of a topic."""
        return sum(one.count for one in list(self.files._tracks) if one.channel.topic == topic)

    def wait_for_count(self, count: int) -> None:
        eventually(lambda: self.count >= count)

    def close(self) -> None:
        self.recorder.close()
        self.parameters.close()
        self.files.close()


@contextmanager
def recording(
    network: Network, name: str, *topics: str, every: bool = False, **options: Any
) -> Iterator[Recording]:
    made = Recording(
        network,
        RecordOptions(name=str(network.folder / name), **options),
        Selection(topics, every=every),
    )
    try:
        yield made
    finally:
        made.close()


def connect(publisher: Publisher[Any]) -> Publisher[Any]:
    publisher.wait_for_subscribers(timeout=TIMEOUT)
    return publisher


def strange(network: Network) -> Program:
    """Start a publisher of a type that nobody else knows."""
    folder = network.folder / "src" / "strange_msgs"
    (folder / "msg").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>strange_msgs</name></package>")
    (folder / "msg" / "Inner.msg").write_text("int32 a\n")
    (folder / "msg" / "Strange.msg").write_text("string name\nInner[] parts\n")
    program = network.program(CUSTOM, ROSZ_PACKAGE_PATH=str(network.folder / "src"))
    program.wait_for("ready")
    return program


def test_many_types_are_read_by_others(network: Network) -> None:
    node = network.node("talker")
    latched = {
        topic: node.publisher(topic, type(message), latch=True)
        for topic, message in MESSAGES.items()
    }
    for topic, message in MESSAGES.items():
        latched[topic].publish(message)
    strange(network)
    wanted = len(MESSAGES) + 1
    with recording(network, "a.mcap", *MESSAGES, "/strange") as made:
        made.wait_for_count(wanted)
    path = made.files.done[0]
    with open_reader(path) as reader:
        assert not reader.problems
        channels = [one for one in reader.channels if one.topic != "/parameter_events"]
        assert sum(map(reader.count, channels)) == wanted
        assert {channel.topic for channel in channels if channel.latched} >= {*MESSAGES}
        assert {one.node for one in channels} == {"/talker", "/custom"}
        for entry in reader.messages(MESSAGES):
            assert entry.data == MESSAGES[entry.channel.topic].to_cdr()
            assert entry.channel.type_hash == MESSAGES[entry.channel.topic]._type_hash
            assert entry.sequence == 1
    check_by_mcap(path)
    check_by_rosbags(path)


def check_by_mcap(path: Path) -> None:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = {row.channel.topic: row.decoded_message for row in reader.iter_decoded_messages()}
    assert found["/string"].data == MESSAGES["/string"].data
    assert list(found["/camera_info"].d) == [0.1, 0.2]
    assert bytes(found["/image"].data) == bytes(range(6))
    assert found["/pose"].pose.position.y == 2.5
    assert [part.a for part in found["/strange"].parts] == [1, 2]
    assert found.keys() >= {*MESSAGES, "/strange"}


def check_by_rosbags(path: Path) -> None:
    with AnyReader([path]) as reader:
        rows: dict[str, Any] = {
            connection.topic: reader.deserialize(data, connection.msgtype)
            for connection, _, data in reader.messages()
        }
    assert rows.keys() >= {*MESSAGES, "/strange"}
    assert rows["/scan"].ranges.tolist() == [1.0, 2.0]
    assert rows["/strange"].name == "x"


NODE_SCRIPT = """
const { McapIndexedReader } = require("@mcap/core");
const { FileHandleReadable } = require("@mcap/nodejs");
const { open } = require("fs/promises");
(async () => {
  const file = await open(process.argv[2], "r");
  const reader = await McapIndexedReader.Initialize({ readable: new FileHandleReadable(file) });
  const rows = [];
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    const data = Buffer.from(message.data).toString("hex");
    rows.push([channel.topic, schema.name, schema.encoding, data]);
  }
  console.log(JSON.stringify(rows));
})();
"""


def test_npm_reads_the_same(network: Network) -> None:
    folder = network.folder / "npm"
    folder.mkdir()
    (folder / "package.json").write_text("{}")
    try:
        done = subprocess.run(
            ["npm", "install", "--no-audit", "--no-fund", "@mcap/core@2", "@mcap/nodejs@1"],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=50,
            check=False,
        )
    except (FileNotFoundError, subprocess.TimeoutExpired) as error:
        pytest.skip(f"needs npm and its registry: {error}")
    if done.returncode:
        pytest.skip(f"npm cannot install @mcap/core: {done.stderr[-200:]}")
    node = network.node("talker")
    topics = [*MESSAGES]
    for topic in topics:
        node.publisher(topic, type(MESSAGES[topic]), latch=True).publish(MESSAGES[topic])
    with recording(network, "a.mcap", *topics) as made:
        made.wait_for_count(len(topics))
    (folder / "read.js").write_text(NODE_SCRIPT)
    read = subprocess.run(
        ["node", "read.js", str(made.files.done[0])],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )
    assert read.returncode == 0, read.stderr
    rows = [row for row in json.loads(read.stdout) if row[0] in topics]
    assert sorted(rows) == sorted(
        [topic, MESSAGES[topic]._type_name, "ros2msg", MESSAGES[topic].to_cdr().hex()]
        for topic in topics
    )


def test_topics_that_appear_later(network: Network) -> None:
    node = network.node("talker")
    with recording(network, "a.mcap", every=True) as made:
        for number in range(5):
            connect(node.publisher(f"/t{number}", String)).publish(String(data=str(number)))
        eventually(lambda: all(made.count_of(f"/t{number}") for number in range(5)))
    with open_reader(made.files.done[0]) as reader:
        assert {f"/t{number}" for number in range(5)} <= {one.topic for one in reader.channels}


def test_a_publisher_is_one_channel_from_its_first_message_on(network: Network) -> None:
    topics = [f"/t{number}" for number in range(4)]
    node, ended = network.node("talker"), threading.Event()
    publishers = [node.publisher(topic, String) for topic in topics]

    def talk() -> None:
        while not ended.wait(0.0005):
            for publisher in publishers:
                publisher.publish(String(data="a"))

    talker = threading.Thread(target=talk)
    talker.start()
    try:
        for number in range(3):
            with recording(network, f"{number}.mcap", *topics) as made:
                made.wait_for_count(400)
                eventually(lambda: all(map(made.count_of, topics)))
            with open_reader(made.files.done[0]) as reader:
                found = [one for one in reader.channels if one.topic in topics]
            made.node.close()
            assert sorted((one.topic, one.node) for one in found) == [
                (topic, "/talker") for topic in topics
            ]
    finally:
        ended.set()
        talker.join()


def test_a_token_that_comes_after_the_first_message(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Messages come as soon as the link does, tokens that existed before may come later."""
    events: list[Callable[[], object]] = []
    watch = Session.watch_tokens

    def watch_late(
        session: Session,
        key: str,
        receive: Callable[[str, bool], None],
        complete: Callable[[], None],
        **options: Any,
    ) -> Any:
        if "/MP/" not in key or "late" not in key:
            return watch(session, key, receive, complete, **options)
        return watch(
            session,
            key,
            lambda token, alive: events.append(partial(receive, token, alive)),
            lambda: events.append(complete),
            **options,
        )

    publisher = network.node("talker").publisher("/late", String)
    monkeypatch.setattr("rosz.graph.interests.COMPLETE_BY", TIMEOUT)
    monkeypatch.setattr(Session, "watch_tokens", watch_late)
    with recording(network, "a.mcap", "/late") as made:

        def has_come() -> bool:
            publisher.publish(String(data="a"))
            return "/late" in made.recorder._publishers.topics and bool(events)

        eventually(has_come)
        for event in events:
            event()
        made.wait_for_count(1)
    with open_reader(made.files.done[0]) as reader:
        assert "/talker" in {channel.node for channel in reader.channels}


def test_each_split_begins_with_latched_messages_and_parameters(network: Network) -> None:
    node = network.node("talker")
    node.params.set("/gain", 5)
    node.publisher("/map", String, latch=True).publish(String(data="map"))
    with recording(network, "a.mcap", "/map", "/big", split=True, size=3000, max_splits=2) as made:
        big = connect(node.publisher("/big", String))
        eventually(lambda: made.files.count >= 2)  # the map and the parameters
        for number in range(4):
            big.publish(String(data=f"{number}" * 4000))
            eventually(lambda: made.count_of("/big") > number)  # noqa: B023  # called at once
        with made.files._lock:  # the last bag has its first messages
            before = made.files.count
        node.params.set("/gain", 6)
        eventually(lambda: made.files.count > before)
    names = sorted(one.name for one in network.folder.glob("a_*"))
    assert len(names) == 2, names
    changed: list[Any] = []
    for name in names:
        with rosz_bag(network.folder / name) as bag:
            assert "/map" in bag.topics
            assert [entry.message.data for entry in bag.messages("/map")] == ["map"]
            assert "gain: " in bag.metadata["parameters"]["yaml"]
            for entry in bag.messages("/parameter_events"):
                changed += [(one.name, one.value) for one in entry.message.changed_parameters]
    assert [(name, value.integer_value) for name, value in changed] == [("/gain", 6)]


def rosz_bag(path: Path) -> Any:
    import rosz.bags

    return rosz.bags.open(path)


def record(network: Network, *words: str) -> Program:
    """Start the command in the folder of the network."""
    command = [sys.executable, "-P", "-m", "rosz", "bag", "record", *words]
    program = Program(command, network.variables(), network.folder)
    network._keep(program)
    return program


def talker(network: Network, topic: str = "/chatter") -> Publisher[Any]:
    publisher = network.node("talker").publisher(topic, String, latch=True)
    publisher.publish(String(data="hello"))
    return publisher


def test_the_command(network: Network) -> None:
    publisher = talker(network)
    assert record(network, "/chatter", "-l", "1", "-O", "one").exit_code() == 0
    with rosz_bag(network.folder / "one.mcap") as bag:
        assert [entry.message.data for entry in bag.messages("/chatter")] == ["hello"]
    again = record(network, "/chatter", "-O", "one.mcap")
    assert again.exit_code() == 1
    assert "one.mcap: it exists already, and nothing is overwritten" in again.lines[-1]

    dated = record(network, "-e", "/chat.*", "-x", "/rosout", "-o", "lab", "--zstd")
    dated.wait_for("Subscribing to /chatter")
    publisher.wait_for_subscribers(timeout=TIMEOUT)
    dated.send(signal.SIGINT)
    while dated.process.poll() is None:  # what comes before the end is counted, too
        publisher.publish(String(data="hello"))
    assert dated.exit_code() == 0
    (path,) = network.folder.glob("lab_????-??-??-??-??-??.mcap")
    with open_reader(path) as reader:
        assert not reader.problems
        assert dated.lines[-1].startswith(f"{reader.count()} messages in ")


def test_the_duration_ends_a_bag_without_messages(network: Network) -> None:
    assert record(network, "/none", "--duration", "0.1", "-O", "none").exit_code() == 0
    with open_reader(network.folder / "none.mcap") as reader:
        assert (reader.count(), reader.indexed) == (0, True)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ((), "expected a TOPIC, or -a"),
        (("-a", "-o", "x", "-O", "y"), "-o and -O exclude each other"),
        (("-a", "--split"), "--split needs a limit"),
        (("-a", "--duration", "5x"), "--duration is '5x'"),
        (("-e", "("), "'(' is not a regular expression"),
        (("-a", "-j", "--lz4"), "exclude each other"),
    ],
)
def test_wrong_usage(words: tuple[str, ...], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bag", "record", *words]) == 2
    assert text in capsys.readouterr().err


def test_a_path_that_is_not_writable(network: Network) -> None:
    network.node("talker")
    program = record(network, "-a", "-O", "missing/x.mcap")
    assert program.exit_code() == 1
    assert "missing/x.mcap.active: cannot create it: No such file" in program.lines[-1]


RECORDERS = 10


@pytest.mark.parametrize("seed", range(repeats(1, 10)))
def test_recorders_that_are_killed(network: Network, seed: int) -> None:
    """What could be read before the kill can be read after it, up to the last second."""
    rng = random.Random(seed)
    publisher = network.node("talker").publisher("/chatter", String, queue_size=1000)
    recorders = [record(network, "/chatter", "-O", f"{one}.mcap") for one in range(RECORDERS)]
    for program in recorders:
        program.wait_for("Subscribing to /chatter")
    publisher.wait_for_subscribers(RECORDERS, timeout=TIMEOUT)
    moments = sorted(rng.uniform(0.1, 2.0) for _ in recorders)
    times: list[float] = []
    ends: list[float] = []
    readable: list[list[int]] = []
    begun = time.monotonic()
    while len(ends) < RECORDERS:
        publisher.publish(String(data=str(len(times))))
        times.append(time.monotonic())
        time.sleep(0.002)  # the load, not synchronisation
        if times[-1] - begun > moments[len(ends)]:
            number = len(ends)
            readable.append(numbers_in(network.folder / f"{number}.mcap.active"))
            recorders[number].process.kill()
            ends.append(time.monotonic())
    for number, (program, end) in enumerate(zip(recorders, ends, strict=True)):
        program.kill()
        path = network.folder / f"{number}.mcap.active"
        if path.stat().st_size:
            path = recover(path, network.folder / f"{number}-fixed.mcap").path
        found = numbers_in(path)
        assert found == list(range(found[0], found[0] + len(found))) if found else True
        assert found[: len(readable[number])] == readable[number]
        if repeats(0, 1):  # on a machine that is busy with other tests, it may take longer
            assert end - (times[found[-1]] if found else begun) < 1.0


def numbers_in(path: Path) -> list[int]:
    """Return what can be read of a bag of numbers, finished or not."""
    if not path.stat().st_size:
        return []
    with rosz_bag(path) as bag:
        return [int(entry.message.data) for entry in bag.messages("/chatter")]


def test_a_further_bag_that_cannot_be_created(tmp_path: Path) -> None:
    options = RecordOptions(name=str(tmp_path / "x.mcap"), split=True, size=1000)
    files = BagFiles(options, list[str]().append)
    track = files.track(Channel("/data", "std_msgs/msg/String", "cdr", "string data"), TypeStore())
    first = files.path
    taken = options.target(1, datetime.now().astimezone())
    taken.touch()
    with pytest.raises(BagError, match=f"^{taken}: it exists already"):
        files.write(track, 1, bytes(2000), None, 0)
    files.close()
    assert (files.count, files.unwritten, files.done) == (1, 0, [first])
    assert files.size == first.stat().st_size


def test_a_bag_that_cannot_be_renamed(tmp_path: Path) -> None:
    files = BagFiles(RecordOptions(name=str(tmp_path / "x.mcap")), list[str]().append)
    (tmp_path / "x.mcap.active").unlink()
    with pytest.raises(BagError, match=r"x.mcap.active: cannot rename it to '.*x.mcap': No such"):
        files.close()


def test_a_full_disk(network: Network) -> None:
    disk = network.folder / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(disk)]
    if os.geteuid() or subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("needs to mount a small disk, as root")
    try:
        # It waits for a full link, where another one would leave a message out.
        publisher = network.node("talker").publisher("/big", String, qos=QoS(history="keep_all"))
        program = record(network, "/big", "-O", "disk/x.mcap")
        program.wait_for("Subscribing to /big")
        connect(publisher)
        sent = 0
        while program.process.poll() is None and sent < 1000:
            publisher.publish(String(data=f"{sent}" + " " * 50_000))
            sent += 1
            time.sleep(0.01)  # the load, not synchronisation
        assert program.exit_code() == 1
        assert "ERROR: disk/x.mcap.active at byte" in program.lines[-1]
        assert "No space left on device; what was written before can be read" in program.lines[-1]
        (path,) = disk.iterdir()
        with open_reader(path) as reader:
            found = [int(bytes(one.data[8:20]).split()[0]) for one in reader.messages({"/big"})]
            (channel,) = (one for one in reader.channels if one.topic == "/big")
            assert reader.count(channel) == len(found)
            told = [line for line in program.lines if line.endswith(" lost")]
            taken, *_, lost, _ = told[0].replace(",", "").split()
            assert int(taken) - int(lost) == reader.count()
            assert f"'disk/x.mcap' has {reader.count()} messages." in program.lines
        assert found == list(range(len(found)))
        assert len(found) * 50_000 > 1_500_000
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_what_waits_for_the_disk_is_bounded(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of what does not fit into --buffsize, the oldest is dropped, counted and told once."""
    free, write, most = threading.Event(), ChunkWriter._write_pieces, 8 << 20

    def wait_and_write(writer: ChunkWriter, parts: list[Payload]) -> int:
        assert free.wait(TIMEOUT)
        return write(writer, parts)

    monkeypatch.setattr(ChunkWriter, "_write_pieces", wait_and_write)
    publisher = network.node("talker").publisher("/big", String, qos=QoS(history="keep_all"))
    with recording(network, "x", "/big", buffer=most) as made:
        connect(publisher)
        for number in range(40):
            publisher.publish(String(data=f"{number:06}" + " " * (1 << 20)))
        queue = made.recorder._queue

        def has_last() -> bool:
            with queue._changed:
                rows = [row for _, row in queue._ready]
            return bool(rows) and rows[-1][-1] == 40

        eventually(has_last, "the last one has come")
        assert queue.size + made.files._writer._chunk.size <= most
        free.set()
    assert sum("the buffer of 8 MB is full" in one for one in made.said) == 1
    with open_reader(network.folder / "x.mcap") as reader:
        found = [int(bytes(one.data[8:14])) for one in reader.messages({"/big"})]
    assert found[-1] == 39
    assert found == sorted(found)
    assert len(found) + made.recorder.lost == 40


def test_what_waits_for_the_processor_is_bounded(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Zenoh keeps no more of large messages than fit into a quarter of --buffsize."""
    held, free, receive = threading.Event(), threading.Event(), Recorder._receive

    def wait_and_receive(recorder: Recorder, topic: str, *given: Any) -> None:
        if topic == "/big" and given[1].sequence > 1:
            held.set()
            assert free.wait(TIMEOUT)
        receive(recorder, topic, *given)

    monkeypatch.setattr(Recorder, "_receive", wait_and_receive)
    node = network.node("talker")
    big = node.publisher("/big", String, qos=QoS(history="keep_all"))
    last = node.publisher("/last", String, qos=QoS(history="keep_all"))
    with recording(network, "x", "/big", "/last", buffer=64 << 20) as made:
        connect(big)
        connect(last)
        for number in range(40):
            big.publish(String(data=f"{number:06}" + " " * (1 << 20)))
            if number == 1:
                assert held.wait(TIMEOUT)
        last.publish(String(data="behind all others"))
        eventually(lambda: made.count_of("/last") == 1)
        free.set()
        eventually(lambda: made.count_of("/big") + made.recorder.lost == 40)
    with open_reader(network.folder / "x.mcap") as reader:
        found = [int(bytes(one.data[8:14])) for one in reader.messages({"/big"})]
    assert found == [0, 1, *range(28, 40)]  # 12 of 16 MB, as sizes and numbers are rounded


def test_snapshots_are_of_the_last_seconds(network: Network) -> None:
    talker = network.node("talker")
    talker.params.set("/rate", 5)
    publisher = talker.publisher("/chatter", String, latch=True)
    node = network.node("record")
    ring = Ring(RecordOptions(prefix=str(network.folder / "x")), 10 * SECOND, lambda _: None)
    now = 100 * SECOND
    channel = Channel("/map", "std_msgs/msg/String", definition="string data\n", qos=(LATCHED,))
    track = ring.track(channel, node.context.types)
    other = ring.track(Channel("/a", "std_msgs/msg/String"), node.context.types)
    ring.write(track, now, b"old", None, 0)
    ring.write(track, now + 1, b"map", None, 0)
    for second in range(30):
        ring.write(other, now + second * SECOND, bytes([second]), None, 0)
    path = ring.save(now + 30 * SECOND)
    with open_reader(path) as reader:
        rows = [(one.channel.topic, bytes(one.data)) for one in reader.messages()]
    assert rows == [("/map", b"map"), *(("/a", bytes([second])) for second in range(20, 30))]

    program = record(network, "-a", "--snapshot", "60", "-o", "snap", "__name:=keeper")
    program.wait_for("SIGUSR1")
    connect(publisher).publish(String(data="now"))
    program.wait_for("Subscribing to /chatter")
    client = node.client("/keeper/snapshot", Trigger)
    client.wait_for_service(TIMEOUT)

    def saved() -> bool:
        response = client.call(TriggerRequest(), timeout=TIMEOUT)
        assert response.success
        with rosz_bag(network.folder / response.message) as bag:
            if bag.reader.metadata.get("parameters", {}).get("yaml") != "rate: 5\n":
                return False  # the recorder has not found them yet
            (event,) = (one.message for one in bag.messages("/parameter_events"))
            assert [one.name for one in event.new_parameters] == ["/rate"]
            return [one.message.data for one in bag.messages("/chatter")] == ["now"]

    eventually(saved)
    before = len(list(network.folder.glob("snap_*.mcap")))
    program.send(signal.SIGUSR1)
    eventually(lambda: len(list(network.folder.glob("snap_*.mcap"))) > before)
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
    assert not list(network.folder.glob("*.active"))


def test_named_snapshots_are_numbered(network: Network) -> None:
    program = record(network, "-a", "--snapshot", "60", "-O", "snap")
    program.wait_for("SIGUSR1")
    for name in ("snap.mcap", "snap_1.mcap"):
        program.send(signal.SIGUSR1)
        eventually((network.folder / name).exists, name)
    (network.folder / "snap_2.mcap").touch()
    program.send(signal.SIGUSR1)
    program.wait_for("snap_2.mcap: it exists already")
    (network.folder / "snap_2.mcap").unlink()
    program.send(signal.SIGUSR1)
    eventually((network.folder / "snap_2.mcap").exists, "snap_2.mcap")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0


@pytest.mark.parametrize(
    ("words", "parameters"),
    [(("/chatter",), False), (("/chatter", "--parameters"), True), (("-a",), True)],
)
def test_parameters_are_recorded_when_asked_for(
    network: Network, words: tuple[str, ...], parameters: bool
) -> None:
    node = network.node("talker")
    node.params.set("/rate", 5)
    node.publisher("/chatter", String, latch=True).publish(String(data="hello"))
    program = record(network, *words, "-O", "x.mcap")
    active = network.folder / "x.mcap.active"
    wanted = {"/chatter", "/parameter_events"} if parameters else {"/chatter"}
    eventually(lambda: wanted <= topics_in(active))
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
    assert topics_in(network.folder / "x.mcap") - {"/rosout"} == wanted
    with open_reader(network.folder / "x.mcap") as reader:
        assert ("parameters" in reader.metadata) == parameters


def topics_in(path: Path) -> set[str]:
    """Return the topics of the messages in a bag, which may be empty yet."""
    if not path.exists() or not path.stat().st_size:
        return set()
    with open_reader(path) as reader:
        return {one.channel.topic for one in reader.messages()}


def test_a_terminal_that_is_closed_finishes_the_bag(network: Network) -> None:
    publisher = network.node("talker").publisher("/chatter", String, latch=True)
    publisher.publish(String(data="hello"))
    words = [sys.executable, "-m", "rosz", "bag", "record", "-O", "x.mcap", "/chatter"]
    leader, terminal = pty.openpty()

    def control() -> None:
        os.setsid()
        fcntl.ioctl(terminal, termios.TIOCSCTTY, 0)

    with subprocess.Popen(
        words,
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
        cwd=network.folder,
        env=network.variables(TERM="xterm"),
        preexec_fn=control,  # noqa: PLW1509  # no threads take part in it
    ) as process:
        os.close(terminal)
        active = network.folder / "x.mcap.active"
        eventually(lambda: topics_in(active) == {"/chatter"})
        os.close(leader)  # the system sends SIGHUP
        assert process.wait(TIMEOUT) == 0
    assert topics_in(network.folder / "x.mcap") == {"/chatter"}


def test_what_was_published_before_is_recorded_only_if_it_was_latched(network: Network) -> None:
    node = network.node("talker")
    latched = node.publisher("/map", String, qos=LATCHED)
    held = node.publisher("/held", String, qos=msgspec.structs.replace(LATCHED, depth=10))
    for number in range(5):
        node.log.info("before %d", number)
        latched.publish(String(data=f"{number}"))
        held.publish(String(data=f"{number}"))
    node.log.flush()
    with recording(network, "a.mcap", every=True) as made:
        eventually(lambda: made.count_of("/map") and made.count_of("/held"))
        node.context.graph.wait_for_subscribers("/rosout", 1, TIMEOUT)
        node.log.info("meanwhile")
        eventually(lambda: made.count_of("/rosout"))
        late = network.node("late")
        late.log.info("of a new node")
        eventually(lambda: made.count_of("/rosout") >= 2)
    assert made.recorder.lost == 0
    with rosz_bag(made.files.done[0]) as bag:
        lines = [one.message.msg for one in bag.messages("/rosout")]
        assert [line for line in lines if "before" in line] == []
        assert {"meanwhile", "of a new node"} <= set(lines)
        for topic in ("/map", "/held"):
            assert [one.message.data for one in bag.messages(topic)] == ["4"], topic


def test_topics_that_were_not_followed_in_time_count_as_lost(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("_SETTLE_SECONDS", "_LOOK_SECONDS"):
        monkeypatch.setattr(f"rosz.bags.record.recorder.{name}", TIMEOUT)
    node = network.node("talker")
    for number in range(3):
        node.publisher(f"/t{number}", String)
    with recording(network, "a.mcap", every=True) as made:
        made.node.context.graph.wait_for_topic("/t2", TIMEOUT)
    assert made.recorder.lost >= 3
    assert any("messages could come of" in line and "/t1, /t2" in line for line in made.said)


@pytest.mark.ros1
def test_a_bag_of_ros_1(network: Network) -> None:
    require("rosbag", package="python3-rosbag")
    node = network.node("talker")
    for topic, message in MESSAGES.items():
        node.publisher(topic, type(message), latch=True).publish(message)
    with recording(network, "a.bag", *MESSAGES, compression="lz4") as made:
        made.wait_for_count(len(MESSAGES))
    script = (
        "import rosbag, sys\n"
        "rows = list(rosbag.Bag(sys.argv[1]).read_messages())\n"
        "print(sorted(row[0] for row in rows if row[0] != '/parameter_events'))"
    )
    done = subprocess.run(
        [PYTHON, "-c", script, str(made.files.done[0])],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.stdout, done.stderr) == (f"{sorted(MESSAGES)}\n", "")


INTERRUPTED = """
import os, runpy, signal, sys
from rosz.bags.record import recording
enter = recording.BagFiles.__enter__
def interrupted(self):
    os.kill(os.getpid(), signal.SIGINT)
    return enter(self)
recording.BagFiles.__enter__ = interrupted
sys.argv[0] = "rosz"
runpy.run_module("rosz", run_name="__main__")
"""


def test_a_signal_right_after_the_bag_was_opened_finishes_it(network: Network) -> None:
    script = network.folder / "interrupted.py"
    script.write_text(INTERRUPTED)
    command = [sys.executable, str(script), "bag", "record", "-a", "-O", "x"]
    program = network._keep(Program(command, network.variables(), network.folder))
    assert program.exit_code() == 0, program.output
    assert [one.name for one in network.folder.glob("x*")] == ["x.mcap"]
    with open_reader(network.folder / "x.mcap") as reader:
        assert not reader.problems


def test_the_node_of_launch_files(network: Network) -> None:
    talker(network)
    command = [sys.executable, "-P", "-m", "rosz", "run", "rosbag", "record"]
    words = ["-O", "x.mcap", "-l", "1", "in", "in:=/chatter", "__name:=rec"]
    program = Program([*command, *words], network.variables(), network.folder)
    network._keep(program)
    assert program.exit_code() == 0, program.output
    with open_reader(network.folder / "x.mcap") as reader:
        assert {channel.topic for channel in reader.channels} >= {"/chatter"}
