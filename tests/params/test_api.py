from __future__ import annotations

import threading
import time
import timeit
from queue import SimpleQueue

import pytest
from network import TIMEOUT

from rosz.errors import ClosedError, InvalidName, ParamError, ParamNotFound
from rosz.params.replica import Changed, Params, Replica

from .network import Network


@pytest.fixture
def replica(network: Network) -> Replica:
    return network.replica(label="talker.py")


@pytest.fixture
def params(replica: Replica) -> Params:
    return Params(replica, "/ns/node", {"/ns/old": "/elsewhere/new"})


def test_names_are_the_nodes_own(params: Params, replica: Replica) -> None:
    params["~gain"] = 1.5
    params["rate"] = 10
    params["/abs"] = True
    params["old"] = "moved"
    params["odd name*"] = 1
    assert replica.root == {
        "ns": {"node": {"gain": 1.5}, "rate": 10, "odd name*": 1},
        "abs": True,
        "elsewhere": {"new": "moved"},
    }
    assert params["~gain"] == params["/ns/node/gain"] == 1.5
    assert params["old"] == "moved"
    assert params["~"] == {"gain": 1.5}
    assert params.resolve("~gain") == "/ns/node/gain"
    assert params["/"] == replica.root


def test_it_is_much_like_a_dict(params: Params) -> None:
    params.update({"~a": 1, "b": {"c": 2}, "/d": [3]})
    assert "~a" in params
    assert "nothing" not in params
    assert 5 not in params
    assert list(params) == params.names() == ["/d", "/ns/b/c", "/ns/node/a"]
    assert len(params) == 3
    del params["~a"]
    assert not params.has("~a")
    assert params.has("~")
    params.delete("b")
    with pytest.raises(KeyError, match="parameter '/ns/b' is not set"):
        params["b"]
    with pytest.raises(ParamNotFound):
        del params["b"]
    assert repr(params) == "<Params of /ns/node>"


def test_getting_with_and_without_default(params: Params) -> None:
    params["x"] = 1
    assert params.get("x") == 1
    assert params.get("x", 5) == 1
    assert params.get("y", 5) == 5
    assert params.get("y", None) is None
    with pytest.raises(KeyError, match="'/ns/y' is not set"):
        params.get("y")


def test_typed_reads_refuse_and_say_where_it_was_set(params: Params, replica: Replica) -> None:
    params["~rate"] = 10
    rate = params.get("~rate", 1.0, type=float)
    assert rate == 10.0
    assert isinstance(rate, float)
    assert params.get("~missing", 1.0, type=float) == 1.0
    replica.set("/ns/node/rate", "fast", origin="demo.launch:7")
    with pytest.raises(
        ParamError,
        match=r"'/ns/node/rate' is the str 'fast' \(set by demo.launch:7\); expected float",
    ):
        params.get("~rate", 10.0, type=float)
    with pytest.raises(ParamNotFound):
        params.get("~missing", type=int)


def test_whoever_sets_is_told(params: Params) -> None:
    params["~a"] = 1
    assert params.origin("~a") == "/ns/node (talker.py)"
    assert params.origin("~b") == ""


def test_an_update_is_one_change_in_the_order_given(params: Params, replica: Replica) -> None:
    params.update({"a": {"x": 1, "y": 2}, "a/x": 3})
    assert params["a"] == {"x": 3, "y": 2}
    params.update({"a/x": 3, "a": 5})
    assert params["a"] == 5
    with pytest.raises(ParamError, match="'/ns/c' cannot be set: null"):
        params.update({"b": 1, "c": None})
    assert "b" not in params
    params.update({})
    assert replica.get("/ns") == {"a": 5}


def test_searching_climbs(params: Params) -> None:
    params["/top"] = 1
    params["/ns/node/deep/er"] = 2
    assert params.search("top") == "/top"
    assert params.search("deep/other") == "/ns/node/deep/other"
    assert params.search("/top") == "/top"
    assert params.search("nowhere") is None
    params["/elsewhere/new"] = 3
    assert params.search("old") == "/elsewhere/new"
    with pytest.raises(ParamError, match="cannot search for '~x'"):
        params.search("~x")


def test_watching(params: Params) -> None:
    heard: SimpleQueue[Changed] = SimpleQueue()
    with params.watch("~gain", heard.put):
        params["~gain"] = 2
        change = heard.get(timeout=TIMEOUT)
        assert (change.name, change.old, change.new) == ("/ns/node/gain", None, 2)
        assert change.origin == "/ns/node (talker.py)"
        assert not change.deleted
        del params["~gain"]
        assert heard.get(timeout=TIMEOUT).deleted


def test_what_is_read_is_the_readers_own(params: Params) -> None:
    params["l"] = [1, {"a": [2]}]
    params["l"].append(3)
    params.get("l")[1]["a"].append(4)
    assert params["l"] == [1, {"a": [2]}]


def test_bad_names_and_values_are_named(params: Params) -> None:
    with pytest.raises(InvalidName, match="half of a surrogate pair"):
        params["a\udc80"] = 1
    with pytest.raises(ParamError, match="'/ns/node/x' cannot be set: a set is not a"):
        params["~x"] = {1}
    with pytest.raises(ParamError, match="the root of all parameters is a dict"):
        params["/"] = 1


def test_a_closed_store_still_reads_but_writes_no_more(params: Params, replica: Replica) -> None:
    params["a"] = 1
    replica.close()
    assert params["a"] == 1
    with pytest.raises(ClosedError):
        params["a"] = 2


def test_names_made_up_for_ever_cost_no_memory(params: Params) -> None:
    for number in range(25_000):
        params.has(f"~made/up{number}")
    assert len(params._paths) <= 10_000


def test_a_read_takes_less_than_a_microsecond(params: Params) -> None:
    params["~gain"] = 1.5
    timer = timeit.Timer(lambda: params["~gain"], timer=time.thread_time)
    assert min(timer.repeat(number=10_000, repeat=7)) / 10_000 < 1e-6


def test_reads_go_on_while_a_set_waits(network: Network, params: Params) -> None:
    from .test_replica import Mute

    params["a"] = 1
    Mute(network)
    thread = threading.Thread(target=lambda: params.set("a", 2, timeout=0.5))
    begun = time.monotonic()
    thread.start()
    while params["a"] == 1:
        assert time.monotonic() - begun < TIMEOUT
    assert params["a"] == 2
    thread.join()
