from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from network import eventually

from rosz.params.replica import Replica
from rosz.params.tree import MISSING, leaves
from rosz.params.wire import Keys, decode_value
from rosz.params.writes import Write
from rosz.session import Reply, Session

from .network import Network, merge
from .storage import Storage
from .strategies import BELOW_ROOT, VALUES

KEYS = Keys(0)


def ask(session: Session, key: str) -> dict[str, Any]:
    replies = session.get(key, timeout=5, target="best")
    return {reply.key: decoded(reply) for reply in replies}


def decoded(reply: Reply) -> Any:
    assert reply.ok, reply.payload
    assert reply.stamp is not None
    return decode_value(reply.payload)


def test_any_client_reads_the_keys(network: Network) -> None:
    replica = network.replica()
    replica.set("/", {"a": {"b": 1, "c d": [2]}, "*": "odd", "e": {}})
    stranger = network.session()
    assert ask(stranger, "@rosz/0/param/a/b") == {"@rosz/0/param/a/b": 1}
    assert ask(stranger, "@rosz/0/param/a") == {"@rosz/0/param/a": {"b": 1, "c d": [2]}}
    assert ask(stranger, "@rosz/0/param/a/*") == {
        "@rosz/0/param/a/b": 1,
        "@rosz/0/param/a/c d": [2],
    }
    assert ask(stranger, "@rosz/0/param/**") == {
        "@rosz/0/param/a/b": 1,
        "@rosz/0/param/a/c d": [2],
        "@rosz/0/param/%2A": "odd",
        "@rosz/0/param/e": {},
    }
    assert ask(stranger, "@rosz/0/param/nowhere") == {}
    refused = stranger.get("@rosz/0/param/%zz", timeout=5, target="best")
    assert [reply.ok for reply in refused] == [False]


def test_one_replica_replies_for_all_and_another_when_it_is_gone(network: Network) -> None:
    one, other = network.replicas(2)
    one.set("/a", 1)
    stranger = network.session()
    key = KEYS.param(("a",))
    eventually(lambda: len(stranger.get(key, timeout=5)) == 1)
    one.close()
    eventually(lambda: len(stranger.get(key, timeout=5)) == 1)
    other.set("/a", 2)
    assert ask(stranger, key) == {key: 2}


def test_payloads_are_plain_msgpack(network: Network) -> None:
    replica = network.replica()
    replica.set("/a", {"x": [1, 2.5, "t", True, b"raw"]})
    reply = network.session().get("@rosz/0/param/a/x", timeout=5, target="best")[0]
    assert msgspec.msgpack.decode(reply.payload) == [1, 2.5, "t", True, b"raw"]


def held(storage: Storage) -> dict[str, Any]:
    return {key: decode_value(payload) for key, (_, payload) in storage.held.items()}


def shown(tree: dict[str, Any]) -> dict[str, Any]:
    return {KEYS.param(path): value for path, value in leaves(tree) if path}


def test_a_storage_holds_what_the_store_holds(network: Network) -> None:
    storage = Storage(network.session())
    network.keep(storage)
    one, other = network.replicas(2)
    one.set("/a", {"b": 1, "c": {"d": 2}})
    other.set("/a/b", {"deep": [3]})
    one.delete("/a/c")
    other.set("/leaf", 5)
    one.set("/leaf/now/a", "dict")
    merge(one, "/", {"k": {"x": 1, "y": 2}})
    one.set("/gone", 1)
    other.set("/", {**one.root, "z": dt.datetime(2024, 1, 2, tzinfo=dt.UTC), "gone": 2})
    other.delete("/gone")
    eventually(lambda: held(storage) == shown(one.root))


def source(replica: Replica) -> Write | None:
    """Return the write that /a/b has its value from."""
    with replica._runner as history:
        return history.source(("a", "b"))


