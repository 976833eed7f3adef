"""The options of a player of bags, and its progress."""

from __future__ import annotations

import msgspec


class PlayOptions(msgspec.Struct, frozen=True, kw_only=True):
    """Options for playing bags.

    Attributes:
        rate: Seconds of the bag per second.
        start: Seconds of the bags to leave out.
        duration: Seconds of the bags to play; None for all.
        loop: Whether to begin again at the end.
        keep_alive: Whether to stay at the end, so that latched messages remain available.
        clock: Rate at which ``/clock`` is published, in hertz; 0 for not at all.
        immediate: Whether to publish without waiting.
        paused: Whether to begin with a pause.
        wait_for_subscribers: Whether to wait until each topic has a subscriber, except
            ``/parameter_events``.
        prefix: Text put before the names of topics.
        topics: Names of the topics to play; all if empty.
        pause_topics: Names of topics whose messages begin a pause.
        delay: Seconds to wait after the publishers are made.
        queue: Depth of the queues of publishers whose QoS was not recorded.
        skip_empty: Seconds without a message that are skipped if they are more; 0 for none.
        rate_control_topic: Name of a topic whose messages begin with a header. Without
            ``immediate``, the time of the bags stays near the stamp of the latest of them.
        rate_control_max_delay: Seconds of the bags by which their time may be later.
    """

    rate: float = 1.0
    start: float = 0.0
    duration: float | None = None
    loop: bool = False
    keep_alive: bool = False
    clock: float = 0.0
    immediate: bool = False
    paused: bool = False
    wait_for_subscribers: bool = False
    prefix: str = ""
    topics: tuple[str, ...] = ()
    pause_topics: tuple[str, ...] = ()
    delay: float = 0.2
    queue: int = 100
    skip_empty: float = 0.0
    rate_control_topic: str = ""
    rate_control_max_delay: float = 1.0


class Progress(msgspec.Struct, frozen=True):
    """The progress of a player.

    Attributes:
        stamp: Time of the bag, in nanoseconds.
        elapsed: Seconds of the bags that are played.
        duration: Seconds of the bags in all.
        rate: Seconds of the bag per second.
        paused: Whether it stands still.
        delayed: Whether it waits for the topic that controls its rate.
        published: Number of messages that were published.
    """

    stamp: int
    elapsed: float
    duration: float
    rate: float
    paused: bool
    delayed: bool
    published: int
