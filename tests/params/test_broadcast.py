"""Writes that wait for acknowledgements."""

from __future__ import annotations

from rosz.params.replica.broadcast import PendingWrites


def test_who_lagged_and_acknowledges_again_is_reported_once() -> None:
    returned: list[str] = []
    writes = PendingWrites(returned.append)
    first = writes.open({"1a", "2b"})
    writes.acknowledge("1a", first.number)
    assert writes.close(first) == {"2b"}
    assert not returned
    second = writes.open({"1a", "2b"})
    assert second.waiting == {"1a"}
    writes.acknowledge("2b", second.number)
    writes.acknowledge("2b", first.number)
    assert returned == ["2b"]