def test_a_storage_brings_the_store_back(network: Network) -> None:
    storage = Storage(network.session())
    network.keep(storage)
    first = network.replica()
    first.set("/a", {"b": 1, "c": [2, b"x"]})
    first.set("/old", 1)
    first.delete("/old")
    eventually(lambda: held(storage) == shown(first.root))
    stamp = source(first)
    first.close()
    again = network.replica()
    assert again.root == {"a": {"b": 1, "c": [2, b"x"]}}
    restored = source(again)
    assert stamp is not None
    assert restored is not None
    assert (restored.time, restored.clock) == (stamp.time, stamp.clock)
    assert again.set("/a/b", 2).time > stamp.time


def test_a_storage_that_comes_late_or_is_wrong_is_put_right(network: Network) -> None:
    replica = network.replica()
    replica.set("/a", {"b": 1, "c": 2})
    storage = Storage(network.session())
    network.keep(storage)
    eventually(lambda: held(storage) == {"@rosz/0/param/a/b": 1, "@rosz/0/param/a/c": 2})
    stranger = network.session()
    stranger.put("@rosz/0/param/left over", b"\x01", stamp=stranger.stamp())
    stranger.put("@rosz/0/param/a//b".replace("//", "/%41"), b"\x01", stamp=stranger.stamp())
    stranger.put("@rosz/0/param/a/b", b"\x09", stamp=stranger.stamp())
    eventually(lambda: len(storage.held) == 4)
    replica._parameter_keys.reconcile()
    eventually(lambda: held(storage) == {"@rosz/0/param/a/b": 1, "@rosz/0/param/a/c": 2})


def test_the_session_may_close_while_a_storage_is_put_right(
    network: Network, monkeypatch: pytest.MonkeyPatch
) -> None:
    replica = network.replica()
    replica.set("/a", 1)
    tasks: list[Callable[[], object]] = []
    monkeypatch.setattr("rosz.params.replica.replica.lend_thread", tasks.append)
    network.keep(Storage(network.session()))
    eventually(lambda: tasks, "its comparison with the tree")
    replica._session.close()
    tasks[0]()


@settings(max_examples=15)
@given(
    st.lists(
        st.tuples(st.integers(0, 1), BELOW_ROOT, st.one_of(st.just(MISSING), VALUES)), max_size=10
    )
)
def test_a_storage_follows_any_history(steps: list[tuple[int, Any, Any]]) -> None:
    network = Network()
    try:
        storage = Storage(network.session())
        network.keep(storage)
        replicas = network.replicas(2)
        for writer, path, value in steps:
            replica = replicas[writer]
            name = "/" + "/".join(path)
            if value is not MISSING:
                replica.set(name, value)
            elif replica.has(name):
                replica.delete(name)
        expected = shown(replicas[0].root)
        eventually(lambda: {k: v for k, v in held(storage).items() if v != {}} == expected)
    finally:
        network.close()


def test_damaged_storages_are_survived(network: Network, caplog: pytest.LogCaptureFixture) -> None:
    storage = Storage(network.session())
    network.keep(storage)
    stranger = network.session()
    stranger.put("@rosz/0/param/a", b"\xc1", stamp=stranger.stamp())
    stranger.put("@rosz/0/param/%61", b"\x01", stamp=stranger.stamp())
    stranger.put("@rosz/0/param/b", b"\x01", stamp=stranger.stamp())
    eventually(lambda: len(storage.held) == 3)
    replica = network.replica()
    assert replica.root == {"b": 1}
    assert caplog.text.count("a storage holds something that is not a parameter") == 2


def test_a_storage_gives_back_names_that_are_no_parts_of_keys(network: Network) -> None:
    storage = Storage(network.session())
    network.keep(storage)
    one = network.replica()
    eventually(lambda: one._parameter_keys.subscribed)
    value = {"a": {"": 1, "b": 2}, "c": {"d/e": 3, "f": 4}, "g": 5}
    one.set("/v", value)
    eventually(lambda: len(storage.held) == 3)
    one._parameter_keys.reconcile()
    assert len(storage.held) == 3
    one.close()
    assert network.replica().get("/v") == value
