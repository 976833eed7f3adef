"""Whom a replica follows: elders, and all others only while it has to."""

from __future__ import annotations

import pytest
from network import eventually

from rosz.params.replica import Replica
from rosz.params.replica import replica as joining
from rosz.params.wire import Keys, Member, SyncRequest, encode
from rosz.session import SessionConfig

from .network import Network
from .test_replica import Mute

COUNT = 7
KEYS = Keys(0)


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let replicas become elders as soon as there are too few."""
    monkeypatch.setattr(joining, "_CHANCE", 1.0)


def crowd(network: Network) -> tuple[list[Replica], list[Replica]]:
    """Return replicas on clients of a router: its elders and the others, once all know those."""
    network.session(SessionConfig(mode="router", rendezvous=network.rendezvous))
    return sort_out([network.join(network.command()) for _ in range(COUNT)])


def sort_out(everyone: list[Replica]) -> tuple[list[Replica], list[Replica]]:
    def agreed() -> bool:
        chosen = {one.zid for one in everyone if one._elder is not None}
        return len(chosen) == joining._ELDERS and all(
            {one.zid for one in replica._members.elders()} == chosen - {replica.zid}
            for replica in everyone
        )

    eventually(agreed, "all know the elders")
    few = [replica for replica in everyone if replica._elder is not None]
    few.sort(key=lambda one: one._own)
    return few, [replica for replica in everyone if replica._elder is None]


def test_a_replica_that_only_reads_follows_elders_alone(network: Network) -> None:
    few, others = crowd(network)
    assert len(few) == joining._ELDERS
    eventually(lambda: all(len(one._members.zids) == COUNT - 1 for one in few), "elders know all")
    for number in range(20):
        assert few[0].set("/count", number).slow == ()
        assert {replica.get("/count") for replica in few + others} == {number}
    assert all(len(one._members.zids) == joining._ELDERS for one in others)
    # Whoever writes first has to know all others, who acknowledge it.
    for number, replica in enumerate(others):
        assert replica.set("/mine", number).slow == ()
        assert {one.get("/mine") for one in few + others} == {number}
    assert all(len(one._members.zids) == COUNT - 1 for one in others)


def test_others_become_elders_when_these_go(network: Network) -> None:
    few, others = crowd(network)
    others[0].set("/kept", 1)
    for replica in few:
        replica.close()
    late = network.join(network.command())
    assert late.get("/kept") == 1
    sort_out([*others, late])
    assert late.set("/kept", 2).slow == ()
    assert {replica.get("/kept") for replica in others} == {2}


def test_elders_that_are_too_many_follow_no_longer(network: Network) -> None:
    few, others = crowd(network)
    for replica in others:
        replica._members.follow_all("elder")
        replica._become_elder()
    left, rest = sort_out(few + others)
    assert left == sorted(few + others, key=lambda one: one._own)[: joining._ELDERS]
    eventually(lambda: all(len(one._members.zids) == joining._ELDERS for one in rest), "the rest")


def test_what_another_than_an_elder_missed_is_found(network: Network) -> None:
    few, others = crowd(network)
    deaf = others[0]
    deaf._broadcaster._declared[0].close()
    few[0].set("/a", 1, timeout=0)
    deaf.set("/b", 2, timeout=0)
    assert not deaf.has("/a")
    deaf._sync.compare_with_one()
    eventually(lambda: deaf.has("/a") and few[-1].has("/b"))


@pytest.mark.parametrize("count", [1, joining._ELDERS])
def test_a_newcomer_joins_whatever_becomes_of_elders(network: Network, count: int) -> None:
    network.session(SessionConfig(mode="router", rendezvous=network.rendezvous))
    replica = network.join(network.command())
    replica.set("/a", 1)
    for _ in range(count):
        mute = Mute(network)
        network.keep(mute.session.token(KEYS.elder_token(mute.member)))
    if count == joining._ELDERS:
        eventually(lambda: replica._elder is None, "it leaves that to older ones")
    assert network.join(network.command()).get("/a") == 1


def test_tokens_of_elders_carry_the_replica() -> None:
    member = Member(12, "f0", "a program (pid 1 on here)")
    assert KEYS.member(KEYS.elder_token(member)) == member


def test_where_there_is_an_elder_it_appoints_others(network: Network) -> None:
    network.session(SessionConfig(mode="router", rendezvous=network.rendezvous))
    mute = Mute(network)
    network.keep(mute.session.token(KEYS.elder_token(mute.member)))
    replica = network.join(network.command())
    eventually(lambda: len(replica._members.elders()) == 1, "it knows the elder")
    if replica._elder is not None:  # it was told too late
        replica._elder.close()
        replica._elder = None
    for _ in range(10):
        replica._check_elders()
    assert replica._elder is None
    sender = network.command()
    request = encode(SyncRequest(b"", appoints=True))
    sender.get(KEYS.of(replica.zid, "sync"), payload=request, timeout=10.0)
    eventually(lambda: replica._elder is not None, "it is one now")
