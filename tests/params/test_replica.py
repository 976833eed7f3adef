from __future__ import annotations

import logging
import re
import threading
import time
from functools import partial
from queue import SimpleQueue

import pytest
from network import TIMEOUT, eventually

from rosz.errors import ClosedError, InvalidName, ParamError, ParamNotFound, PartlyWritten
from rosz.params.replica import Outcome, Replica
from rosz.params.replica.core.effects import Publish
from rosz.params.wire import (
    Batch,
    ClientRequest,
    Keys,
    Record,
    ReplicaMember,
    SyncRequest,
    add_header,
    encode,
)
from rosz.session import HybridClock, Stamp

from .network import Network, merge


class SkewedClock(HybridClock):
    """A clock that is wrong by so many seconds, until it sees a later stamp."""

    def __init__(self, clock_id: str, seconds: float) -> None:
        super().__init__(clock_id)
        self._off = int(seconds * 1e9)
        self._shown = 0
        self._gate = threading.Lock()

    def now(self) -> Stamp:
        with self._gate:
            stamp = super().now()
            self._shown = max(self._shown + 1, stamp.time + self._off)
            return Stamp(self._shown, stamp.id)

    def observe(self, stamp: Stamp) -> None:
        with self._gate:
            self._shown = max(self._shown, stamp.time)


def test_a_set_that_returned_is_seen_by_all(network: Network) -> None:
    replicas = network.replicas(4)
    for number in range(50):
        writer = replicas[number % 4]
        assert writer.set("/count", number).slow == ()
        assert [replica.get("/count") for replica in replicas] == [number] * 4


def test_a_newcomer_has_everything(network: Network) -> None:
    first = network.replica()
    first.set("/a/b", [1, {"c": "d"}])
    first.set("/gone", 1)
    first.delete("/gone")
    later = network.replica()
    assert later.root == {"a": {"b": [1, {"c": "d"}]}}
    assert later.digest() == first.digest()
    assert later.origin("/a/b") == first.label


