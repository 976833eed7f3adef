"""The publishers of recorded topics: the channel and the definition of each.

A type that is not known here is described by the publisher's node. The messages of the channel wait
until that has replied, and for a second at most until the token of the publisher is known.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial

from rosz.bags.bag import Channel
from rosz.bags.formats.channel_text import event_definition
from rosz.bags.record.queue import RecordedPublisher
from rosz.errors import RoszError
from rosz.graph import Followed
from rosz.node import MessageInfo, Node
from rosz.node.ros2 import request_definition
from rosz.wire import NO_HASH, Kind, Token, format_token, gid
from rosz.worker import Worker

_TOKEN_TIMEOUT = 1.0
"""Time that messages wait for the token of their publisher, which tells its QoS and its node."""
_DEFINITION_TIMEOUT = 10.0
_RULE = "=" * 80


class RecordedPublishers:
    """The publishers by their GIDs.

    Args:
        begin: Function called once with each publisher and its channel; it must not raise.
    """

    def __init__(
        self,
        node: Node,
        begin: Callable[[RecordedPublisher, Channel], object],
        warn: Callable[[str], object],
    ) -> None:
        self._node = node
        self._begin_track = begin
        self._warn = warn
        self._lock = threading.Lock()
        self._followed: dict[str, Followed] = {}
        self._publishers: dict[bytes, RecordedPublisher] = {}
        self._worker: Worker[Callable[[], object]] = Worker("rosz-bag-definitions", threads=4)
        self._late: Worker[Callable[[], object]] = Worker("rosz-bag-tokens")

    @property
    def topics(self) -> set[str]:
        """The topics of which messages have come."""
        return {publisher.topic for publisher in list(self._publishers.values())}

    def follow(self, topic: str) -> None:
        """Follow the tokens of the publishers of a topic."""
        tokens = self._node.context.graph.follow_entities(Kind.PUBLISHER, topic)
        self._followed[topic] = self._node.keep(tokens)
        tokens.listen(self._learn)

    def find(self, topic: str, info: MessageInfo) -> RecordedPublisher:
        """Return the publisher of a message, which may come before its token."""
        publisher = self._publishers.get(info.gid)
        if publisher is not None:
            return publisher
        publisher = self._publishers[info.gid] = RecordedPublisher(topic, info)
        # The token is looked for after `_learn` can find the publisher, so that none is missed.
        token = self._find_token(publisher)
        if token is not None:
            self._define(publisher, token)
        else:
            self._late.later(_TOKEN_TIMEOUT, partial(self._define, publisher, None))
        return publisher

    def _find_token(self, publisher: RecordedPublisher) -> Token | None:
        tokens = self._followed[publisher.topic].view().publishers(publisher.topic)
        return next((each for each in tokens if gid(format_token(each)) == publisher.gid), None)

    def _learn(self, token: Token, alive: bool) -> None:
        """Begin to record the publisher of a token, if its messages wait for that."""
        publisher = self._publishers.get(gid(format_token(token))) if alive else None
        if publisher is not None:
            self._worker.submit(partial(self._define, publisher, token))

    def _define(self, publisher: RecordedPublisher, token: Token | None) -> None:
        """Begin to record a publisher, with its definition from here or from its node."""
        with self._lock:
            if publisher.defined:
                return
            publisher.defined, publisher.token = True, token
        definition = self._definition(publisher)
        if definition is not None:
            self._begin(publisher, *definition)
        elif token is None:
            self._begin(publisher, "", "")
        else:
            self._worker.submit(partial(self._request_definition, publisher, token))

    def _definition(self, publisher: RecordedPublisher) -> tuple[str, str] | None:
        """Return the definition and the md5 of a publisher's type, if it is the one known here."""
        try:
            cls = self._node.context.types.message(publisher.type_name)
        except RoszError:
            return None
        same = publisher.type_hash in {NO_HASH, cls._type_hash}
        text = event_definition(publisher.type_name, cls._full_text)
        return (text, cls._md5sum) if same else None

    def _request_definition(self, publisher: RecordedPublisher, token: Token) -> None:
        try:
            described = request_definition(self._node, token, _DEFINITION_TIMEOUT)
        except RoszError as error:
            self._warn(f"{publisher.topic} is recorded without the definition of its type: {error}")
            self._begin(publisher, "", "")
            return
        texts = [described.text]
        texts += [f"{_RULE}\nMSG: {name}\n{text}" for name, text in described.others.items()]
        text = "\n".join(texts)
        text = event_definition(described.name, text)
        try:
            md5 = self._node.context.types.message_from_text(described.name, text)._md5sum
        except RoszError as error:
            self._warn(f"the definition of {described.name} is not well-formed: {error}")
            md5 = ""
        self._begin(publisher, text, md5)

    def _begin(self, publisher: RecordedPublisher, definition: str, md5: str) -> None:
        self._begin_track(publisher, publisher.channel(definition, md5))

    def close(self) -> None:
        """Stop waiting for tokens."""
        self._worker.close()
        self._late.close()

    def begin_all(self) -> None:
        """Begin to record those whose token has not come in time, or whose node has not replied."""
        for publisher in list(self._publishers.values()):
            if publisher.track is None:
                publisher.token = publisher.token or self._find_token(publisher)
                self._begin(publisher, *(self._definition(publisher) or ("", "")))
