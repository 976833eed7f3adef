"""The options of rosbag: selected topics, and names and limits of bags."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

import msgspec

from rosz.bags.bag import Compression
from rosz.errors import UsageError
from rosz.wire import Kind, Token

_SUFFIXES = (".mcap", ".bag")
_SERVICE_EVENT = "/_service_event"


class RecordOptions(msgspec.Struct, frozen=True):
    """The names and limits of recorded bags.

    Attributes:
        name: Name of the bag, with or without suffix; empty for one made of ``prefix`` and date.
        prefix: Begin of the name.
        split: Whether a bag that reaches its limit is followed by another one.
        size: Largest size in bytes; 0 for no limit.
        duration: Longest duration in nanoseconds; 0 for no limit.
        max_splits: Number of bags to keep; older ones are deleted; 0 for all.
        buffer: Bytes that may wait to be written; 0 for no limit.
        chunk_size: Bytes that are written, and compressed, together.
        compression: Name of the compression.
    """

    name: str = ""
    prefix: str = ""
    split: bool = False
    size: int = 0
    duration: int = 0
    max_splits: int = 0
    buffer: int = 256 << 20
    chunk_size: int = 768 << 10
    compression: Compression = "none"

    @property
    def suffix(self) -> str:
        """The suffix of the files."""
        given = Path(self.name or self.prefix).suffix
        return given if given in _SUFFIXES else _SUFFIXES[0]

    @property
    def folder(self) -> str:
        """The folder of the files."""
        return str(Path(self.name or self.prefix or ".").parent)

    @property
    def largest_chunk(self) -> int:
        """Bytes that are written together: a quarter of the buffer at most."""
        return min(self.chunk_size, self.buffer // 4 or self.chunk_size)

    def target(self, index: int, now: datetime) -> Path:
        """Return the path of a bag.

        Args:
            index: Number of the bag, from 0.
            now: Time at which it begins.
        """
        given = self.name or self.prefix
        parts = [given.removesuffix(self.suffix)] if given else []
        if not self.name:
            parts.append(now.strftime("%Y-%m-%d-%H-%M-%S"))
        if self.split:
            parts.append(str(index))
        return Path("_".join(parts) + self.suffix)


class Selection:
    """The topics that are recorded.

    Args:
        topics: Full names of topics, or regular expressions that match whole names.
        every: Whether all topics are recorded.
        regex: Whether the topics are regular expressions.
        exclude: Regular expression of topics that are not recorded.
        node: Full name of a node whose subscribed topics are recorded.
        services: Whether the events of services that are introspected are recorded.
        parameters: Whether the parameters are recorded, as they are with all topics.

    Attributes:
        named: Whether only topics with the given names are recorded.
        parameters: Whether the parameters are recorded.

    Raises:
        UsageError: An expression is not valid.
    """

    def __init__(
        self,
        topics: tuple[str, ...] = (),
        *,
        every: bool = False,
        regex: bool = False,
        exclude: str = "",
        node: str = "",
        services: bool = False,
        parameters: bool = False,
    ) -> None:
        self.topics = topics
        self.parameters: bool = parameters or every
        self.named: bool = not (every or regex or node or services)
        self._every = every
        self._patterns = [_compile(topic) for topic in topics] if regex else []
        self._names = frozenset() if regex else frozenset(topics)
        self._exclude = _compile(exclude) if exclude else None
        self._node = node
        self._services = services

    @property
    def at_once(self) -> list[str]:
        """The topics to subscribe to although they are not published yet."""
        return sorted(name for name in self._names if not self._is_excluded(name))

    def has(self, token: Token) -> bool:
        """Return whether an entity makes its topic one that is recorded."""
        name = token.name
        if token.kind not in {Kind.PUBLISHER, Kind.SUBSCRIPTION} or self._is_excluded(name):
            return False
        if token.kind is Kind.SUBSCRIPTION:
            return token.node_name == self._node
        if name in self._names or any(pattern.fullmatch(name) for pattern in self._patterns):
            return True
        if name.endswith(_SERVICE_EVENT):
            return self._services
        return self._every

    def _is_excluded(self, name: str) -> bool:
        return self._exclude is not None and self._exclude.fullmatch(name) is not None


def _compile(expression: str) -> re.Pattern[str]:
    try:
        return re.compile(expression)
    except re.error as error:
        raise UsageError(f"'{expression}' is not a regular expression: {error}") from error
