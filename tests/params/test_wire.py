from __future__ import annotations

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz.errors import DecodeError
from rosz.params.values import normalise
from rosz.params.wire import (
    Batch,
    ClientReply,
    ClientRequest,
    Index,
    Keys,
    Record,
    ReplicaMember,
    SyncReply,
    SyncRequest,
    add_header,
    decode,
    decode_value,
    encode,
    encode_value,
    read_digest,
    read_header,
)
from rosz.params.writes import DELETED, Write
from rosz.session import is_key_in

from .strategies import PATHS, VALUES, writes

KINDS: list[type[Any]] = [Batch, SyncRequest, SyncReply, ClientRequest, ClientReply]
KEYS = Keys(7)


@given(VALUES)
def test_values_survive_the_way(value: Any) -> None:
    again = decode_value(encode_value(value))
    assert again == value
    assert repr(again) == repr(value)


@given(writes())
def test_records_survive_the_way(batch: list[Write]) -> None:
    message = encode(SyncRequest(records=[Record.of(write) for write in batch]))
    assert [record.write() for record in decode(message, SyncRequest).records] == batch


@given(st.dictionaries(PATHS.filter(bool), st.one_of(st.just(DELETED), VALUES), max_size=5))
def test_batches_survive_the_way(changes: dict[Any, Any]) -> None:
    batch = Batch.of((5, "ab"), "me", changes.items())
    again = decode(encode(batch), Batch)
    found = {write.path: write for write in again.writes()}
    assert {path: write.value for path, write in found.items()} == changes
    assert all((w.time, w.clock, w.origin) == (5, "ab", "me") for w in found.values())


@given(st.sampled_from(KINDS), st.binary(max_size=60))
def test_any_bytes_are_a_message_or_the_named_error(kind: type[Any], data: bytes) -> None:
    try:
        message = decode(data, kind)
        if isinstance(message, Batch):
            message.writes()
        for record in getattr(message, "records", []):
            record.write()
    except DecodeError:
        return


JSON = st.recursive(
    st.one_of(
        st.none(), st.booleans(), st.integers(0, 1 << 64), st.floats(), st.text(), st.binary()
    ),
    lambda inner: st.one_of(
        st.lists(inner), st.dictionaries(st.one_of(st.text(), st.integers(0, 9)), inner)
    ),
    max_leaves=8,
)


@given(st.sampled_from(KINDS), JSON)
def test_any_msgpack_is_a_message_or_the_named_error(kind: type[Any], value: Any) -> None:
    try:
        data = msgspec.msgpack.encode(value)
    except (OverflowError, UnicodeEncodeError):
        return
    test_any_bytes_are_a_message_or_the_named_error.hypothesis.inner_test(kind, data)  # type: ignore[attr-defined]
    try:
        assert repr(normalise(decode_value(data))) == repr(decode_value(data))
    except DecodeError:
        return


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (Batch(0, "a", "", [("a", 1)]), "the time 0, expected one after"),
        (Batch(5, "a", "", [("a//b", 1)]), "'a//b', expected 'a//b'|expected"),
        (Batch(5, "a", "", [("", 1)]), "the root of all parameters is a dict"),
        (Batch(5, "a", "", [("a", None)]), "null is not a parameter value"),
        (Batch(5, "a", "", [("/".join("a" * 101), 1)]), "has 101 parts"),
        (Batch(5, "a", "", [("a" * 4096, 1)]), "'a{60}…' has more than 4096 bytes"),
        (Batch(5, "a", "", [("a" * 99, {"b" * 4000: 1})]), "more than 4096 bytes"),
    ],
)
def test_writes_that_mean_nothing_are_refused(message: Batch, reason: str) -> None:
    with pytest.raises(DecodeError, match=reason):
        decode(encode(message), Batch).writes()


@given(st.integers(0, (1 << 64) - 1), st.from_regex(r"[0-9a-f]{1,32}", fullmatch=True))
def test_seals_survive_the_way(number: int, sender: str) -> None:
    data = add_header(sender, number, b"rest")
    found, again, start = read_header(data)
    assert (found, again, data[start:]) == (sender, number, b"rest")


@given(st.binary(max_size=30))
def test_any_bytes_are_sealed_or_the_named_error(data: bytes) -> None:
    try:
        sender, _, start = read_header(data)
    except DecodeError:
        return
    assert sender.isalnum()
    assert start <= len(data)


def test_values_nested_without_end_are_refused() -> None:
    with pytest.raises(DecodeError):
        decode_value(b"\x91" * 100_000 + b"\x01")
    with pytest.raises(DecodeError, match="extension 9 is unknown"):
        decode_value(msgspec.msgpack.encode(msgspec.msgpack.Ext(9, b"")))
    with pytest.raises(DecodeError, match="parameter value"):
        decode_value(msgspec.msgpack.encode(msgspec.msgpack.Ext(1, b"never")))


def test_an_index_is_small() -> None:
    index = Index([1], [("a/b", 1_700_000_000_000_000_000, "0123456789abcdef0123456789abcdef")])
    assert len(encode(SyncRequest(index=index))) < 70


def test_keys_of_a_domain() -> None:
    assert KEYS.change == "@rosz/7/change"
    assert KEYS.all_params == "@rosz/7/param/**"
    assert KEYS.param(()) == "@rosz/7/param"
    assert KEYS.param(("a", "*")) == "@rosz/7/param/a/%2A"
    assert KEYS.of("f0", "ask") == "@rosz/7/store/f0/ask"
    for path in [(), ("a",), ("a b", "ü/"[:-1], "%")]:
        assert KEYS.path(KEYS.param(path)) == path
    for key in ("@rosz/7/params/a", "@rosz/8/param/a", "@rosz/7/param/a/"):
        with pytest.raises(DecodeError):
            KEYS.path(key)


def test_tokens_carry_the_replica() -> None:
    member = ReplicaMember(12, "f0", "odd/*name (pid 3 on host)")
    assert KEYS.member(KEYS.token(member)) == member
    assert KEYS.member(KEYS.token(ReplicaMember(12, "f0", ""))).label == "-"
    assert ReplicaMember(1, "ff", "x") < ReplicaMember(2, "00", "x")
    for token in ("@rosz/7/replica/f0", "@rosz/7/replica/f0/x/y", "@rosz/8/replica/f0/1/y", "a"):
        with pytest.raises(DecodeError):
            KEYS.member(token)


@pytest.mark.parametrize(
    ("expression", "key", "expected"),
    [
        ("a/b", "a/b", True),
        ("a/b", "a/c", False),
        ("a/*", "a/b", True),
        ("a/*", "a/b/c", False),
        ("a/*", "a", False),
        ("a/**", "a", True),
        ("a/**", "a/b/c", True),
        ("**", "a/b", True),
        ("a/**/d", "a/b/c/d", True),
        ("a/**/d", "a/d", True),
        ("a/**/d", "a/b/c", False),
        ("**/b/**/d", "a/b/c/b/d", True),
        ("a/b$*", "a/bcd", True),
        ("a/$*c$*", "a/bcd", True),
        ("a/b$*", "a/cb", False),
        ("a/b/c", "a/b", False),
        ("a", "a/b", False),
    ],
)
def test_key_expressions(expression: str, key: str, expected: bool) -> None:
    assert is_key_in(expression, key) is expected


@pytest.mark.parametrize("content", [b"x", b"\x40" + bytes(8)])
def test_what_is_no_digest_is_refused(content: bytes) -> None:
    with pytest.raises(DecodeError, match="digest at byte 0: "):
        read_digest(content)
