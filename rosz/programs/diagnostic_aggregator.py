"""diagnostic_aggregator: the statuses of ``/diagnostics``, sorted into a tree by analyzers.

Parameters, topics and analyzers are those of ROS 1 (ROS wiki, diagnostic_aggregator). Analyzers are
classes of this module; others cannot be loaded.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import msgspec

from rosz.errors import RoszError
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rosz.msgs.std_msgs.msg import Header
from rosz.node import Node, NodeLog, serve_loggers

_OK, _ERROR, _STALE = DiagnosticStatus.OK, DiagnosticStatus.ERROR, DiagnosticStatus.STALE
_TEXTS = {_OK: "OK", DiagnosticStatus.WARN: "Warning", _ERROR: "Error", _STALE: "Stale"}
_NANOSECONDS = 1_000_000_000
_TIMEOUT = 5.0
_NONE = -1
# As in ROS 1: all nodes of a robot publish on one topic, often at the same time.
_QUEUE = 1000


class AnalyzerError(RoszError):
    """The parameters of an analyzer cannot be used."""


class Item(msgspec.Struct):
    """A status that was received at a time in nanoseconds, or is missing; at most stale."""

    name: str
    updated: int
    level: int = _STALE
    message: str = "Missing"
    hardware_id: str = ""
    values: list[KeyValue] = []

    @classmethod
    def of(cls, status: DiagnosticStatus, now: int) -> Item:
        """Return the item of a status that arrives."""
        level = status.level if status.level in _TEXTS else _ERROR
        return cls(status.name, now, level, status.message, status.hardware_id, list(status.values))

    def status(self, path: str, *, stale: bool = False) -> DiagnosticStatus:
        """Return the status below a path."""
        return DiagnosticStatus(
            level=_STALE if stale else self.level,
            name=f"{path.rstrip('/')}/{_flat(self.name)}",
            message=self.message,
            hardware_id=self.hardware_id,
            values=self.values,
        )


def _flat(name: str) -> str:
    return name.replace("/", " ")


def _without_prefix(path: str, prefix: str) -> str:
    """Remove a prefix, with a colon and blanks behind it, from the last part of a path."""
    if not prefix:
        return path
    above, slash, last = path.rpartition("/")
    # As in ROS 1, only the first place where the prefix stands in the whole path counts.
    if path.find(prefix) == len(above) + len(slash):
        last = last.removeprefix(prefix)
    return f"{above}/{last.removeprefix(':').lstrip(' ')}" if slash else last


class Section:
    """Takes statuses, and reports them below one path, with a status that sums them up.

    Args:
        now: Time in nanoseconds.
        timeout: Age in seconds at which statuses are stale; never if not above 0.
        expected_number: Required number of statuses; negative for any number.
        discard_stale: Whether to leave out stale ones.
    """

    def __init__(
        self,
        path: str,
        name: str,
        now: int,
        *,
        timeout: float = _TIMEOUT,
        expected_number: int = _NONE,
        discard_stale: bool = False,
    ) -> None:
        self.path: str = path
        self.name: str = name
        self.items: dict[str, Item] = {}
        self._timeout = round(timeout * _NANOSECONDS)
        self._expected_number = expected_number
        self._discards = discard_stale and timeout > 0
        self._level = _OK
        self._level_since = now

    def match(self, name: str) -> bool:  # noqa: ARG002
        """Take every status."""
        return True

    def analyze(self, item: Item) -> bool:
        """Take a status, instead of an earlier one of its name."""
        self.items[item.name] = item
        return True

    def report(self, now: int) -> list[DiagnosticStatus]:
        """Return the sum of the statuses, and the statuses sorted by name."""
        stale = {
            name: 0 < self._timeout < now - item.updated
            for name, item in sorted(self.items.items())
        }
        if self._discards:
            self.items = {name: item for name, item in self.items.items() if not stale[name]}
            stale = {name: False for name in stale if name in self.items}
        items = {name: self.items[name] for name in stale}
        head = DiagnosticStatus(
            name=self.path, values=[KeyValue(name, item.message) for name, item in items.items()]
        )
        levels = [_STALE if stale[name] else item.level for name, item in items.items()]
        head.level = _sum(levels)
        head.message = _TEXTS[head.level]
        self._check_number(head)
        lasting = self._timeout > 0 and self._level == _STALE
        forgotten = self._discards and lasting and now - self._level_since > self._timeout
        if head.level != self._level:
            self._level, self._level_since = head.level, now
        if forgotten and not items:
            return []
        return [head, *(item.status(self.path, stale=stale[name]) for name, item in items.items())]

    def _check_number(self, head: DiagnosticStatus) -> None:
        expected, count = self._expected_number, len(self.items)
        if expected == 0 == count:
            head.level, head.message = _OK, _TEXTS[_OK]
        elif expected > 0 and count != expected:
            head.level = max(head.level, _ERROR)
            head.message = (
                f"Expected {expected}, found {count}"
                if count
                else f"No items found, expected {expected}"
            )


def _sum(levels: Iterable[int]) -> int:
    """Return the highest level; stale if all are, and an error if only some are."""
    distinct = set(levels)
    if distinct <= {_STALE}:
        return _STALE
    highest = max(distinct)
    return _ERROR if highest == _STALE else highest


class GenericAnalyzer(Section):
    """Statuses whose names meet one of some conditions.

    Raises:
        AnalyzerError: It has no path, or no condition.
    """

    def __init__(self, base: str, params: Mapping[str, Any], log: NodeLog, now: int) -> None:
        if "path" not in params:
            raise AnalyzerError("it has no parameter 'path'")
        name = str(params["path"])
        prefixes = _texts(params, "find_and_remove_prefix")
        self._removed = [*map(_flat, (*prefixes, *_texts(params, "remove_prefix")))]
        self._beginnings = (*prefixes, *_texts(params, "startswith"))
        self._expected = _texts(params, "expected")
        self._names = {*self._expected, *_texts(params, "name")}
        self._parts = _texts(params, "contains")
        self._patterns = list(_patterns(_texts(params, "regex"), log))
        if not (self._beginnings or self._names or self._parts or self._patterns):
            raise AnalyzerError(
                "it has no condition: expected 'find_and_remove_prefix', 'startswith', 'name',"
                " 'contains', 'expected' or 'regex'"
            )
        super().__init__(
            _below(base, name),
            name,
            now,
            timeout=float(params.get("timeout", _TIMEOUT)),
            expected_number=int(params.get("num_items", _NONE)),
            discard_stale=bool(params.get("discard_stale", False)),
        )
        self.items = {expected: Item(expected, now) for expected in self._expected}

    def match(self, name: str) -> bool:
        """Return whether a name meets a condition."""
        return (
            name in self._names
            or name.startswith(self._beginnings)
            or any(part in name for part in self._parts)
            or any(pattern.fullmatch(name) for pattern in self._patterns)
        )

    def report(self, now: int) -> list[DiagnosticStatus]:
        """Return the sum of the statuses and the statuses, also those that are missing."""
        statuses = super().report(now)
        names = {status.name.rpartition("/")[2] for status in statuses}
        missing = [name for name in self._expected if not self._forms(name) & names]
        level = _STALE if all(status.level == _STALE for status in statuses) else _ERROR
        statuses += [Item(name, now).status(self.path, stale=True) for name in missing]
        for status in statuses:
            for prefix in self._removed:
                status.name = _without_prefix(status.name, prefix)
            if missing and status.name == self.path:
                kind = "All" if level == _STALE else "Some"
                to = "STALE" if level == _STALE else "ERROR"
                status.level = level
                status.message = f"{kind} diagnostics are stale - setting combined level to {to}."
                status.values += [KeyValue(name, "Missing") for name in missing]
        return statuses

    def _forms(self, name: str) -> set[str]:
        """Return how the last part of the path of a status of a name may look."""
        return {name, _flat(name), *(_without_prefix(name, prefix) for prefix in self._removed)}


class DiscardAnalyzer(GenericAnalyzer):
    """Takes statuses, and does not report them."""

    def report(self, now: int) -> list[DiagnosticStatus]:  # noqa: ARG002
        """Return nothing."""
        return []


class IgnoreAnalyzer(Section):
    """Takes nothing; its parameters are not looked at."""

    def __init__(self, base: str, params: Mapping[str, Any], log: NodeLog, now: int) -> None:
        del base, params, log
        super().__init__("", "", now)

    def match(self, name: str) -> bool:  # noqa: ARG002
        """Return that it takes no status."""
        return False

    def report(self, now: int) -> list[DiagnosticStatus]:  # noqa: ARG002
        """Return nothing."""
        return []


class AnalyzerGroup:
    """Analyzers below one path.

    Args:
        params: Its parameters: ``path``, and ``analyzers`` with a dictionary for each.
        strict: Whether every analyzer has to be usable.

    Raises:
        AnalyzerError: One of its analyzers cannot be used, or it has none.
    """

    def __init__(
        self, base: str, params: Mapping[str, Any], log: NodeLog, now: int, *, strict: bool = True
    ) -> None:
        self.name: str = str(params.get("path", ""))
        self.path: str = _below(base, self.name)
        self._matches: dict[str, list[Section | AnalyzerGroup]] = {}
        self._analyzers: list[Section | AnalyzerGroup] = []
        self._unusable: list[Item] = []
        given = params.get("analyzers")
        for name, settings in sorted(given.items()) if isinstance(given, dict) else ():
            kind = settings.get("type") if isinstance(settings, dict) else None
            cls = _CLASSES.get(str(kind).removeprefix("diagnostic_aggregator/"))
            if cls is None:
                log.error("analyzer '%s' has the type '%s'; expected %s", name, kind, _TYPES)
                if kind is None:
                    self._unusable.append(Item(name, now, message="No Analyzer type given"))
                continue
            try:
                self._analyzers.append(cls(self.path, settings, log, now))
            except AnalyzerError as error:
                log.warning("analyzer '%s' cannot be used: %s", name, error)
                self._unusable.append(Item(name, now, message="Analyzer init failed"))
        if strict and (self._unusable or not self._analyzers):
            raise AnalyzerError(
                "one of its analyzers cannot be used" if self._unusable else "it has no analyzers"
            )

    def match(self, name: str) -> bool:
        """Return whether an analyzer takes a status of a name."""
        if name not in self._matches:
            self._matches[name] = [analyzer for analyzer in self._analyzers if analyzer.match(name)]
        return bool(self._matches[name])

    def analyze(self, item: Item) -> bool:
        """Hand a status to all analyzers that match; return whether one has taken it."""
        self.match(item.name)
        taken = [analyzer.analyze(item) for analyzer in self._matches[item.name]]
        return any(taken)

    def report(self, now: int) -> list[DiagnosticStatus]:
        """Return the statuses of the analyzers, and their sum unless this is the root."""
        if not self._analyzers:
            name = "/AnalyzerGroup" if self.path == "/" else self.path
            return [DiagnosticStatus(level=_ERROR, name=name, message="No analyzers")]
        statuses: list[DiagnosticStatus] = []
        head = DiagnosticStatus(name=self.path)
        levels: list[int] = []
        for analyzer in self._analyzers:
            for status in analyzer.report(now):
                statuses.append(status)
                if status.name == analyzer.path:
                    levels.append(status.level)
                    head.values.append(KeyValue(analyzer.name, status.message))
        if self.path != "/":
            head.level = _sum(levels) if levels else _OK
            head.message = _TEXTS[head.level]
            statuses.append(head)
        return statuses + [item.status(self.path, stale=True) for item in self._unusable]


_Make = Callable[[str, Mapping[str, Any], NodeLog, int], Section | AnalyzerGroup]
_CLASSES: dict[str, _Make] = {
    one.__name__: one for one in (AnalyzerGroup, DiscardAnalyzer, GenericAnalyzer, IgnoreAnalyzer)
}
_TYPES = " or ".join(f"diagnostic_aggregator/{name}" for name in _CLASSES)


def _below(base: str, name: str) -> str:
    return "/" + "/".join(part.strip("/") for part in (base, name) if part.strip("/"))


def _texts(params: Mapping[str, Any], name: str) -> tuple[str, ...]:
    value = params.get(name, ())
    return (value,) if isinstance(value, str) else tuple(map(str, value))


def _patterns(texts: Iterable[str], log: NodeLog) -> Iterable[re.Pattern[str]]:
    for text in texts:
        try:
            yield re.compile(text)
        except re.error as error:
            log.warning("'%s' is not a regular expression, and is ignored: %s", text, error)


class Aggregator:
    """Takes the statuses of ``/diagnostics``, and publishes the tree that its parameters set."""

    def __init__(self, node: Node) -> None:
        self._node = node
        params: Any = node.params.get("~", {})
        base = _below(str(params.get("base_path", "")), "")
        now = node.now()
        self._lock = threading.Lock()
        self._group = AnalyzerGroup(base, params, node.log, now, strict=False)
        self._others = Section(_below(base, "Other"), "Other", now, discard_stale=True)
        self._others_are_errors = bool(params.get("other_as_errors", False))
        self._unstamped: set[str] = set()
        self._tree = node.publisher("/diagnostics_agg", DiagnosticArray, queue_size=1)
        self._state = node.publisher("/diagnostics_toplevel_state", DiagnosticStatus, queue_size=1)
        node.subscription("/diagnostics", DiagnosticArray, self.receive, queue_size=_QUEUE)

    def receive(self, message: DiagnosticArray) -> None:
        """Hand statuses to the analyzers."""
        names = ", ".join(status.name for status in message.status)
        if not message.header.stamp.to_nsec() and names not in self._unstamped:
            self._unstamped.add(names)
            self._node.log.warning(
                "No timestamp set for diagnostic message. Message names: %s", names
            )
        with self._lock:
            for status in message.status:
                item = Item.of(status, self._node.now())
                if not self._group.analyze(item):
                    self._others.analyze(item)

    def publish(self) -> None:
        """Publish the tree, and the worst level in it."""
        now = self._node.now()
        with self._lock:
            statuses = self._group.report(now)
            others = self._others.report(now)
        if len(others) > 1:
            if self._others_are_errors:
                others[0].level = _ERROR
                others[0].message = 'Unanalyzed items found in "Other"'
            statuses += others
        self._tree.publish(DiagnosticArray(Header(stamp=Time.from_nsec(now)), statuses))
        levels = [status.level for status in statuses]
        level = _sum(levels) if levels else _NONE
        self._state.publish(DiagnosticStatus(level=level, name="toplevel_state"))


def main() -> None:
    """Sort diagnostics until the node is shut down."""
    with Node("diagnostic_aggregator") as node:
        serve_loggers(node)
        aggregator = Aggregator(node)
        for _ in node.rate(float(node.params.get("~pub_rate", 1.0))):
            aggregator.publish()
