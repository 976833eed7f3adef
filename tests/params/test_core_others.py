"""Joining others, comparing with them, and being a seed, as conversations with the core."""

from __future__ import annotations

import copy
import gc
from types import FunctionType, ModuleType

import pytest

from rosz.params.history import History
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said
from rosz.params.wire import Index, Record, SyncReply, SyncRequest
from rosz.params.writes import DELETED, Write, put

from .dialogue import JOIN, WALL, Dialogue, batch, member, requests, writer

B, C, D = member("bb"), member("cc", 20), member("dd", 70)


def theirs(*writes: Write) -> History:
    history = History()
    history.apply(writes)
    return history


def answer_all(talk: Dialogue, history: History) -> None:
    """Answer comparisons as a replica with a history does, until there are none."""
    while queries := talk.all(done.SendQuery):
        request = queries[0].request
        reply = SyncReply(history.digest())
        if request.index is not None:
            found = history.compare(*request.index.content(), request.horizon)
            reply.records = [Record.of(write) for write in found.lacking]
            reply.wanted = ["/".join(path) for path in found.wanted]
        history.apply(record.write() for record in request.records)
        talk.say(said.QueryEnded(queries[0].number, reply))


def test_who_finds_nobody_reads_storages_and_becomes_a_seed() -> None:
    talk = Dialogue()
    talk.say(said.JoinCalled(JOIN))
    watch = talk.only(done.FollowAll).watch
    assert not talk.all(done.DeclareToken)
    talk.say(said.MembersKnown(watch))
    assert talk.all(done.DeclareToken)
    assert talk.all(done.ReadStorages)
    talk.say(said.StoragesRead([put(("a",), (5, "c0"), 1)]))
    assert talk.answer is True
    assert talk.all(done.DeclareSeed)
    assert talk.core.is_oldest_seed
    assert talk.core.history.root == {"a": 1}


def test_the_search_for_others_has_an_end() -> None:
    talk = Dialogue()
    talk.say(said.JoinCalled(JOIN))
    talk.sleep(10.0)
    assert talk.only(done.ReadStorages)


def test_who_joins_gets_everything_from_the_oldest() -> None:
    talk = Dialogue()
    talk.say(said.SeedCame(C), said.SeedCame(B), said.JoinCalled(JOIN))
    assert talk.all(done.DeclareToken)
    assert not talk.all(done.FollowAll)
    ((zid, request),) = requests(talk)
    assert (zid, request.digest) == ("bb", b"")
    history = theirs(put(("a",), (5, "c0"), 1), put(("b",), (6, "c0"), DELETED))
    records = [Record.of(write) for write in history.writes()]
    talk.say(
        said.QueryEnded(
            talk.only(done.SendQuery).number, SyncReply(history.digest(), True, records)
        )
    )
    assert talk.answer is True
    assert talk.core.history.digest() == history.digest()
    assert not talk.core.is_seed


def test_who_joins_asks_the_next_when_one_is_silent_or_joins_itself() -> None:
    talk = Dialogue()
    talk.say(said.SeedCame(B), said.SeedCame(C), said.JoinCalled(JOIN))
    talk.sleep(0.3)
    assert [zid for zid, _ in requests(talk)] == ["cc"]
    talk.say(said.QueryEnded(talk.only(done.SendQuery).number, SyncReply(b"", False)))
    assert not talk.all(done.Answer)
    talk.sleep(0.6)
    talk.say(said.StoppedPeersFound(frozenset()))
    assert not talk.all(done.Answer)
    talk.sleep(5.0)
    talk.say(said.StoppedPeersFound(frozenset(["bb", "cc"])))
    watch = talk.only(done.FollowAll).watch
    talk.say(said.MemberCame(watch, D), said.MembersKnown(watch))
    assert [zid for zid, _ in requests(talk)] == ["dd"]
    talk.say(said.QueryEnded(talk.only(done.SendQuery).number, SyncReply()))
    assert talk.answer is True
    assert talk.all(done.UnfollowAll)


def test_nobody_joins_those_that_are_all_stopped() -> None:
    talk = Dialogue()
    talk.say(said.SeedCame(B), said.JoinCalled(JOIN))
    talk.sleep(0.3)
    talk.say(said.StoppedPeersFound(frozenset(["bb"])))
    talk.say(said.MembersKnown(talk.only(done.FollowAll).watch))
    talk.sleep(0.3)
    talk.say(said.StoppedPeersFound(frozenset(["bb"])))
    assert talk.answer is True
    assert "no replica of the parameters answered" in talk.all(done.Log)[0].text


