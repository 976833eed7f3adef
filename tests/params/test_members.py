"""Whom a replica follows: seeds, and all others only while it has to."""

from __future__ import annotations

import pytest
from network import TIMEOUT, eventually

from rosz.params.replica import Replica
from rosz.params.replica.core import seeds as joining
from rosz.params.replica.core.events import StoppedPeersFound
from rosz.params.wire import Keys, ReplicaMember, SyncRequest, encode
from rosz.session import SessionConfig

from .network import Network
from .test_replica import Mute

COUNT = 7
KEYS = Keys(0)


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let replicas become seeds as soon as there are too few."""
    monkeypatch.setattr(joining, "_CHANCE", 1.0)


def crowd(network: Network) -> tuple[list[Replica], list[Replica]]:
    """Return replicas on clients of a router: its seeds and the others, once all know those."""
    network.session(SessionConfig(mode="router", rendezvous=network.rendezvous))
    return sort_out([network.join(network.command()) for _ in range(COUNT)])


def known(replica: Replica) -> int:
    return len(replica._runner.core.zids)


def age(replica: Replica) -> ReplicaMember:
    return replica._runner.core.config.member


def sort_out(everyone: list[Replica]) -> tuple[list[Replica], list[Replica]]:
    def agreed() -> bool:
        chosen = {one.zid for one in everyone if one._runner.core.is_seed}
        return len(chosen) == joining.SEEDS and all(
            {one.zid for one in replica._runner.core.seeds()} == chosen - {replica.zid}
            for replica in everyone
        )

    eventually(agreed, "all know the seeds")
    few = [replica for replica in everyone if replica._runner.core.is_seed]
    few.sort(key=age)
    return few, [replica for replica in everyone if not replica._runner.core.is_seed]


def test_a_replica_that_only_reads_follows_seeds_alone(network: Network) -> None:
    few, others = crowd(network)
    assert len(few) == joining.SEEDS
    eventually(lambda: all(known(one) == COUNT - 1 for one in few), "seeds know all")
    for number in range(20):
        assert few[0].set("/count", number).slow == ()
        assert {replica.get("/count") for replica in few + others} == {number}
    assert all(known(one) == joining.SEEDS for one in others)
    # Whoever writes first has to know all others, who acknowledge it.
    for number, replica in enumerate(others):
        assert replica.set("/mine", number).slow == ()
        assert {one.get("/mine") for one in few + others} == {number}
    assert all(known(one) == COUNT - 1 for one in others)


def test_tokens_of_no_replica_are_reported_once(
    network: Network, caplog: pytest.LogCaptureFixture
) -> None:
    replica = network.join(network.session())
    other = network.session()
    zid = "f" * 32
    seed = KEYS.token(age(replica), seed=True).replace(replica.zid, zid)
    tokens = [other.token(f"{seed}/{number}") for number in range(5)]
    tokens.append(other.token(seed))
    eventually(lambda: zid in {one.zid for one in replica._runner.core.seeds()}, "a seed")
    assert caplog.text.count("is not that of a replica (reported once)") == 1


def test_others_become_seeds_when_these_go(network: Network) -> None:
    few, others = crowd(network)
    others[0].set("/kept", 1)
    for replica in few:
        replica.close()
    late = network.join(network.command())
    assert late.get("/kept") == 1
    sort_out([*others, late])
    assert late.set("/kept", 2).slow == ()
    assert {replica.get("/kept") for replica in others} == {2}


def test_seeds_that_are_too_many_follow_no_longer(network: Network) -> None:
    few, others = crowd(network)
    for replica in others:
        with replica._runner as _:
            replica._runner.core._seeding.become()
        replica._runner.run(StoppedPeersFound(frozenset()))
    left, rest = sort_out(few + others)
    assert left == sorted(few + others, key=age)[: joining.SEEDS]
    eventually(lambda: all(known(one) == joining.SEEDS for one in rest), "the rest")


def test_what_another_than_a_seed_missed_is_found(network: Network) -> None:
    few, others = crowd(network)
    deaf = others[0]
    deaf._exchange._declared[0].close()
    few[0].set("/a", 1, timeout=0)
    deaf.set("/b", 2, timeout=0)
    assert not deaf.has("/a")
    assert deaf.compare(TIMEOUT)
    eventually(lambda: deaf.has("/a") and few[-1].has("/b"))


@pytest.mark.parametrize("count", [1, joining.SEEDS])
def test_a_newcomer_joins_whatever_becomes_of_seeds(network: Network, count: int) -> None:
    network.session(SessionConfig(mode="router", rendezvous=network.rendezvous))
    replica = network.join(network.command())
    replica.set("/a", 1)
    for _ in range(count):
        mute = Mute(network)
        network.keep(mute.session.token(KEYS.token(mute.member, seed=True)))
    if count == joining.SEEDS:
        eventually(lambda: not replica._runner.core.is_seed, "it leaves that to older ones")
    assert network.join(network.command()).get("/a") == 1


def test_tokens_of_seeds_carry_the_replica() -> None:
    member = ReplicaMember(12, "f0", "a program (pid 1 on here)")
    assert KEYS.member(KEYS.token(member, seed=True)) == member


def test_where_there_is_a_seed_it_appoints_others(network: Network) -> None:
    network.session(SessionConfig(mode="router", rendezvous=network.rendezvous))
    mute = Mute(network)
    network.keep(mute.session.token(KEYS.token(mute.member, seed=True)))
    replica = network.join(network.command())
    eventually(lambda: len(replica._runner.core.seeds()) == 1, "it knows the seed")
    sender = network.command()
    request = encode(SyncRequest(b"", appoints=True))
    sender.get(KEYS.of(replica.zid, "sync"), payload=request, timeout=10.0)
    eventually(lambda: replica._runner.core.is_seed, "it is one now")
