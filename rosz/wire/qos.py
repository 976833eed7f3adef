"""The QoS chunk of a liveliness token (rmw_zenoh).

``<reliability>:<durability>:<history>,<depth>:<deadline>:<lifespan>:<liveliness>,<lease>`` with
durations as ``seconds,nanoseconds``; a value that is the default is left empty.
"""

from __future__ import annotations

from typing import Literal, TypeVar

from rosz.errors import DecodeError
from rosz.qos import FOREVER, QoS

__all__ = ("format_qos", "parse_qos")

T = TypeVar("T")

_DEFAULT_DEPTH = 42
_SECOND = 1_000_000_000
_FOREVER = divmod(FOREVER, _SECOND)
_RELIABLE, _BEST_EFFORT = 1, 2
_TRANSIENT_LOCAL, _VOLATILE = 1, 2
_KEEP_LAST, _KEEP_ALL = 1, 2
_AUTOMATIC, _MANUAL_BY_TOPIC = 1, 3
_FIELDS_PER_PART = (1, 1, 2, 2, 2, 3)


def format_qos(qos: QoS) -> str:
    """Return the chunk of a QoS, without default values."""
    lease = _duration(qos.lease)
    return ":".join(
        (
            "" if qos.reliable else str(_BEST_EFFORT),
            str(_TRANSIENT_LOCAL) if qos.latched else "",
            ("" if qos.history == "keep_last" else str(_KEEP_ALL))
            + ","
            + ("" if qos.depth in {0, _DEFAULT_DEPTH} else str(qos.depth)),
            _duration(qos.deadline),
            _duration(qos.lifespan),
            ("" if qos.liveliness == "automatic" else str(_MANUAL_BY_TOPIC)) + "," + lease,
        )
    )


def parse_qos(chunk: str) -> QoS:
    """Parse a chunk; values that mean "the system's choice" become the defaults.

    Raises:
        DecodeError: The chunk has another form, or a number without a meaning.
    """
    parts = [part.split(",") for part in chunk.split(":")]
    if tuple(map(len, parts)) != _FIELDS_PER_PART:
        raise DecodeError(
            "QoS chunk", 0, f"'{chunk}', expected the form 'r:d:h,n:s,ns:s,ns:l,s,ns'"
        )
    (rel,), (dur,), (hist, depth), deadline, lifespan, (live, *lease) = parts
    try:
        return QoS(
            depth=_number(depth, _DEFAULT_DEPTH),
            reliability=_RELIABILITY[_number(rel, _RELIABLE)],
            durability=_DURABILITY[_number(dur, _VOLATILE)],
            history=_HISTORY[_number(hist, _KEEP_LAST)],
            deadline=_nanoseconds(deadline),
            lifespan=_nanoseconds(lifespan),
            liveliness=_LIVELINESS[_number(live, _AUTOMATIC)],
            lease=_nanoseconds(lease),
        )
    except (ValueError, KeyError) as error:
        raise DecodeError(
            "QoS chunk", 0, f"'{chunk}' has a value that is not known: {error}"
        ) from error


def _codes(default: T, codes: tuple[int, ...], others: dict[int, T]) -> dict[int, T]:
    return dict.fromkeys(codes, default) | others


# 0 is the system's default, 3 unknown, 4 and 5 best available: all of them mean the default.
_RELIABILITY: dict[int, Literal["reliable", "best_effort"]] = _codes(
    "reliable", (0, _RELIABLE, 3, 4), {_BEST_EFFORT: "best_effort"}
)
_DURABILITY: dict[int, Literal["volatile", "transient_local"]] = _codes(
    "volatile", (0, _VOLATILE, 3, 4), {_TRANSIENT_LOCAL: "transient_local"}
)
_HISTORY: dict[int, Literal["keep_last", "keep_all"]] = _codes(
    "keep_last", (0, _KEEP_LAST, 3), {_KEEP_ALL: "keep_all"}
)
_LIVELINESS: dict[int, Literal["automatic", "manual_by_topic"]] = _codes(
    "automatic", (0, _AUTOMATIC, 4, 5), {_MANUAL_BY_TOPIC: "manual_by_topic"}
)


def _number(text: str, default: int) -> int:
    return int(text) if text else default


def _duration(nanoseconds: int) -> str:
    seconds, rest = _FOREVER if nanoseconds == 0 else divmod(nanoseconds, _SECOND)
    return ",".join(
        "" if value == forever else str(value)
        for value, forever in zip((seconds, rest), _FOREVER, strict=True)
    )


def _nanoseconds(fields: list[str]) -> int:
    seconds, rest = (_number(text, forever) for text, forever in zip(fields, _FOREVER, strict=True))
    return seconds * _SECOND + rest
