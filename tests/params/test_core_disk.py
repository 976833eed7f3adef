"""The disk of a replica, as conversations."""

from __future__ import annotations

from rosz.errors import PartlyWritten
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said
from rosz.params.writes import DELETED, put

from .dialogue import WALL, Dialogue, batch, member, writer

B = member("bb")


def keeper() -> Dialogue:
    talk = Dialogue(stored=True)
    talk.say(said.Loaded([put(("old",), (5, "c0"), 1)]))
    talk.join(B)
    return talk


def test_a_batch_is_acknowledged_when_it_is_on_the_disk() -> None:
    talk = keeper()
    assert talk.core.history.root == {"old": 1}
    talk.say(said.BatchReceived("bb", 7, batch("a", 1, WALL)))
    assert not talk.all(done.Acknowledge)
    save = talk.only(done.Save)
    talk.say(said.BatchReceived("bb", 7, batch("a", 1, WALL), query=3))
    assert not talk.done
    talk.say(said.Saved(save.number))
    assert [(ack.number, ack.query) for ack in talk.all(done.Acknowledge)] == [(7, 0), (7, 3)]


def test_a_full_disk_is_the_reason_that_the_writer_is_told() -> None:
    talk = keeper()
    for number in range(1, 4):
        talk.say(said.BatchReceived("bb", number, batch("a", number, WALL + number)))
        save = talk.only(done.Save)
        assert [write.time for write in save.writes] == [WALL + number] * 1 or number > 1
        talk.say(said.Saved(save.number, "no space left"))
        assert talk.only(done.Acknowledge).reason == "no space left"
        assert len(talk.all(done.Log)) == (number == 1)
    assert talk.core.history.root == {"old": 1, "a": 3}
    talk.sleep(1.0)
    save = talk.only(done.Save)
    assert [write.value for write in save.writes] == [3]
    talk.say(said.Saved(save.number))
    assert "saved again" in talk.only(done.Log).text
    talk.say(said.BatchReceived("bb", 3, batch("a", 3, WALL + 3), query=1))
    assert talk.only(done.Acknowledge).reason == ""


def test_an_own_write_waits_for_the_disk_and_the_others_within_one_time() -> None:
    talk, _ = writer(stored=True)
    talk.say(said.Saved(talk.only(done.Save).number))
    talk.write("a")
    save = talk.only(done.Save)
    assert not talk.all(done.Answer)
    talk.sleep(2.0)
    assert talk.answer.slow == ("the file of me",)
    talk.say(said.Saved(save.number))
    talk.write("b")
    talk.say(said.Saved(talk.only(done.Save).number, "no space left"))
    assert isinstance(talk.answer, PartlyWritten)
    assert str(talk.answer) == "'/b' is written, but not kept at me: no space left"
    assert talk.core.history.root["b"] == 1


def test_a_compaction_that_fails_is_done_again() -> None:
    talk = Dialogue(stored=True)
    talk.say(said.Loaded([put(("old",), (5, "c0"), 1)], 3, changed=True))
    compact = talk.only(done.Compact)
    assert compact.horizon == 3
    talk.join()
    talk.say(said.Saved(compact.number, "no space left"))
    talk.sleep(1.0)
    again = talk.only(done.Compact)
    assert again.writes == compact.writes
    talk.say(said.Saved(again.number))
    assert "saved again" in talk.only(done.Log).text


def test_stored_stamps_years_ahead_count_as_new() -> None:
    talk = Dialogue(stored=True)
    late = (1 << 62) - 1
    talk.say(said.Loaded([put(("a",), (late, "f0"), "kept"), put(("b",), (5, "f0"), 1)]))
    assert talk.core.history.root == {"a": "kept", "b": 1}
    assert talk.core.history.latest < WALL + 10**15
    assert len(talk.only(done.Compact).writes) == 2
    assert talk.only(done.Log).once


def test_a_compaction_that_failed_is_done_when_saving_works_again() -> None:
    """The file holds writes that the history has dropped, and that must not come back from it."""
    talk = Dialogue(stored=True)
    talk.say(said.Loaded([put(("old",), (5, "c0"), 1)], 3, changed=True))
    compact = talk.only(done.Compact)
    talk.join()
    talk.say(said.Saved(compact.number, "no space left"))
    talk.write("a", timeout=0)
    save = talk.only(done.Save)
    assert [write.path for write in save.writes] == [("old",), ("a",)]
    talk.say(said.Saved(save.number))
    talk.sleep(1.0)
    assert talk.only(done.Compact).horizon == 3
    talk.say(said.Saved(talk.only(done.Compact).number))
    talk.sleep(3.0)
    assert not talk.all(done.Compact)


def test_nothing_is_acknowledged_while_what_failed_is_saved_again() -> None:
    talk = keeper()
    talk.say(said.BatchReceived("bb", 1, batch("a", 1, WALL)))
    first = talk.only(done.Save)
    talk.say(said.BatchReceived("bb", 2, batch("b", 2, WALL + 1)))
    second = talk.only(done.Save)
    talk.say(said.BatchReceived("bb", 1, batch("a", 1, WALL), query=9))
    talk.say(said.Saved(first.number, "no space left"))
    assert talk.only(done.Acknowledge).number == 1
    talk.say(said.BatchReceived("bb", 3, batch("c", 3, WALL + 2)))
    third = talk.only(done.Save)
    assert [write.path for write in third.writes] == [("a",), ("c",)]
    talk.say(said.Saved(second.number))
    assert not talk.all(done.Acknowledge)
    talk.say(said.Saved(third.number))
    acknowledged = [(ack.number, ack.query, ack.reason) for ack in talk.all(done.Acknowledge)]
    assert acknowledged == [(2, 0, ""), (1, 9, ""), (3, 0, "")]


def test_of_a_dict_before_the_horizon_only_what_is_proven_is_saved() -> None:
    talk = Dialogue(stored=True)
    talk.say(said.Loaded([put(("m",), (WALL, "c0"), {"x": 1})], horizon=WALL + 9))
    talk.join(B)
    talk.say(said.BatchReceived("bb", 1, batch("m", {"x": 2, "y": "perhaps deleted"}, WALL + 5)))
    save = talk.only(done.Save)
    assert [(write.path, write.value) for write in save.writes] == [(("m",), DELETED)]
    assert talk.core.history.find(("m",)) == save.writes[0]
    assert talk.core.history.root == {}
