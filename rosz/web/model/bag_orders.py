"""The messages between the page and the process that records or plays (`rosz.web.bag_process`)."""

from __future__ import annotations

from typing import Literal

import msgspec

from rosz.bags.play import PlayOptions
from rosz.bags.record import RecordOptions


class RecordOrder(RecordOptions, frozen=True, kw_only=True):
    """A recording, whose bag is in the working directory.

    Attributes:
        topics: Full names of topics; all topics if there is none.
        exclude: Regular expression of topics that are not recorded.
    """

    topics: tuple[str, ...] = ()
    exclude: str = ""


class PlayOrder(PlayOptions, frozen=True, kw_only=True):
    """A bag to play.

    Attributes:
        name: Name of the bag in the working directory.
    """

    name: str


class BagOrder(msgspec.Struct, frozen=True):
    """The first line to the process: a bag to record, or one to play."""

    record: RecordOrder | None = None
    play: PlayOrder | None = None


class BagCommand(msgspec.Struct, frozen=True):
    """A further line.

    Attributes:
        do: The action to take.
        value: Seconds of the bag to jump to, or the rate, or whether to loop.
    """

    do: Literal["stop", "pause", "step", "jump", "rate", "loop"]
    value: float = 0.0


class BagReport(msgspec.Struct, frozen=True, omit_defaults=True):
    """A line from the process: its progress, or a sentence for the user.

    Attributes:
        said: A sentence for the user.
        fault: Why it failed.
        path: Name of the bag that is written, or played.
        seconds: Seconds of recording; seconds of the bag that are played.
        duration: Seconds of the bag.
        messages: Number of messages recorded, or published.
        size: Bytes recorded.
        lost: Number of messages that were lost.
        left: Bytes of the disk that are left.
        topics: Number of topics that are recorded.
        rate: Seconds of the bag per second.
        paused: Whether playing stands still.
        loop: Whether playing begins again at the end.
    """

    said: str = ""
    fault: str = ""
    path: str = ""
    seconds: float = 0.0
    duration: float = 0.0
    messages: int = 0
    size: int = 0
    lost: int = 0
    left: int = 0
    topics: int = 0
    rate: float = 1.0
    paused: bool = False
    loop: bool = False