@pytest.fixture
def patient_joining(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a replica that joins wait for ever for what does not come."""
    monkeypatch.setattr("rosz.params.replica.replica._MESH_TIMEOUT", 1e4)
    monkeypatch.setattr("rosz.params.replica.replica._TOKENS_TIMEOUT", 1e4)
    monkeypatch.setattr("rosz.params.replica.core.joining._TIMEOUT", 1e4)
    monkeypatch.setattr("rosz.params.replica.core.comparisons._TIMEOUT", 1e4)


@pytest.mark.usefixtures("patient_joining")
def test_a_newcomer_with_nobody_there_starts_empty_at_once(network: Network) -> None:
    joined: SimpleQueue[Replica] = SimpleQueue()
    network.thread(lambda: joined.put(network.replica()))
    assert joined.get(timeout=TIMEOUT).root == {}


def test_domains_do_not_see_each_other(network: Network) -> None:
    here, there = network.replica(1), network.replica(2)
    assert here.set("/a", 1).slow == ()
    assert not there.has("/a")
    assert there.members() == []


def test_a_stamp_years_ahead_stops_no_later_write(
    network: Network, caplog: pytest.LogCaptureFixture
) -> None:
    one, other = network.replicas(2)
    stranger = network.session()
    batch = Batch.of(((1 << 62) - 1, "f0"), "forger", [(("a",), "forged")])
    records = [Record("a", (1 << 62) - 1, "f0", "forger", ["forged"])]
    records.append(Record("b", 5, "f0", "forger", ["fair"]))
    keys = Keys(0)
    with caplog.at_level(logging.WARNING, "rosz.params"):
        stranger.put(keys.change, add_header(stranger.zid, 1, encode(batch)))
        asked = {
            keys.of(one.zid, "write"): add_header(stranger.zid, 2, encode(batch)),
            keys.of(one.zid, "tell"): encode(SyncRequest(records=records)),
            keys.of(one.zid, "set"): encode(ClientRequest("write", batch=batch)),
        }
        for key, payload in asked.items():
            (reply,) = stranger.get(key, payload=payload, timeout=TIMEOUT)
        assert b"years ahead" in reply.payload
        assert one.set("/a", 1).slow == other.set("/c", 2).slow == ()
        assert one.compare(TIMEOUT)
    assert one.root == other.root == {"a": 1, "b": "fair", "c": 2}
    assert caplog.text.count("years ahead") <= 2  # one line each


def test_what_is_not_taken_rests_until_who_refused_comes_anew(
    network: Network, caplog: pytest.LogCaptureFixture
) -> None:
    sessions = [network.session() for _ in range(2)]
    for session in sessions:
        session.secured = True
    one = network.join(sessions[0])
    # One that knows the other when it joins does not compare with it again when it appears.
    eventually(lambda: sessions[1].live_tokens(Keys(0).tokens, TIMEOUT) != [])
    other = network.join(sessions[1])
    eventually(lambda: len(one.members()) == 1)
    one._runner.handlers[Publish] = bool
    other._exchange._declared[
        4
    ].close()  # where it is told: rules leave such questions without an answer
    merge(one, "/", {"a": {"b": 1, "c": 2}, "d": 3}, timeout=0)
    with caplog.at_level(logging.WARNING, "rosz.params"):
        assert one.compare(TIMEOUT)
        assert one.compare(TIMEOUT)
        key = f"{Keys(0).of(other.zid, 'tell')}/**"
        take = partial(other._exchange._on_query, "tell")
        network.keep(sessions[1].queryable(key, take, complete=True))
        assert one.compare(TIMEOUT)
    assert other.root == {}
    assert caplog.text.count("and 2 more, which differs there from now on") == 1
    with one._runner:
        one._runner.core._comparisons.forget(other.zid)
    eventually(lambda: one.compare(TIMEOUT) and other.root == one.root)
    assert one.digest() == other.digest()


def test_the_store_lives_while_any_replica_does(network: Network) -> None:
    first, second = network.replicas(2)
    first.set("/a", 1)
    first.close()
    eventually(lambda: second.members() == [])
    third = network.replica()
    assert third.get("/a") == 1


def test_reading(network: Network) -> None:
    replica = network.replica(label="me")
    replica.set("/ns", {"b": {"c": 1}, "a": [2], "e": {}})
    assert replica.get("/ns/b") == {"c": 1}
    assert replica.names() == ["/ns/a", "/ns/b/c"]
    assert replica.has("/ns/e")
    assert not replica.has("/ns/b/c/d")
    assert replica.search("b", "/ns/x/y") == "/ns/b"
    assert replica.search("q", "/ns/x/y") is None
    assert replica.origin("/ns/b/c") == "me"
    assert replica.origin("/nowhere") == ""
    assert replica.root == {"ns": {"b": {"c": 1}, "a": [2], "e": {}}}


def test_what_is_read_is_the_readers_own(network: Network) -> None:
    replica = network.replica()
    value = {"list": [1]}
    replica.set("/a", value)
    value["list"].append(2)
    replica.get("/a")["list"].append(3)
    assert replica.get("/a") == {"list": [1]}


def test_a_missing_name_is_a_key_error_with_its_near_miss(network: Network) -> None:
    replica = network.replica()
    replica.set("/robot/max_speed", 1)
    with pytest.raises(KeyError, match="'/robot/max_sped' is not set; did you mean"):
        replica.get("/robot/max_sped")
    with pytest.raises(ParamNotFound, match=r"'/robot/max_speed/x' is not set$"):
        replica.delete("/robot/max_speed/x")


def test_what_is_refused_is_written_nowhere(network: Network) -> None:
    one, other = network.replicas(2)
    with pytest.raises(ParamError, match="null is not a parameter value"):
        one.set("/a", None)
    with pytest.raises(ParamError, match="the root of all parameters is a dict"):
        one.set("/", 5)
    with pytest.raises(ParamError, match="'/' cannot be deleted"):
        one.delete("/")
    with pytest.raises(InvalidName, match="it is not global"):
        one.set("a", 1)
    assert one.root == other.root == {}


def test_a_dict_replaces_and_a_merge_does_not(network: Network) -> None:
    one, other = network.replicas(2)
    one.set("/a", {"x": 1, "y": 2})
    one.set("/a", {"y": 3})
    assert other.get("/a") == {"y": 3}
    merge(one, "/a", {"x": {"z": 4}})
    assert other.get("/a") == {"x": {"z": 4}, "y": 3}
    assert merge(one, "/a", {}).time == 0
    one.set("/", {"b": 1})
    assert other.root == {"b": 1}


def test_all_writers_agree_in_the_end(network: Network) -> None:
    replicas = network.replicas(4)

    def write(replica: Replica, seed: int) -> None:
        for number in range(60):
            name = f"/n{(seed * 7 + number) % 5}"
            if number % 11 == 10 and replica.has(name):
                try:
                    replica.delete(name)
                except ParamNotFound:
                    continue
            elif number % 3:
                replica.set(f"{name}/x{number % 4}", [seed, number])
            else:
                replica.set(name, {"whole": seed})

    threads = [
        threading.Thread(target=write, args=(replica, seed))
        for seed, replica in enumerate(replicas)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {replica.digest() for replica in replicas} == {replicas[0].digest()}
    assert all(replica.root == replicas[0].root for replica in replicas)


def test_a_batch_is_one_change_for_every_reader(network: Network) -> None:
    writer, reader = network.replicas(2)
    merge(writer, "/", {f"k{number}": 0 for number in range(300)})
    stop = threading.Event()
    mixed: list[set[int]] = []

    def watch() -> None:
        while not stop.is_set():
            seen = set(reader.root.values())
            if len(seen) != 1:
                mixed.append(seen)

    thread = threading.Thread(target=watch)
    thread.start()
    for value in range(1, 30):
        merge(writer, "/", {f"k{number}": value for number in range(300)})
    stop.set()
    thread.join()
    assert mixed == []


def test_large_values_arrive_whole(network: Network) -> None:
    one, other = network.replicas(2)
    text = "x" * 10_000_000
    assert one.set("/text", text, timeout=TIMEOUT).slow == ()
    assert other.get("/text") == text
    many = {f"ns{number % 100}/p{number}": number for number in range(20_000)}
    assert merge(one, "/many", many, timeout=TIMEOUT).slow == ()
    assert len(other.names()) == 20_001
    assert other.digest() == one.digest()


def test_readers_do_not_wait_for_large_loads(network: Network) -> None:
    one, other = network.replicas(2)
    one.set("/rate", 5)
    many = {f"p{number}": number for number in range(20_000)}
    thread = threading.Thread(target=lambda: merge(one, "/many", many, timeout=TIMEOUT))
    thread.start()
    reads = 0
    while thread.is_alive():
        assert other.get("/rate") == 5
        reads += 1
    assert reads > 1000  # a reader that waits for the load gets through once or twice


@pytest.mark.parametrize("seconds", [-10.0, 10.0])
def test_a_wrong_clock_loses_nothing(network: Network, seconds: float) -> None:
    right = network.replica()
    session = network.session()
    session.clock = SkewedClock(session.zid, seconds)
    wrong = network.join(session)
    eventually(lambda: len(right.members()) == 1)
    for number in range(20):
        right.set("/a", ("right", number))
        assert wrong.get("/a") == ["right", number]
        wrong.set("/a", ("wrong", number))
        assert right.get("/a") == ["wrong", number]
        wrong.delete("/a")
        assert not right.has("/a")


class Mute:
    """Something that looks like a replica and never answers."""

    def __init__(self, network: Network) -> None:
        self.session = session = network.session()
        self.member = ReplicaMember(1, session.zid, "mute program (pid 7 on elsewhere)")
        self.token = session.token(Keys(0).token(self.member))
        network.keep(self.token)


def test_a_replica_that_does_not_answer_is_named_once_and_then_not_waited_for(
    network: Network, caplog: pytest.LogCaptureFixture
) -> None:
    one, other = network.replicas(2)
    Mute(network)
    eventually(lambda: len(one.members()) == 2)
    begun = time.monotonic()
    with caplog.at_level(logging.WARNING, "rosz.params"):
        outcome = one.set("/a/b", 1, timeout=3.0)  # the other one has time enough
    took = time.monotonic() - begun
    assert outcome.slow == ("mute program (pid 7 on elsewhere)",)
    (warning,) = caplog.records
    told = re.fullmatch(
        r"'/a/b' is written, but not yet known to mute program \(pid 7 on elsewhere\), "
        r"which did not answer within (\d+(?:\.\d+)?) s",
        warning.getMessage(),
    )
    assert told
    assert 3.0 <= float(told[1]) <= 1.05 * took  # two digits are told
    assert other.get("/a/b") == 1
    again: SimpleQueue[Outcome] = SimpleQueue()
    network.thread(lambda: again.put(one.set("/a/b", 2, timeout=1000)))
    assert again.get(timeout=TIMEOUT).slow == outcome.slow
    assert caplog.text.count("not yet known") == 1


def test_a_write_that_a_replica_refuses_stands_and_its_writer_is_told(network: Network) -> None:
    right = network.replica(label="right")
    session = network.session()
    session.clock = SkewedClock(session.zid, 11 * 365.25 * 86_400)
    wrong = network.join(session)
    eventually(lambda: len(right.members()) == 1)
    right.set("/a", 1)
    with pytest.raises(PartlyWritten) as caught:
        wrong.set("/a", 2, timeout=TIMEOUT)
    assert str(caught.value).startswith("'/a' is written, but not kept at right: ")
    assert "stamped 11.0 years ahead, expected at most 10" in str(caught.value)
    assert caught.value.holders == 0
    assert (wrong.root, right.root) == ({"a": 2}, {"a": 1})


def test_a_replica_that_goes_is_not_waited_for(network: Network) -> None:
    one = network.replica()
    mute = Mute(network)
    eventually(lambda: len(one.members()) == 1)
    timer = threading.Timer(0.2, mute.token.close)
    timer.start()
    assert one.set("/a", 1, timeout=TIMEOUT).slow == ()
    timer.join()


@pytest.mark.usefixtures("patient_joining")
def test_joining_does_not_hang_on_a_replica_that_is_mute(network: Network) -> None:
    Mute(network)
    first = network.replica()
    first.set("/a", 1, timeout=0.1)
    joined: SimpleQueue[Replica] = SimpleQueue()
    network.thread(lambda: joined.put(network.replica()))
    assert joined.get(timeout=TIMEOUT).get("/a") == 1


def test_a_write_that_got_lost_is_told_once_more(network: Network) -> None:
    one, deaf = network.replicas(2)
    deaf._exchange._declared[0].close()
    assert one.set("/a", 1, timeout=TIMEOUT).slow == ()
    assert deaf.get("/a") == 1


def test_what_was_missed_is_found_by_comparing(network: Network) -> None:
    one, deaf = network.replicas(2)
    one.set("/old", 1)
    for declared in (deaf._exchange._declared[0], deaf._exchange._declared[2]):
        declared.close()
    for number in range(300):
        one.set(f"/n/{number}", number, timeout=0)
    one.delete("/old", timeout=0)
    deaf.set("/only", "here", timeout=0)
    assert deaf.root == {"old": 1, "only": "here"}
    assert deaf.compare(TIMEOUT)
    assert deaf.root == one.root == {"n": {str(n): n for n in range(300)}, "only": "here"}
    assert deaf.digest() == one.digest()
    assert one.compare(TIMEOUT)


def test_those_that_meet_again_compare_unasked(network: Network) -> None:
    one, deaf = network.replicas(2)
    for declared in (deaf._exchange._declared[0], deaf._exchange._declared[2]):
        declared.close()
    one.set("/a", 1, timeout=0)
    watch, token = deaf._runner.core._members._watch, Keys(0).token(deaf.members()[0])
    deaf._tokens._on_token(watch, token, False)
    assert deaf.members() == []
    deaf._tokens._on_token(watch, token, True)
    eventually(lambda: deaf.has("/a"))


def test_leaving_is_seen_and_ends_writing(network: Network) -> None:
    one, other = network.replicas(2)
    with one:
        one.set("/a", 1)
    one.close()
    assert one.closed
    eventually(lambda: other.members() == [])
    with pytest.raises(ClosedError, match="parameter store of this process is closed"):
        one.set("/a", 2)
    assert one.get("/a") == 1
    assert repr(one).endswith("writes, closed>")
    assert repr(other) == "<Replica of 1 writes, 0 others>"


def test_what_nobody_wrote_is_survived(network: Network, caplog: pytest.LogCaptureFixture) -> None:
    replica = network.replica()
    stranger = network.session()
    keys = Keys(0)
    eventually(lambda: stranger.peers() == [replica.zid])
    junk = [b"", b"\xff", b"\x93", b"[1,2,3]", b"\xc1" * 50, b"\x96\x01\xff\xa1x\xa1y\x90\x90"]
    for data in junk:
        stranger.put(keys.change, data)
        stranger.put(keys.ack(replica.zid), data)
        for purpose in ("sync", "write", "ask"):
            stranger.get(keys.of(replica.zid, purpose), payload=data, timeout=5)
    stranger.token(f"{keys.tokens[:-3]}/nonsense").close()
    assert replica.set("/a", 1).slow == ()
    assert replica.root == {"a": 1}
    assert any(
        "wrote something that is not a parameter" in record.message for record in caplog.records
    )
    assert not [record for record in caplog.records if record.levelno >= logging.ERROR]


def test_a_program_with_a_name_that_is_no_utf_8(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["/home/file-\udcff.py"])
    one, other = network.replica(), network.replica()
    eventually(lambda: len(one.members()) == 1)
    one.set("/a", 1)
    assert other.get("/a") == 1
    assert other.origin("/a").startswith("file-\ufffd.py (pid ")
