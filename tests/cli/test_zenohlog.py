from __future__ import annotations

from rosz.cli.core import LogSummary

LINE = (
    "\x1b[2m2026-11-21T07:34:36.684141Z\x1b[0m \x1b[33m WARN\x1b[0m acc-0 ThreadId(05) "
    "\x1b[2mzenoh_link_tls::unicast\x1b[0m\x1b[2m:\x1b[0m {}. Hint: increase the limit.\n"
)


def test_each_kind_once_a_minute() -> None:
    now = 100.0
    written: list[str] = []
    summary = LogSummary(written.append, lambda: now)
    for number in range(1000):
        summary.add(LINE.format("peer sent no certificates"))
        summary.add(LINE.format(f"invalid peer certificate: expired {number} seconds ago"))
    assert written == [
        "WARNING: a link is refused: peer sent no certificates",
        "WARNING: a link is refused: invalid peer certificate: expired 0 seconds ago",
    ]
    now += 61
    summary.add(LINE.format("peer sent no certificates"))
    assert (
        written[2] == "WARNING: a link is refused: peer sent no certificates (999 times more since)"
    )


def test_memory_is_bounded() -> None:
    written: list[str] = []
    summary = LogSummary(written.append)
    for number in range(500):
        summary.add(LINE.format(f"kind {'x' * number}"))
    assert len(written) == 500
    assert len(summary.seen) == 100


def test_other_messages_are_passed_on() -> None:
    written: list[str] = []
    LogSummary(written.append).add("thread 'acc-0' panicked\n")
    assert written == ["thread 'acc-0' panicked"]


def test_a_probe_is_not_reported() -> None:
    written: list[str] = []
    LogSummary(written.append).add(LINE.format("tls handshake eof"))
    assert written == []
