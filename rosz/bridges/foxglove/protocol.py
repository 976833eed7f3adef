"""The messages of the Foxglove websocket protocol, version 1; pure.

Texts are JSON objects with an ``op``. Binary messages begin with the number of their kind.
Numbers in them are little-endian (github.com/foxglove/ws-protocol, docs/spec.md).
"""

from __future__ import annotations

import functools
import operator
import struct
from typing import Annotated, Any, TypeAlias

import msgspec

from rosz.errors import UsageError

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""Names of the protocol: that of today's clients, and that of older ones."""

_Number = Annotated[int, msgspec.Meta(ge=0, le=0xFFFF_FFFF)]
_DATA, _TIME, _RESPONSE, _ASSET = 1, 2, 3, 4
_CALL = 2


def _op(name: str) -> str:
    return name[0].lower() + name[1:]


class _Message(msgspec.Struct, frozen=True, kw_only=True, tag_field="op", tag=_op):
    """A message that a client sends as JSON."""


class ChannelChoice(msgspec.Struct, frozen=True, rename="camel"):
    """A channel that a client subscribes to, under a number of its own."""

    id: _Number
    channel_id: _Number


class SubscribeChannels(_Message, frozen=True, tag="subscribe"):
    """A client subscribes to channels."""

    subscriptions: list[ChannelChoice]


class UnsubscribeChannels(_Message, frozen=True, rename="camel", tag="unsubscribe"):
    """A client ends subscriptions."""

    subscription_ids: list[_Number]


class ClientChannel(msgspec.Struct, frozen=True, rename="camel"):
    """A channel that a client publishes on."""

    id: _Number
    topic: str
    encoding: str
    schema_name: str
    schema: str | None = None
    schema_encoding: str | None = None


class AdvertiseChannels(_Message, frozen=True, tag="advertise"):
    """A client begins to publish."""

    channels: list[ClientChannel]


class UnadvertiseChannels(_Message, frozen=True, rename="camel", tag="unadvertise"):
    """A client ends channels on which it publishes."""

    channel_ids: list[_Number]


class FoxgloveParameter(msgspec.Struct, frozen=True, omit_defaults=True):
    """A parameter; one without a value is not set."""

    name: str
    value: Any = msgspec.UNSET
    type: str | None = None


class GetParameters(_Message, frozen=True, rename="camel"):
    """A client reads parameters; all if it names none."""

    parameter_names: list[str]
    id: str | None = None


class SetParameters(_Message, frozen=True):
    """A client sets parameters, or deletes those without a value."""

    parameters: list[FoxgloveParameter]
    id: str | None = None


class SubscribeParameterUpdates(_Message, frozen=True, rename="camel"):
    """A client follows parameters; all if it names none."""

    parameter_names: list[str]


class UnsubscribeParameterUpdates(_Message, frozen=True, rename="camel"):
    """A client follows parameters no longer; none at all if it names none."""

    parameter_names: list[str]


class SubscribeConnectionGraph(_Message, frozen=True):
    """A client follows who publishes, subscribes and serves."""


class UnsubscribeConnectionGraph(_Message, frozen=True):
    """A client follows the graph no longer."""


class FetchAsset(_Message, frozen=True, rename="camel"):
    """A client fetches a file."""

    uri: str
    request_id: _Number


class PublishedData(msgspec.Struct, frozen=True, tag_field="op", tag="message"):
    """A binary message with data for a channel of the client."""

    channel: int
    data: bytes


class ServiceCall(msgspec.Struct, frozen=True, tag_field="op", tag="service call"):
    """A binary message that calls a service."""

    service: int
    call: int
    encoding: str
    data: bytes


ClientMessage: TypeAlias = _Message | PublishedData | ServiceCall
"""A message of a client."""

_kinds: Any = functools.reduce(operator.or_, _Message.__subclasses__())
_json_decoder: msgspec.json.Decoder[_Message] = msgspec.json.Decoder(_kinds)


def read(message: str | bytes) -> ClientMessage:
    """Parse a message of a client.

    Raises:
        UsageError: It is none of the protocol.
    """
    if isinstance(message, bytes):
        return _read_binary(message)
    try:
        return _json_decoder.decode(message)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise UsageError(f"not a message of the protocol: {error}, in {message[:100]!r}") from error


def _read_binary(message: bytes) -> PublishedData | ServiceCall:
    try:
        if message[:1] == bytes((_DATA,)):
            (channel,) = struct.unpack_from("<I", message, 1)
            return PublishedData(channel, message[5:])
        if message[:1] == bytes((_CALL,)):
            service, call, size = struct.unpack_from("<III", message, 1)
            encoding, data = message[13 : 13 + size], message[13 + size :]
            if len(encoding) == size:
                return ServiceCall(service, call, encoding.decode(), data)
    except (struct.error, UnicodeDecodeError) as error:
        raise UsageError(
            f"a binary message of {len(message)} bytes is not whole: {error}"
        ) from error
    raise UsageError(
        f"a binary message begins with {message[:13]!r}: expected 1 and a channel, or 2, a service,"
        " a call and an encoding"
    )


def data_head(subscription: int, time_ns: int) -> bytes:
    """Return the head of a message of a channel, for a subscription."""
    return struct.pack("<BIQ", _DATA, subscription, time_ns)


def time_frame(time_ns: int) -> bytes:
    """Return a message with the time, in nanoseconds."""
    return struct.pack("<BQ", _TIME, time_ns)


def response_frame(call: ServiceCall, data: bytes) -> bytes:
    """Return the response to a call."""
    encoding = call.encoding.encode()
    head = struct.pack("<BIII", _RESPONSE, call.service, call.call, len(encoding))
    return head + encoding + data


def asset_frame(request: int, data: bytes) -> bytes:
    """Return a file that was fetched."""
    return struct.pack("<BIBI", _ASSET, request, 0, 0) + data


def refusal_frame(request: int, reason: str) -> bytes:
    """Return why a file cannot be fetched."""
    text = reason.encode("utf-8", "replace")
    return struct.pack("<BIBI", _ASSET, request, 1, len(text)) + text
