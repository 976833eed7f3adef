"""Recording what a real replica is told and does, step by step, to be replayed.

A process that records writes each step to its file at once, so that the file of one that is killed
holds all but perhaps the last step.
"""

from __future__ import annotations

import os
import pickle
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from rosz.params.replica import replica as replica_module
from rosz.params.replica.core import Config, ReplicaCore
from rosz.params.replica.core import effects as done
from rosz.params.replica.core import events as said

_LENGTH = struct.Struct("<I")


class RecordedStep(NamedTuple):
    """One step of a core.

    Attributes:
        event: What it was told.
        now: When.
        effects: What it did, with errors as their texts.
    """

    event: said.Event
    now: said.Moment
    effects: list[Any]


class Recording(NamedTuple):
    """All steps of one replica."""

    config: Config
    steps: list[RecordedStep]


def plain(effects: list[done.Effect]) -> list[Any]:
    """Return effects with errors as their texts, which can be compared."""
    return [
        (effect.call, f"{effect.result!r}")
        if isinstance(effect, done.Answer) and isinstance(effect.result, Exception)
        else effect
        for effect in effects
    ]


def record_to(path: Path) -> None:
    """Record the next replica of this process in a file."""
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def write(thing: Any) -> None:
        data = pickle.dumps(thing)
        os.write(file, _LENGTH.pack(len(data)) + data)

    class RecordedCore(ReplicaCore):
        def __init__(self, config: Config) -> None:
            super().__init__(config)
            write(config)

        def step(self, event: said.Event, now: said.Moment) -> list[done.Effect]:
            effects = super().step(event, now)
            write((event, now, plain(effects)))
            return effects

    vars(replica_module)["ReplicaCore"] = RecordedCore


def read(path: Path) -> Recording:
    """Return what a replica recorded."""
    config, *steps = _parts(path.read_bytes())
    return Recording(config, [RecordedStep(*step) for step in steps])


def _parts(data: bytes) -> Iterator[Any]:
    start = 0
    while start + _LENGTH.size <= len(data):
        (length,) = _LENGTH.unpack_from(data, start)
        start += _LENGTH.size
        if start + length <= len(data):
            yield pickle.loads(data[start : start + length])
        start += length
