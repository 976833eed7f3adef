"""Every field of every type in our MCAP, as mcap with mcap-ros2-support and as rosbags read it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

import rosz.bags
from bags.messages import MESSAGES
from rosz.message import Message, slots

STAMP = 1_700_000_000_000_000_000


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bags") / "all.mcap"
    with rosz.bags.open(path, "w", compression="zstd") as output:
        for number, (topic, message) in enumerate(MESSAGES.items()):
            output.write(topic, message, STAMP + number)
    return path


def differences(ours: Any, theirs: Any, place: str = "") -> list[str]:
    """Return the places at which a value differs from ours."""
    if isinstance(ours, Message):
        parts = [
            differences(
                getattr(ours, slot.name), getattr(theirs, slot.name), f"{place}.{slot.name}"
            )
            for slot in slots(type(ours))
        ]
        return [one for part in parts for one in part]
    if isinstance(ours, str | int | float):
        return [] if ours == theirs else [f"{place}: {ours!r} and {theirs!r}"]
    mine, others = list(ours), list(theirs)
    if len(mine) != len(others):
        return [f"{place}: {len(mine)} and {len(others)} elements"]
    pairs = enumerate(zip(mine, others, strict=True))
    return [one for number, pair in pairs for one in differences(*pair, f"{place}[{number}]")]


def test_mcap_reads_every_field(bag: Path) -> None:
    with bag.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        rows = [
            (row.channel.topic, row.message.log_time, row.decoded_message)
            for row in reader.iter_decoded_messages()
        ]
    assert [row[:2] for row in rows] == [(t, STAMP + n) for n, t in enumerate(MESSAGES)]
    assert [
        one for topic, _, theirs in rows for one in differences(MESSAGES[topic], theirs, topic)
    ] == []


def test_rosbags_reads_every_field(bag: Path) -> None:
    with AnyReader([bag]) as reader:
        rows = [
            (connection.topic, stamp, reader.deserialize(data, connection.msgtype))
            for connection, stamp, data in reader.messages()
        ]
    assert [row[:2] for row in rows] == [(t, STAMP + n) for n, t in enumerate(MESSAGES)]
    assert [
        one for topic, _, theirs in rows for one in differences(MESSAGES[topic], theirs, topic)
    ] == []
