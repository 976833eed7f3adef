"""The publishers of the topics that are played, and how the messages of bags become theirs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

import msgspec

from rosz import names
from rosz.bags.bag import BagReader, Channel, Entry
from rosz.bags.edit.migrate import Conversion, find_conversion
from rosz.bags.play.options import PlayOptions
from rosz.errors import MessageError, RoszError
from rosz.node import Node, Publisher
from rosz.qos import QoS

_CLOCK = "/clock"

Played: TypeAlias = "tuple[int, Publisher[Any], bytes]"
"""Stamp, publisher and payload of a message."""


class Output(NamedTuple):
    """The publisher of a channel, which is kept so that no other one gets its identity."""

    channel: Channel
    publisher: Publisher[Any]
    conversion: Conversion


class Outputs:
    """The publishers of the topics of bags, with the QoS that was recorded.

    Args:
        warn: Function called with each problem; a topic or message with a problem is left out.

    Attributes:
        problems: Number of problems.
        publishers: The publishers that have been made, by topic, type, QoS and node.
        pausing: Names of topics whose messages begin a pause.
    """

    def __init__(
        self,
        node: Node,
        options: PlayOptions,
        readers: Sequence[BagReader],
        warn: Callable[[str], object],
    ) -> None:
        self._node = node
        self._options = options
        self._warn = warn
        self._failed: set[int] = set()
        self._outputs: dict[int, Output | None] = {}
        self.problems: int = 0
        self.publishers: dict[Any, Publisher[Any]] = {}
        self.pausing: set[str] = set()
        self._pause_topics = {names.join("/", name) for name in options.pause_topics}
        self.topics: set[str] = self._choose(
            {channel.topic for reader in readers for channel in reader.channels}
        )

    def _choose(self, topics: set[str]) -> set[str]:
        wanted = {names.join("/", name) for name in self._options.topics}
        missing = sorted(wanted - topics)
        if missing:
            self.report(
                f"no topic '{missing[0]}' in the bags; they have {', '.join(sorted(topics))}"
            )
        for name in sorted(self._pause_topics - topics):
            self._warn(f"no topic '{name}' to pause at in the bags")
        chosen = wanted & topics if wanted else topics
        if self._options.clock and _CLOCK in chosen:
            chosen.discard(_CLOCK)
            self._warn("the recorded /clock is not played, since --clock publishes it")
        return chosen

    def report(self, text: str) -> None:
        """Count a problem, and tell it."""
        self.problems += 1
        self._warn(text)

    def output(self, channel: Channel) -> Output | None:
        """Return the output of a channel; None if its messages cannot be published."""
        key = id(channel)
        if key not in self._outputs:
            self._outputs[key] = self._make(channel)
        return self._outputs[key]

    def _make(self, channel: Channel) -> Output | None:
        try:
            conversion = find_conversion(channel, self._node.context.types)
        except RoszError as error:
            if channel not in [output.channel for output in self._outputs.values() if output]:
                self.report(f"topic '{channel.topic}' is left out: {error}")
            return None
        cls = conversion.message_type
        key = channel.topic, cls._type_hash, channel.qos, channel.node
        if key not in self.publishers:
            if conversion.added:
                self._warn(
                    f"topic '{channel.topic}': the bag lacks {', '.join(conversion.added)} of"
                    f" '{cls._type}', which get their defaults"
                )
            name = self._node.resolve(self._options.prefix + channel.topic)
            express = not self._options.immediate
            made = Publisher(self._node, name, cls, self._qos(channel), waits=True, express=express)
            self.publishers[key] = self._node.keep(made)
            if channel.topic in self._pause_topics:
                self.pausing.add(made.name)
        return Output(channel, self.publishers[key], conversion)

    def _qos(self, channel: Channel) -> QoS:
        """Return the QoS of a channel; where it joins several, the one that offers most."""
        if not channel.qos or (channel.encoding == "ros1" and not channel.latched):
            return (
                QoS(depth=self._options.queue) if self._options.queue else QoS(history="keep_all")
            )
        best = max(channel.qos, key=lambda qos: (qos.latched, qos.reliable, qos.depth))
        return msgspec.structs.replace(
            best, reliability=max(qos.reliability for qos in channel.qos)
        )

    def convert(self, entry: Entry) -> Played | None:
        """Return a message as it is published; None if it cannot be."""
        output = self.output(entry.channel)
        if output is None:
            return None
        try:
            payload = (output.conversion.convert or bytes)(entry.data)
        except MessageError as error:
            self.leave_out(entry.channel, error)
            return None
        return entry.stamp, output.publisher, payload

    def leave_out(self, channel: Channel, error: MessageError) -> None:
        """Count a message that cannot be published, and tell the first of a channel."""
        self.problems += 1
        if id(channel) not in self._failed:
            self._failed.add(id(channel))
            self._warn(f"messages of '{channel.topic}' are left out: {error} (told once)")
