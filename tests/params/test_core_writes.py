"""Writing: what the core tells the writer, as conversations."""

from __future__ import annotations

import pytest

from rosz.errors import DecodeError, ParamError, PartlyWritten
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said
from rosz.params.writes import DELETED, Change

from .dialogue import WALL, Dialogue, batch, member, writer

B, C = member("bb"), member("cc", 20)


def test_who_is_alone_writes_at_once_and_is_told() -> None:
    talk = Dialogue()
    talk.join()
    talk.write("a/b", 1)
    assert talk.only(done.TreeChanged).new == {"a": {"b": 1}}
    assert talk.only(done.TreeChanged).own
    assert talk.answer.alone
    assert talk.answer.slow == ()
    assert not talk.all(done.Log)


def test_a_write_returns_when_all_have_acknowledged_it() -> None:
    talk, _ = writer(B, C)
    talk.write()
    number = talk.only(done.Publish).number
    talk.say(said.Acknowledged("bb", number))
    assert not talk.all(done.Answer)
    talk.say(said.Acknowledged("bb", number))
    assert not talk.all(done.Answer)
    talk.say(said.Acknowledged("cc", number))
    assert talk.answer.holders == 2
    assert talk.answer.slow == ()
    assert not talk.answer.alone


def test_who_writes_first_waits_until_all_are_known() -> None:
    talk = Dialogue()
    talk.join(B)
    talk.write()
    number = talk.only(done.Publish).number
    watch = talk.only(done.FollowAll).watch
    talk.say(said.MemberCame(watch, C), said.Acknowledged("bb", number))
    assert not talk.all(done.Answer)
    assert not talk.all(done.Resend)
    talk.say(said.MemberCame(watch, B), said.MembersKnown(watch))
    assert not talk.all(done.Answer)
    talk.say(said.Acknowledged("cc", number))
    assert talk.answer.holders == 2


def test_a_batch_is_sent_once_more_and_then_the_late_are_named() -> None:
    talk, _ = writer(B, C)
    talk.write()
    number = talk.only(done.Publish).number
    talk.say(said.Acknowledged("bb", number))
    talk.sleep(0.25)
    assert talk.only(done.FindStoppedPeers)
    talk.say(said.StoppedPeersFound(frozenset()))
    assert talk.only(done.Resend).zids == ("cc",)
    talk.sleep(1.74)
    assert not talk.all(done.Answer)
    talk.sleep(0.02)
    assert talk.answer.slow == ("process cc",)
    assert "'a' is" in talk.all(done.Log)[0].text.replace("/", "")
    talk.write("b")
    assert talk.only(done.Publish).patient
    talk.say(said.Acknowledged("bb", number + 1))
    assert talk.answer.slow == ("process cc",)
    assert not talk.all(done.Log)
    talk.say(said.Acknowledged("cc", number + 1))
    talk.write("c")
    talk.say(said.Acknowledged("bb", number + 2), said.Acknowledged("cc", number + 2))
    assert talk.answer.slow == ()


def test_a_timer_is_not_started_for_what_rounding_leaves() -> None:
    """Else it would be due at the same time, again and again."""
    talk, _ = writer(B)
    talk.seconds = 127.753
    due = talk.seconds + 0.25
    assert 0.25 - (due - talk.seconds) > 0
    assert due + (0.25 - (due - talk.seconds)) == due
    talk.write()
    talk.timers = [timer for timer in talk.timers if timer[1].kind == "delivery"]
    talk.sleep(0.25)
    assert talk.only(done.FindStoppedPeers)
    assert [timer.seconds for timer in talk.all(done.StartTimer)] == [pytest.approx(1.75)]


def test_who_is_stopped_is_not_sent_it_again_and_named_so() -> None:
    talk, _ = writer(B)
    talk.write(timeout=0.5)
    talk.sleep(0.25)
    talk.say(said.StoppedPeersFound(frozenset(["bb"])))
    assert not talk.all(done.Resend)
    talk.sleep(0.25)
    assert talk.answer.slow == ("process bb (stopped)",)
    assert talk.answer.holders == 0
    assert not talk.answer.alone


def test_what_is_not_kept_everywhere_is_said_and_stays() -> None:
    talk, _ = writer(B, C)
    talk.write()
    number = talk.only(done.Publish).number
    talk.say(said.Acknowledged("bb", number), said.Acknowledged("cc", number, "no space left"))
    assert isinstance(talk.answer, PartlyWritten)
    assert str(talk.answer) == "'/a' is written, but not kept at process cc: no space left"
    assert talk.answer.holders == 1
    assert talk.core.history.root["a"] == 1
    assert not talk.all(done.Publish)


