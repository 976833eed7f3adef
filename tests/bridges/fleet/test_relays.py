"""What passes from one session to another: the ids of publishers, and limits of rates."""

from __future__ import annotations

import time
from threading import Timer
from types import SimpleNamespace
from typing import Any, cast

import pytest

from rosz.bridges.fleet import FleetPlan
from rosz.bridges.fleet.crossing import _Direction
from rosz.bridges.fleet.relays import _DEEPEST, Edit, Ids, TopicRelay
from rosz.graph import View
from rosz.qos import QoS
from rosz.wire import Kind, Token, pack_attachment, read_attachment

HERE, THERE = bytes(16), bytes(range(16))


def test_a_sample_waits_for_the_token_of_its_publisher() -> None:
    ids = Ids()
    timer = Timer(0.05, ids.add, (HERE, THERE))
    timer.start()
    assert ids.find(HERE) == THERE
    timer.join()


def test_samples_of_a_publisher_that_has_gone_keep_its_id() -> None:
    ids = Ids()
    ids.add(HERE, THERE)
    ids.remove(HERE)
    assert ids.find(HERE) == THERE
    ids.add(HERE, THERE)
    assert ids.find(HERE) == THERE


def test_only_the_first_sample_of_a_publisher_without_token_waits() -> None:
    ids = Ids()
    assert ids.find(HERE) is None
    began = time.monotonic()
    for _ in range(1000):
        assert ids.find(HERE) is None
    assert time.monotonic() - began < 100  # 2000 s if each waited


def test_a_session_is_found_however_many_came_and_went_since() -> None:
    tokens = [Token(0, f"{number:032x}", 0, 0, Kind.NODE, "/", "a") for number in range(10_001)]
    side: Any = SimpleNamespace(graph=SimpleNamespace(known=lambda: View(tokens[:1])))
    direction = _Direction(side, side, FleetPlan(prefix="/robot1"), outward=True)
    first, *_ = (direction.mirrored(token) for token in tokens)
    assert first is not None
    assert direction.source_ids(f"key/{first.zid}/*") == f"key/{tokens[0].zid}/*"


class Wire:
    """A session: what it sends is kept, and nothing arrives."""

    def __init__(self) -> None:
        self.sent: list[bytes | None] = []

    def publisher(self, _key: str, **_options: Any) -> Any:
        return self

    def pull_subscriber(self, *_words: Any, **_options: Any) -> Any:
        return self

    def receive(self) -> None:
        return None

    def forward(self, _sample: Any, _payload: Any, attachment: bytes | None) -> None:
        self.sent.append(attachment)

    def close(self) -> None:
        pass


@pytest.mark.parametrize("attachment", [None, b"what another program sends"])
def test_a_limit_lets_samples_without_attachment_pass(
    attachment: bytes | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 100.0
    clock = SimpleNamespace(monotonic=lambda: now)
    monkeypatch.setattr("rosz.bridges.fleet.relays.time", clock)
    wire: Any = Wire()
    relay = TopicRelay(wire, "a", wire, "b", qos=QoS(), rate=2, edit=Edit(Ids()))
    sample: Any = SimpleNamespace(attachment=attachment)
    for _ in range(8):  # two seconds of four samples each
        relay._pass(sample)
        now += 0.25
    assert wire.sent == [attachment] * 4
    numbered: Any = SimpleNamespace(attachment=pack_attachment(7, 0, HERE))
    for _ in range(4):
        relay._pass(numbered)
        now += 0.25
    assert wire.sent[4:] == [pack_attachment(number, 0, HERE) for number in (7, 8)]
    relay.close()


def test_a_limit_remembers_publishers_that_send(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many others came and went: its numbers stay without gaps."""
    now = 100.0
    clock = SimpleNamespace(monotonic=lambda: now)
    monkeypatch.setattr("rosz.bridges.fleet.relays.time", clock)
    wire: Any = Wire()
    ids: Any = SimpleNamespace(find=lambda _gid: None)  # waits for no token
    relay = TopicRelay(wire, "a", wire, "b", qos=QoS(), rate=1, edit=Edit(ids))
    for number in range(1, 3 * _DEEPEST):
        attachments = [pack_attachment(number, 0, HERE)]
        attachments.append(pack_attachment(1, 0, number.to_bytes(16, "big")[::-1]))
        for attachment in attachments:
            relay._pass(cast("Any", SimpleNamespace(attachment=attachment)))
        now += 0.75
    own = [read_attachment(sent)[0] for sent in wire.sent if read_attachment(sent)[2] == HERE]
    assert own == list(range(1, 1 + len(own)))
    assert len(own) > _DEEPEST
    relay.close()
