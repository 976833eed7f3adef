from __future__ import annotations

import datetime as dt
import threading
from collections.abc import Iterable
from queue import SimpleQueue
from typing import Any

import pytest
from network import TIMEOUT, eventually

from rosz.errors import NoReplica, ParamError, ParamNotFound, WaitTimeout
from rosz.params.replica import ACK_TIMEOUT, Changed, Outcome, ParamClient
from rosz.params.replica.core.events import CompareCalled
from rosz.params.wire import Keys
from rosz.params.writes import DELETED, Change, condense
from rosz.session import HybridClock, Query

from .network import Network, merge
from .test_replica import Mute


@pytest.fixture
def client(network: Network) -> ParamClient:
    network.replicas(2)
    return ParamClient(network.command(), origin="a command")


def test_reading_and_writing_through_others(client: ParamClient) -> None:
    assert client.names() == []
    outcome = client.set("/a", {"b": 1, "c": [2, b"x"]})
    assert outcome.slow == ()
    assert client.get("/a") == {"b": 1, "c": [2, b"x"]}
    assert client.names() == ["/a/b", "/a/c"]
    assert client._get("/a/b").origin == "a command"
    merge(client, "/a", {"b": {"d": 3}})
    assert client.get("/") == {"a": {"b": {"d": 3}, "c": [2, b"x"]}}
    assert client.search("b", "/a/x/y") == "/a/b"
    assert client.search("q") is None
    client.delete("/a/b")
    with pytest.raises(ParamNotFound):
        client.get("/a/b")
    moment = dt.datetime(2024, 1, 2, 3, tzinfo=dt.timezone(dt.timedelta(hours=1)))
    client.set("/when", moment)
    assert repr(client.get("/when")) == repr(moment)
    client.delete("/")
    assert client.get("/") == {}
    assert client.silent == []


def test_every_replica_has_it_when_a_write_returns(network: Network) -> None:
    replicas = network.replicas(3)
    client = ParamClient(network.command())
    for number in range(20):
        client.set("/a", number)
        assert [replica.get("/a") for replica in replicas] == [number] * 3
    client.write(condense([(("a",), DELETED), (("b",), 1)]))
    assert all(replica.root == {"b": 1} for replica in replicas)


def test_errors_are_the_same_as_near(client: ParamClient) -> None:
    client.set("/robot/speed", 1)
    with pytest.raises(
        ParamNotFound, match="'/robot/sped' is not set; did you mean '/robot/speed'"
    ):
        client.get("/robot/sped")
    with pytest.raises(ParamNotFound):
        client.delete("/robot/sped")
    with pytest.raises(ParamError, match="the root of all parameters is a dict"):
        client.set("/", 1)
    with pytest.raises(ParamError, match="null is not a parameter value"):
        client.set("/a", None)
    with pytest.raises(ParamError, match="cannot search for '~a'"):
        client.search("~a")


def test_nobody_there_is_said_with_what_to_start(network: Network) -> None:
    network.session()
    client = ParamClient(network.command())
    for call in (client.names, lambda: client.set("/a", 1), client.follow):
        with pytest.raises(NoReplica, match=r"no process on this network holds .* 'rosz core'"):
            call()


def test_a_replica_that_does_not_answer_is_passed_over(network: Network) -> None:
    Mute(network)
    replica = network.replica()
    client = ParamClient(network.command(), timeout=1000)
    replica.set("/a", 1, timeout=0.1)
    got: SimpleQueue[Any] = SimpleQueue()
    network.thread(lambda: got.put(client.get("/a")))
    assert got.get(timeout=TIMEOUT) == 1