def test_what_the_tree_cannot_hold_is_written_nowhere() -> None:
    talk, _ = writer(B)
    bad: list[list[Change]] = [[((), 5)], [(("a",), 1), (("x",) * 1000, 1)]]
    for changes in bad:
        talk.say(said.WriteCalled(talk.call(), changes, "me", (WALL, "aa")))
        assert isinstance(talk.answer, ParamError)
        assert len(talk.done) == 1
    talk.write("b", 1, given=True)
    far = WALL + 11 * 365 * 86_400 * 10**9
    talk.say(said.WriteCalled(talk.call(), [(("a",), 1)], "me", (far, "cc"), given=True))
    assert isinstance(talk.answer, DecodeError)
    assert len(talk.done) == 1


def test_own_stamps_are_later_than_all_seen() -> None:
    talk, _ = writer(B)
    ahead = WALL + 3600 * 10**9
    talk.say(said.BatchReceived("bb", 1, batch("a", "theirs", ahead)))
    assert talk.only(done.Acknowledge).reason == ""
    talk.write("a", "mine")
    assert talk.only(done.Publish).batch.time == ahead + 1
    assert talk.core.history.root["a"] == "mine"


def test_nobody_waits_for_one_that_leaves() -> None:
    talk, watch = writer(B, C)
    talk.write()
    number = talk.only(done.Publish).number
    talk.say(said.Acknowledged("bb", number), said.MemberLeft("cc"))
    assert not talk.all(done.Answer)
    talk.say(said.SeedWent("cc"), said.MemberWent(watch, "cc"))
    assert talk.answer.holders == 1
    assert talk.answer.slow == ()


def test_nobody_waits_for_one_that_crashes_while_others_are_there() -> None:
    talk, watch = writer(B, C)
    talk.write()
    number = talk.only(done.Publish).number
    talk.say(said.Acknowledged("bb", number), said.SeedWent("cc"), said.MemberWent(watch, "cc"))
    assert talk.answer.holders == 1
    assert talk.answer.slow == ()


def test_who_lost_all_waits_within_its_limit_and_says_so_once() -> None:
    talk, watch = writer(B)
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.write("a")
    assert not talk.all(done.Answer)
    talk.sleep(2.0)
    assert talk.answer.alone
    assert talk.answer.slow == ("process bb (link lost)",)
    assert sum("only this process has" in line.text for line in talk.all(done.Log)) == 1
    talk.write("b")
    assert talk.answer.alone
    assert not talk.all(done.Log)
    talk.sleep(10.0)
    talk.write("c")
    assert talk.answer.alone
    assert talk.answer.slow == ()
    assert not talk.all(done.Log)


def test_one_that_lags_and_is_lost_is_named_once() -> None:
    talk, watch = writer(B)
    talk.write("a", timeout=0.3)
    talk.write("b")
    talk.sleep(0.4)
    assert talk.answer.slow == ("process bb",)
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.sleep(2.0)
    assert talk.answer.slow == ("process bb (link lost)",)


def test_one_that_lagged_before_it_is_lost_is_named_once() -> None:
    talk, watch = writer(B, C)
    talk.write("a", timeout=0.3)
    talk.say(said.Acknowledged("cc", talk.only(done.Publish).number))
    talk.sleep(0.4)
    assert talk.answer.slow == ("process bb",)
    talk.write("b")
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.say(said.SeedWent("cc"), said.MemberWent(watch, "cc"))
    talk.sleep(2.0)
    assert talk.answer.slow == ("process bb (link lost)", "process cc (link lost)")


def test_who_saw_all_others_leave_is_alone_without_ado() -> None:
    talk, watch = writer(B)
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.write("a")
    talk.say(said.MemberLeft("bb"))  # it may be heard of later than the end of its tokens
    assert talk.answer.alone
    assert not talk.all(done.Log)
    talk.write("b")
    assert talk.answer.alone
    assert not talk.all(done.Log)


def test_one_that_is_back_in_time_acknowledges() -> None:
    talk, watch = writer(B)
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.write("a")
    number = talk.only(done.Publish).number
    talk.sleep(0.5)
    talk.say(said.MemberCame(watch, B))
    assert talk.only(done.Resend).zids == ("bb",)
    talk.say(said.Acknowledged("bb", number))
    assert talk.answer.holders == 1
    assert talk.answer.slow == ()
    assert not talk.answer.alone


def test_a_core_that_restarts_is_waited_for_under_its_new_session() -> None:
    talk, watch = writer(B, C)
    talk.say(said.MemberLeft("bb", returns=True))
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.write("a")
    number = talk.only(done.Publish).number
    talk.say(said.Acknowledged("cc", number))
    assert not talk.all(done.Answer)
    again = member("dd", 60)
    again = type(again)(again.start, "dd", B.label)
    talk.say(said.MemberCame(watch, again))
    assert talk.only(done.Resend).zids == ("dd",)
    talk.say(said.Acknowledged("dd", number))
    assert talk.answer.holders == 2


