"""XML-RPC as bytes: what the standard library says is understood, and damage is one error."""

from __future__ import annotations

import datetime as dt
import xmlrpc.client
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz.bridges.ros1.calls import (
    CallReader,
    decode_result,
    encode_call,
    encode_fault,
    encode_result,
)
from rosz.errors import DecodeError, EncodeError

_NUMBERS = st.integers(-(2**31), 2**31 - 1)
_TEXT = st.text(st.characters(min_codepoint=32, exclude_categories=["Cs"], exclude_characters="￾￿"))
_VALUES = st.recursive(
    st.booleans() | _NUMBERS | st.floats(allow_nan=False) | _TEXT | st.binary(max_size=50),
    lambda values: st.lists(values, max_size=4) | st.dictionaries(_TEXT, values, max_size=4),
    max_leaves=12,
)


def _post(body: bytes, *fields: str) -> bytes:
    lines = ["POST / HTTP/1.1", f"Content-Length: {len(body)}", *fields, "", ""]
    return "\r\n".join(lines).encode() + body


@given(st.lists(_VALUES, max_size=4), st.integers(1, 500))
def test_calls_come_out_of_any_pieces(args: list[Any], step: int) -> None:
    data = encode_call("host:1", "/path", "method", tuple(args)) * 2
    reader, calls = CallReader(), []
    for begin in range(0, len(data), step):
        calls += list(reader.feed(data[begin : begin + step]))
    assert [(call.path, call.method, list(call.args)) for call in calls] == [
        ("/path", "method", args)
    ] * 2


@given(_VALUES)
def test_results_are_those_of_the_standard_library(value: Any) -> None:
    _, _, body = encode_result(value).partition(b"\r\n\r\n")
    (known,), _ = xmlrpc.client.loads(body, use_builtin_types=True)
    assert decode_result(body) == known == value


def test_a_call_tells_whether_its_connection_stays() -> None:
    body = xmlrpc.client.dumps((), "getUri").encode()
    (kept,) = CallReader().feed(_post(body))
    (closed,) = CallReader().feed(_post(body, "Connection: close"))
    (old,) = CallReader().feed(_post(body).replace(b"HTTP/1.1", b"HTTP/1.0"))
    assert (kept.keep_alive, closed.keep_alive, old.keep_alive) == (True, False, False)


def test_timestamps_and_bytes_are_values() -> None:
    values = (dt.datetime(2020, 1, 2, 3, 4, 5), b"\0\1")  # noqa: DTZ001  # XML-RPC has no zone
    (call,) = CallReader().feed(encode_call("host", "/", "method", values))
    assert call.args == values


@pytest.mark.parametrize("value", [2**31, -(2**31) - 1, None, {1: 2}])
def test_values_that_xml_rpc_lacks_are_refused(value: Any) -> None:
    with pytest.raises(EncodeError):
        encode_result([value])


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"GET / HTTP/1.1\r\n\r\n", "expected 'POST path HTTP/1.1'"),
        (b"POST / HTTP/1.1\r\n\r\n", "Content-length is ''"),
        (b"POST / HTTP/1.1\r\nContent-length: 99999999999999\r\n\r\n", "expected a number up to"),
        (b"x" * 20_000, "no end of its head"),
        (_post(b"garbage"), "syntax error"),
        (_post(b"<params></params>"), "no methodName"),
        (_post(b"<a>" * 500), "nested too deeply"),
        (_post(b'<!DOCTYPE a [<!ENTITY b "c">]><a/>'), "document type is not allowed"),
        (_post('<!DOCTYPE a [<!ENTITY b "c">]><a/>'.encode("utf-16")), "document type"),
    ],
)
def test_what_is_not_a_call_is_refused(data: bytes, reason: str) -> None:
    with pytest.raises(DecodeError, match=reason):
        list(CallReader().feed(data))


_TAGS = st.sampled_from(
    (
        *("methodCall", "methodName", "methodResponse", "fault", "params", "param", "value"),
        *("array", "data", "struct", "member", "name", "int", "i4", "i8", "boolean", "double"),
        *("string", "base64", "dateTime.iso8601", "nil", "bigdecimal"),
    )
)


@given(st.lists(st.tuples(_TAGS, st.booleans(), st.sampled_from(["", "1", "x", "1e999"]))))
def test_any_document_is_a_call_or_one_error(parts: list[tuple[str, bool, str]]) -> None:
    inner = "".join(
        f"<{tag}>{text}</{tag}>" if whole else f"<{tag}><value>{text}</value></{tag}>"
        for tag, whole, text in parts
    )
    body = f"<methodCall>{inner}</methodCall>".encode()
    try:
        list(CallReader().feed(_post(body)))
        decode_result(body)
    except DecodeError:
        return


def test_faults_are_errors() -> None:
    _, _, body = encode_fault("broken").partition(b"\r\n\r\n")
    with pytest.raises(DecodeError, match="fault: broken"):
        decode_result(body)
