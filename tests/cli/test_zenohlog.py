from __future__ import annotations

from rosz.cli.zenohlog import Digest

LINE = (
    "\x1b[2m2026-11-21T07:34:36.684141Z\x1b[0m \x1b[33m WARN\x1b[0m acc-0 ThreadId(05) "
    "\x1b[2mzenoh_link_tls::unicast\x1b[0m\x1b[2m:\x1b[0m {}. Hint: increase the limit.\n"
)


def test_each_kind_once_a_minute() -> None:
    now = 100.0
    told: list[str] = []
    digest = Digest(told.append, lambda: now)
    for number in range(1000):
        digest.take(LINE.format("peer sent no certificates"))
        digest.take(LINE.format(f"invalid peer certificate: expired {number} seconds ago"))
    assert told == [
        "WARNING: a link is refused: peer sent no certificates",
        "WARNING: a link is refused: invalid peer certificate: expired 0 seconds ago",
    ]
    now += 61
    digest.take(LINE.format("peer sent no certificates"))
    assert told[2] == "WARNING: a link is refused: peer sent no certificates (999 times more since)"


def test_memory_is_bounded() -> None:
    told: list[str] = []
    digest = Digest(told.append)
    for number in range(500):
        digest.take(LINE.format(f"kind {'x' * number}"))
    assert len(told) == 500
    assert len(digest._told) == 100


def test_what_is_no_refusal_is_passed_on() -> None:
    told: list[str] = []
    Digest(told.append).take("thread 'acc-0' panicked\n")
    assert told == ["thread 'acc-0' panicked"]


def test_who_only_looks_is_not_refused() -> None:
    told: list[str] = []
    Digest(told.append).take(LINE.format("tls handshake eof"))
    assert told == []