def test_a_write_waits_once_for_one_that_does_not_answer(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    mute = Mute(network)
    kept: list[Query] = []
    key = f"{Keys(0).of(mute.member.zid, 'set')}/**"
    network.keep(mute.session.queryable(key, kept.append, complete=True))
    replica = network.replica()
    waits: list[float] = []
    write = replica.write

    def note(changes: Iterable[Change], *, timeout: float, **how: Any) -> Outcome:
        waits.append(timeout)
        return write(changes, timeout=timeout, **how)

    monkeypatch.setattr(replica._server, "_write_batch", note)
    outcome = ParamClient(network.command()).set("/a", 1)
    (wait,) = waits
    assert wait <= ACK_TIMEOUT - 1  # the silent one is given up after 1 s
    assert len(kept) == 1
    assert outcome.slow == ("mute program (pid 7 on elsewhere)",)
    assert replica.get("/a") == 1


def test_only_replicas_that_do_not_answer_end_in_a_timeout(network: Network) -> None:
    Mute(network)
    client = ParamClient(network.command(), timeout=0.3)
    with pytest.raises(WaitTimeout, match=r"no answer about parameters within 0\.3 s"):
        client.get("/a")


def test_a_writer_whose_clock_is_behind_still_writes_last(network: Network) -> None:
    replica = network.replica()
    session = network.command()
    session.clock = HybridClock(session.zid)
    client = ParamClient(session)
    ahead = replica._session.clock
    ahead.observe(type(ahead.now())(ahead.now().time + 3600 * 10**9, "x"))
    replica.set("/a", "from an hour ahead")
    client.set("/a", "later")
    assert replica.get("/a") == "later"


def test_doing_a_write_again_much_later_changes_nothing(network: Network) -> None:
    from rosz.params.wire import Batch, ClientRequest, Keys, encode

    replica = network.replica()
    session = network.session()
    stamp = replica._session.stamp()
    batch = Batch.of((stamp.time, session.zid), "x", [(("a",), "old")])
    question = encode(ClientRequest("write", batch=batch, timeout=1))
    key = Keys(0).of(replica.zid, "set")
    assert session.get(key, payload=question, timeout=5)[0].ok
    replica.set("/a", "new")
    assert session.get(key, payload=question, timeout=5)[0].ok
    assert replica.get("/a") == "new"


def test_following_without_being_one(network: Network) -> None:
    replicas = network.replicas(2)
    client = ParamClient(network.command(), origin="a command")
    client.set("/a", 1)
    heard: SimpleQueue[Changed] = SimpleQueue()
    with client.follow() as follower:
        assert follower.get("/a") == 1
        follower.watch("/a", heard.put)
        client.set("/a", 2)
        change = heard.get(timeout=TIMEOUT)
        assert (change.name, change.old, change.new, change.origin) == ("/a", 1, 2, "a command")
        for replica in replicas:
            replica.set("/a", replica.label)
            assert heard.get(timeout=TIMEOUT).new == replica.label
        assert all(len(replica.members()) == 1 for replica in replicas)
    follower.close()


def test_a_follower_finds_what_it_missed(network: Network) -> None:
    replica = network.replica()
    client = ParamClient(network.command())
    replica.set("/a", 1)
    with client.follow() as follower:
        assert replica.members() == []
        follower._exchange._declared[0].close()
        replica.set("/a", 2)
        assert follower._runner.call(lambda call, _: CompareCalled(call, TIMEOUT))
        eventually(lambda: follower.get("/a") == 2)


def test_damaged_keys_are_reported_once(network: Network, caplog: pytest.LogCaptureFixture) -> None:
    replica, other = network.replica(), network.session()
    with ParamClient(network.command()).follow() as follower:
        for _ in range(3):
            other.put(f"@rosz/0/change/{replica.zid}/%zz", b"damaged")
        replica.set("/a", 1)
        eventually(lambda: follower.has("/a"))
        told = "a replica wrote something that is not a parameter"
        eventually(lambda: told in caplog.text)
        assert "Traceback" not in caplog.text


def test_many_may_write_at_once(network: Network, client: ParamClient) -> None:
    clients = [ParamClient(network.command(), timeout=20) for _ in range(4)]
    failures: SimpleQueue[BaseException] = SimpleQueue()

    def write(index: int) -> None:
        try:
            for number in range(10):
                clients[index].set(f"/n{index}/{number}", number)
        except BaseException as error:  # noqa: BLE001  # told to the test
            failures.put(error)

    threads = [threading.Thread(target=write, args=(index,)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures.empty()
    assert len(client.names()) == 40