def test_a_listener_without_replicas_is_told() -> None:
    talk = Dialogue(listens=True)
    talk.say(said.JoinCalled(JOIN))
    talk.say(said.MembersKnown(talk.only(done.FollowAll).watch))
    assert talk.answer is False
    assert not talk.all(done.DeclareToken)


def test_what_differs_is_exchanged_both_ways() -> None:
    talk, _ = writer(B)
    talk.write("mine", 1, timeout=0)
    history = theirs(put(("theirs",), (WALL + 5, "bb"), 2))
    call = talk.call()
    talk.say(said.CompareCalled(call, 5.0))
    answer_all(talk, history)
    assert talk.only(done.Answer) == done.Answer(call, True)
    assert talk.core.history.root == history.root == {"first": 0, "mine": 1, "theirs": 2}


def test_a_comparison_in_vain_is_said() -> None:
    talk, _ = writer(B)
    talk.say(said.CompareCalled(talk.call(), 5.0))
    talk.say(said.QueryEnded(talk.only(done.SendQuery).number, None, failed=True))
    assert talk.answer is False
    talk.say(said.CompareCalled(talk.call(), 3.0))
    talk.sleep(3.0)
    assert talk.answer is False


def test_others_get_what_they_lack_and_are_asked_for_the_rest() -> None:
    talk, _ = writer(B)
    talk.say(said.SyncReceived(1, SyncRequest(b"\x01" * 9)))
    reply = talk.only(done.Reply).reply
    assert isinstance(reply, SyncReply)
    assert reply.digest == talk.core.history.digest()
    index = Index(list(range(64)), [("other", 5, "c0")])
    talk.say(said.SyncReceived(2, SyncRequest(index=index)))
    reply = talk.only(done.Reply).reply
    assert isinstance(reply, SyncReply)
    assert [record.path for record in reply.records] == ["first"]
    assert reply.wanted == ["other"]
    request = SyncRequest(records=[Record("other", 5, "c0", "x", [7])])
    talk.say(said.WritesReceived(3, request))
    assert talk.core.history.root["other"] == 7
    assert talk.only(done.Reply)


@pytest.mark.parametrize("bad", [Record("a//b", 5, "c", "x", [1]), Record("a", -1, "c", "x", [1])])
def test_damaged_writes_are_refused_and_logged_once(bad: Record) -> None:
    talk, _ = writer(B)
    talk.say(said.WritesReceived(3, SyncRequest(records=[bad])))
    assert isinstance(talk.only(done.Reply).reply, str)
    assert talk.only(done.Log).once
    talk.say(said.SyncReceived(4, SyncRequest(index=Index([1], [("a//b", 1, "c")]))))
    assert isinstance(talk.only(done.Reply).reply, str)
    assert talk.core.history.root == {"first": 0}


def test_damaged_replies_count_as_one_kind_whoever_sends_them() -> None:
    talk, _ = writer(B, C)
    lines: list[done.Log] = []
    talk.say(said.CompareCalled(talk.call(), 5.0))
    for query in talk.all(done.SendQuery):
        talk.say(
            said.QueryEnded(query.number, SyncReply(records=[Record("a//b", 5, "c", "x", [1])]))
        )
        lines.append(talk.only(done.Log))
    assert len({line.text for line in lines}) == 2
    assert len({line.once for line in lines}) == 1


def test_deletions_that_another_one_has_forgotten_are_followed() -> None:
    talk, _ = writer(B)
    talk.say(said.BatchReceived("bb", 1, batch("old", 1, 5)))
    talk.say(said.CompareCalled(talk.call(), 5.0))
    history = theirs(*talk.core.history.writes())
    history.apply([put(("old",), (WALL, "bb"), DELETED)])
    assert history.forget(0) == 1
    records = [Record.of(write) for write in history.writes()]
    reply = SyncReply(history.digest(), True, records, whole=True, horizon=history.horizon)
    talk.say(said.QueryEnded(talk.only(done.SendQuery).number, reply))
    assert "old" not in talk.core.history.root
    assert talk.core.history.horizon == WALL
    talk.say(said.BatchReceived("bb", 2, batch("old", 1, 5)))
    assert "older than deletions" in talk.only(done.Acknowledge).reason
    assert not talk.core.may_defer(5, WALL)


