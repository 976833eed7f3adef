"""How many messages of each topic may wait in Zenoh."""

from __future__ import annotations

from rosz.bags.record.queue import Channels

MB = 1 << 20


def test_channels_take_most_of_their_bound_and_no_more() -> None:
    for size in (MB - 1, MB, MB + 28, 921_660, 5 * MB // 3):
        channels = Channels(64 * MB, 8192)
        count = channels.fit("/camera", size)
        assert 40 * MB <= count * size <= channels.size <= 64 * MB
        assert channels.fit("/camera", 10) == count


def test_channels_change_rarely() -> None:
    channels = Channels(64 * MB, 8192)
    assert len({channels.fit("/camera", size) for size in range(MB, 2 * MB, 100)}) <= 9
    assert channels.fit("/huge", 100 * MB) == 8
    assert channels.fit("/small", 100) == 8192