def test_one_that_is_back_is_not_taken_for_an_earlier_life() -> None:
    """Two lives of a program were lost: what expires later is neither of them, if one is back."""
    talk, watch = writer(B)
    second = type(B)(30, "b2", B.label)
    talk.say(said.MemberCame(watch, second))
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.say(said.MemberWent(watch, "b2"))
    talk.sleep(8.5)
    talk.say(said.MemberCame(watch, second))
    talk.write("a", timeout=5.0)
    talk.sleep(3.0)
    assert not talk.all(done.Answer)
    talk.sleep(2.0)
    assert talk.answer.slow == (B.label,)


def test_who_stood_still_waits_for_those_whose_links_are_gone() -> None:
    talk, watch = writer(B, C)
    talk.stand_still(11.0)
    talk.write("a")
    number = talk.only(done.Publish).number
    assert talk.core._members.recovering
    talk.say(said.Acknowledged("bb", number), said.SeedWent("cc"), said.MemberWent(watch, "cc"))
    assert not talk.all(done.Answer)
    talk.sleep(2.0)
    assert talk.answer.slow == ("process cc (link lost)",)
    talk.write("b")
    talk.say(said.Acknowledged("bb", number + 1))
    assert talk.answer.slow == ("process cc (link lost)",)
    talk.sleep(10.0)
    assert not talk.core._members.recovering
    talk.write("c")
    talk.say(said.Acknowledged("bb", number + 2))
    assert talk.answer.slow == ()


@pytest.mark.parametrize("timeout", [0.0, -1.0])
def test_who_does_not_wait_is_told_nothing(timeout: float) -> None:
    talk, _ = writer(B)
    talk.write(timeout=timeout)
    assert talk.answer.holders == 0
    assert talk.answer.slow == ()
    assert not talk.answer.alone
    assert not talk.all(done.StartTimer)


def test_the_end_hands_over_what_nobody_else_has() -> None:
    talk, _ = writer(B, C)
    talk.write("a", timeout=0)
    talk.say(said.CloseCalled(talk.call()))
    query = talk.only(done.SendQuery)
    talk.say(said.QueryEnded(query.number, None, failed=True))
    query = talk.only(done.SendQuery)
    assert query.zid == "cc"
    talk.say(said.Acknowledged("cc", talk.core._deliveries.newest))
    assert [type(effect) for effect in talk.done[-2:]] == [done.Leave, done.Answer]
    assert not talk.all(done.Log)


def test_the_end_says_what_is_lost() -> None:
    talk, watch = writer(B)
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.write("a", timeout=0)
    talk.write("b", timeout=0)
    talk.say(said.CloseCalled(talk.call()))
    assert not talk.all(done.Answer)
    talk.sleep(1.0)
    assert talk.only(done.Leave)
    assert "'/a' and 1 more is lost with this process" in talk.all(done.Log)[-1].text


def test_what_another_replaced_is_not_lost_at_the_end() -> None:
    talk, watch = writer()
    talk.say(said.SeedCame(B), said.MemberCame(watch, B))  # who takes it unacknowledged
    deletion = batch("first", DELETED, WALL + int(talk.seconds * 1e9) + 1)
    talk.say(said.BatchReceived("bb", 1, deletion))
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.say(said.CloseCalled(talk.call()))
    assert talk.only(done.Leave)
    assert not talk.all(done.Log)


@pytest.mark.parametrize("others", [(), (B,)])
def test_the_end_of_one_that_was_heard_is_at_once(others: tuple[object, ...]) -> None:
    talk, _ = writer(*others)  # type: ignore[arg-type]
    talk.say(said.CloseCalled(talk.call()))
    assert talk.only(done.Leave)
    assert not talk.all(done.Log)


def test_the_end_says_what_is_lost_if_others_left_long_after_one_was_lost() -> None:
    talk, watch = writer(B, C)
    talk.say(said.SeedWent("bb"), said.MemberWent(watch, "bb"))
    talk.sleep(30.0)
    talk.say(said.MemberLeft("cc"), said.SeedWent("cc"), said.MemberWent(watch, "cc"))
    talk.write("a")
    assert talk.answer.alone
    assert "only this process has '/a'" in talk.only(done.Log).text
    talk.say(said.CloseCalled(talk.call()))
    talk.sleep(1.0)
    assert "'/a' is lost with this process" in talk.all(done.Log)[-1].text