def test_a_batch_outside_of_its_key_is_refused() -> None:
    talk, _ = writer(B)
    talk.say(said.BatchReceived("bb", 1, batch("a/b", 1, WALL), reach=("c",)))
    assert talk.only(done.Acknowledge).reason
    assert talk.core.history.root == {"first": 0}


def test_the_oldest_seed_appoints_others_and_the_fourth_stops() -> None:
    talk, watch = writer()
    assert talk.core.is_seed
    talk.say(said.MemberCame(watch, D), said.MemberCame(watch, member("ee", 80)))
    talk.sleep(1.0)
    appointed = [zid for zid, request in requests(talk) if request.appoints]
    assert sorted(appointed) == ["dd", "ee"]
    assert talk.core.is_oldest_seed
    for other in (B, C, member("ff", 30)):
        talk.say(said.SeedCame(other), said.MemberCame(watch, other))
    talk.sleep(1.0)
    assert talk.all(done.UndeclareSeed)
    assert not talk.core.is_seed


def test_who_is_appointed_becomes_a_seed() -> None:
    talk = Dialogue()
    talk.join(B)
    talk.say(said.SyncReceived(1, SyncRequest(b"", appoints=True)))
    assert talk.all(done.DeclareSeed)
    assert talk.all(done.FollowAll)


def test_when_the_seeds_are_gone_some_replica_becomes_one() -> None:
    talk = Dialogue()
    talk.join(B)
    talk.say(said.SeedWent("bb"))
    talk.sleep(10.0)
    assert talk.all(done.DeclareSeed)


def test_anti_entropy_compares_with_a_seed() -> None:
    talk = Dialogue()
    talk.join(B, C)
    talk.sleep(0.1)
    answer_all(talk, theirs())
    talk.sleep(30.0)
    assert requests(talk)[0][0] in {"bb", "cc"}


def test_a_copy_of_a_core_goes_its_own_way() -> None:
    talk, _ = writer(B)
    twin = copy.deepcopy(talk)
    twin.write("a", 1)
    assert "a" not in talk.core.history.root
    twin.say(said.Acknowledged("bb", twin.core._deliveries.newest))
    assert twin.answer.holders == 1
    talk.write("a", 2)
    assert twin.core.history.root["a"] == 1


def size(thing: object) -> int:
    """Return the number of objects that an object refers to, but for code."""
    seen: set[int] = set()
    rest = [thing]
    while rest:
        item = rest.pop()
        if id(item) not in seen and not isinstance(item, (type, FunctionType, ModuleType)):
            seen.add(id(item))
            rest += gc.get_referents(item)
            rest += item if isinstance(item, dict) else ()  # it names no keys that are texts
    return len(seen)


def test_a_core_keeps_nothing_of_replicas_that_come_and_go() -> None:
    """They write, do not acknowledge, refuse comparisons, and leave, or are killed."""
    talk, watch = writer(B)
    sizes: list[int] = []
    for generation in range(1, 5):
        for number in range(150):
            other = member(f"{generation}e{number}", 100 + number)
            talk.say(said.MemberCame(watch, other))
            if number < 10:
                talk.say(said.SeedCame(other))
                talk.write("own", number, timeout=0.1)
                talk.sleep(0.3)
            for query in talk.all(done.SendQuery):
                talk.say(said.QueryEnded(query.number, None, failed=True))
            stamp = WALL + int(talk.seconds * 1e9)
            talk.say(said.BatchReceived(other.zid, 1, batch("theirs", number, stamp, other.zid)))
            if number % 2:
                talk.say(said.MemberLeft(other.zid, returns=False))
            talk.say(said.SeedWent(other.zid), said.MemberWent(watch, other.zid))
        talk.say(said.BatchReceived("bb", 1, batch("theirs", 0, WALL + 10**13 + generation)))
        for _ in range(30):
            talk.sleep(1.0)
            for query in talk.all(done.SendQuery):
                talk.say(said.QueryEnded(query.number, SyncReply(talk.core.history.digest())))
        talk.timers = [entry for entry in talk.timers if entry[1].kind == "tick"]
        sizes.append(size(talk.core))
    assert len(set(sizes[1:])) == 1, sizes
