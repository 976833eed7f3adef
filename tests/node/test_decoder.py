"""Decoding where samples come twice: live, and from the cache of their publisher."""

from __future__ import annotations

import logging
from types import SimpleNamespace
from typing import Any

import pytest

from rosz.node.decoder import Received, SampleDecoder
from rosz.session import Reply, Sample
from rosz.wire import pack_attachment

GID = bytes(range(16))


class _Bytes(bytes):
    def to_bytes(self, *_: Any, **__: Any) -> bytes:
        return bytes(self)


def _sample(sequence: int, *, replayed: bool) -> Sample:
    raw: Any = SimpleNamespace(
        payload=_Bytes(str(sequence).encode()),
        attachment=_Bytes(pack_attachment(sequence, 0, GID)),
    )
    return Reply(SimpleNamespace(ok=raw)) if replayed else Sample(raw)  # type: ignore[arg-type]


def _decoder(counted: list[int]) -> SampleDecoder:
    return SampleDecoder(
        "/map",
        "std_msgs/msg/String",
        "",
        None,
        logging.getLogger(),
        counted.append,
        message_type=None,
        with_info=True,
    )


def _decode(decoder: SampleDecoder, samples: str) -> list[Received | None]:
    return [
        decoder.decode(_sample(int(one.lstrip("r")), replayed=one[0] == "r"))
        for one in samples.split()
    ]


@pytest.mark.parametrize(
    ("samples", "messages", "lost"),
    [
        ("1 2 3", "1 2 3", 0),
        ("1 4 5", "1 4 5", 2),
        ("r3 3 4", "3 4", 0),
        ("1 2 r2 3", "1 2 3", 0),
        ("r2 r3 2 3 4", "2 3 4", 0),
        ("r3 5 6", "3 5 6", 1),
        # A replay that has overtaken live samples takes nothing away; the newest comes last.
        ("r3 1 2 3 4", "3 1 2 3 4", 0),
        ("1 r4 2 3 4 5", "1 4 2 3 4 5", 0),
        ("1 r4 3 4 5", "1 4 3 4 5", 1),
        # The link was cut, and nothing of what was sent meanwhile comes live.
        ("1 2 r7 8 9", "1 2 7 8 9", 4),
        ("1 2 r7 r7 10", "1 2 7 10", 6),
    ],
)
def test_replays_and_live_samples_make_one_sequence(samples: str, messages: str, lost: int) -> None:
    counted: list[int] = []
    decoder = _decoder(counted)
    decoder.expect_replay(GID)
    found = _decode(decoder, samples)
    assert " ".join(one[0].decode() for one in found if one) == messages
    assert sum(counted) == lost
    assert sum(one[1].lost for one in found if one and one[1]) == lost


@pytest.mark.parametrize(
    ("samples", "messages"),
    [
        ("3 4 r2 r3 r4 5", "3 4 2 5"),
        ("3 r1 r2 r3 r1 r2 4", "3 1 2 4"),
        ("r1 r2 3 r1 r2 r3 4", "1 2 3 4"),
        ("3 r2 r4 r5 4 5 6", "3 2 4 5 6"),
    ],
)
@pytest.mark.parametrize("told", [0, 1])
def test_events_that_come_after_newer_ones_come_once(
    samples: str, messages: str, told: int
) -> None:
    """A live sample may come before the publisher is known, and before what was kept."""
    decoder = _decoder([])
    live, *others = samples.split(" ", told)
    found = _decode(decoder, live) if told else []
    decoder.expect_replay(GID, events=True)
    found += _decode(decoder, *others) if told else _decode(decoder, samples)
    assert " ".join(one[0].decode() for one in found if one) == messages


def test_a_replay_that_was_requested_of_another_publisher_comes_once() -> None:
    found = _decode(_decoder([]), "r3 r3 4 r4 5")
    assert " ".join(one[0].decode() for one in found if one) == "3 4 5"
