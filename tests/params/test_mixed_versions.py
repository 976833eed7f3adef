"""Messages of the version before the core of pure steps, as bytes that it sent."""

from __future__ import annotations

import datetime as dt
from typing import Any

import msgspec
import pytest

from rosz.params.wire import (
    Batch,
    ClientReply,
    ClientRequest,
    Departure,
    Index,
    Record,
    SyncReply,
    SyncRequest,
    add_header,
    decode,
    encode,
    read_header,
)
from rosz.params.writes import DELETED

RECORDED = {
    "BATCH": (
        "0300000000000000046630613195cf18e91efd5bd3807ba466306131d9222f74616c6b657220286e"
        "6f64652e707920287069642037206f6e20726f626f7429299292a3612f6282a17801a17994cb4004"
        "000000000000a174c40172c392a47768656ec70a02323032362d30312d303291a4676f6e65"
    ),
    "DIGEST_REQUEST": (
        "84a6646967657374c409010101010101010101a7686f72697a6f6e04a673656e646572a466306131"
        "a86170706f696e7473c3"
    ),
    "INDEX_REQUEST": "82a5696e6465789292013f9193a3612f6205a26630a673656e646572a466306131",
    "TELL": "81a77265636f7264739295a3612f6205a26630a1789181a1630195a4676f6e6506a26630a17890",
    "REPLY": (
        "86a6646967657374c409020202020202020202a57265616479c2a77265636f7264739295a3612f62"
        "05a26630a1789181a1630195a4676f6e6506a26630a17890a677616e74656492a161a3712f72a577"
        "686f6c65c3a7686f72697a6f6e09"
    ),
    "SET": (
        "83a476657262a57772697465a5626174636895cf18e91efd5bd3807ba466306131d9222f74616c6b"
        "657220286e6f64652e707920287069642037206f6e20726f626f7429299292a3612f6282a17801a1"
        "7994cb4004000000000000a174c40172c392a47768656ec70a02323032362d30312d303291a4676f"
        "6e65a774696d656f7574cb3ff8000000000000"
    ),
    "DONE": "81a4736c6f7791af6d6520287069642031206f6e207829",
    "REFUSED": "82a6737461747573a772656675736564a474657874a26e6f",
}
BATCH = Batch.of(
    (1_795_000_000_000_000_123, "f0a1"),
    "/talker (node.py (pid 7 on robot))",
    [
        (("a", "b"), {"x": 1, "y": [2.5, "t", b"r", True]}),
        (("when",), dt.date(2026, 1, 2)),
        (("gone",), DELETED),
    ],
)
RECORDS = [Record("a/b", 5, "f0", "x", [{"c": 1}]), Record("gone", 6, "f0", "x", [])]
MESSAGES: dict[str, msgspec.Struct] = {
    "DIGEST_REQUEST": SyncRequest(digest=b"\x01" * 9, horizon=4, sender="f0a1", appoints=True),
    "INDEX_REQUEST": SyncRequest(index=Index([1, 63], [("a/b", 5, "f0")]), sender="f0a1"),
    "TELL": SyncRequest(records=RECORDS),
    "REPLY": SyncReply(b"\x02" * 9, False, RECORDS, ["a", "q/r"], True, 9),
    "SET": ClientRequest("write", batch=BATCH, timeout=1.5),
    "DONE": ClientReply(slow=["me (pid 1 on x)"]),
    "REFUSED": ClientReply("refused", text="no"),
}


class EarlierReply(msgspec.Struct, omit_defaults=True):
    """A `ClientReply` as the earlier version knows it."""

    status: str = "ok"
    value: Any = None
    text: str = ""
    origin: str = ""
    slow: list[str] = []


@pytest.mark.parametrize("name", MESSAGES)
def test_messages_are_those_of_the_earlier_version(name: str) -> None:
    message, recorded = MESSAGES[name], bytes.fromhex(RECORDED[name])
    assert encode(message) == recorded
    assert type(decode(recorded, type(message))) is type(message)


def test_a_batch_is_that_of_the_earlier_version() -> None:
    recorded = bytes.fromhex(RECORDED["BATCH"])
    assert add_header("f0a1", 3, encode(BATCH)) == recorded
    sender, number, start = read_header(recorded)
    assert (sender, number) == ("f0a1", 3)
    received = decode(recorded[start:], Departure)
    assert received.kind == 0
    assert received.writes() == decode(encode(BATCH), Batch).writes()
    assert received.writes()[1].value == dt.date(2026, 1, 2)


def test_the_earlier_version_sees_a_batch_that_changes_nothing() -> None:
    departure = encode(Departure(5, "f0", "me", kind=Departure.RESTARTS))
    assert decode(departure, Batch).writes() == []
    assert decode(departure, Departure).kind == Departure.RESTARTS


def test_the_earlier_version_understands_that_a_write_is_not_kept() -> None:
    text = "'/a' is written, but not kept at x: full"
    reply = ClientReply("refused", text=text, reasons={"x": "full"}, holders=2, what="'/a'")
    earlier = msgspec.msgpack.Decoder(EarlierReply).decode(encode(reply))
    assert (earlier.status, earlier.text) == ("refused", text)
