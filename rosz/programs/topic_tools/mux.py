"""The programs ``mux``, which passes one of several topics on, and ``demux``, its reverse.

Their services lie below ``mux`` and ``demux``, names that users remap. ``mux_select``, ``mux_add``,
``demux_select`` and so on call these services.
"""

from __future__ import annotations

import sys
import threading
from pathlib import Path
from typing import Any, Generic, NoReturn, TypeVar

from rosz.errors import RoszError, ServiceError
from rosz.message import Service
from rosz.msgs.std_msgs.msg import String
from rosz.msgs.topic_tools import srv
from rosz.node import MessageInfo, Node, serve_loggers
from rosz.programs.topic_tools.passing import NONE, RawInput, RawOutput, base_name
from rosz.remap import parse

T = TypeVar("T", RawInput, RawOutput)

_FOREVER = 1e9
_VERBS = {
    "add": ("TOPIC", 'Adding "{topic}" to {kind} "{name}"'),
    "delete": ("TOPIC", 'Deleting "{topic}" from {kind} "{name}"'),
    "list": ("", 'Listing topics from {kind} "{name}"'),
    "select": ("TOPIC", 'Selecting "{topic}" at {kind} "{name}"'),
}


class _TopicChoice(Generic[T]):
    """Topics of which one or none is selected, and the services that change that."""

    def __init__(self, node: Node, kind: str) -> None:
        self._node = node
        self._kind = kind
        self._lock = threading.RLock()
        self._topics: dict[str, T] = {}
        self._selected: T | None = None
        self._own = node.resolve(kind)
        self._announcement = node.publisher(f"{self._own}/selected", String, latch=True)

    def _begin(self, topics: list[str]) -> None:
        """Add the topics of the command line, select the first one, and serve."""
        for topic in topics:
            if self._node.resolve(topic) not in self._topics:
                self._add(topic)
        first = next(iter(self._topics))
        initial = self._node.params.get("~initial_topic", "", type=str)
        if self._kind == "mux" and initial:
            chosen = self._find(initial)
            self._select(chosen, initial if chosen else NONE)
        else:
            self._select(self._topics[first], first)
        for verb, serve in (
            ("select", self._serve_select),
            ("add", self._serve_add),
            ("list", lambda _: [list(self._topics)]),
            ("delete", self._serve_delete),
        ):
            self._node.service(f"{self._own}/{verb}", _service_type(self._kind, verb), serve)

    def _find(self, topic: str) -> T | None:
        return None if topic == NONE else self._topics.get(self._node.resolve(topic))

    def _make(self, topic: str) -> T:
        raise NotImplementedError

    def _add(self, topic: str) -> None:
        made = self._make(topic)
        self._topics[made.name] = made

    def _select(self, chosen: T | None, shown: str) -> None:
        self._selected = chosen
        self._node.log.info(
            "%s selected %s", self._kind, f"[{chosen.name}]" if chosen else "to nothing"
        )
        self._announcement.publish(shown)

    def _serve_select(self, request: Any) -> list[str]:
        with self._lock:
            before = self._selected.name if self._selected else ""
            chosen = self._find(request.topic)
            if chosen is None and request.topic != NONE:
                self._refuse(f"it has no topic '{request.topic}'; it has {self._listing()}")
            self._select(chosen, request.topic)
            return [before]

    def _serve_add(self, request: Any) -> list[Any]:
        with self._lock:
            if request.topic == NONE:
                self._refuse(f"'{NONE}' stands for no topic; give the name of one")
            if self._find(request.topic) is not None:
                self._refuse(f"it has topic '{request.topic}' already")
            self._add(request.topic)
            self._node.log.info("added %s to %s", request.topic, self._kind)
            return []

    def _serve_delete(self, request: Any) -> list[Any]:
        with self._lock:
            deleted = self._find(request.topic)
            if deleted is None:
                self._refuse(f"it has no topic '{request.topic}'; it has {self._listing()}")
            if deleted is self._selected:
                self._refuse(f"topic '{request.topic}' is selected; select another one first")
            del self._topics[deleted.name]
            deleted.close()
            self._node.log.info("deleted %s from %s", request.topic, self._kind)
            return []

    def _listing(self) -> str:
        return ", ".join(self._topics) or "none"

    def _refuse(self, reason: str) -> NoReturn:
        self._node.log.warning("%s: %s", self._kind, reason)
        raise ServiceError(f"{self._kind}: {reason}")


class Mux(_TopicChoice[RawInput]):
    """Pass on the selected one of several topics, at first the first one.

    Its private parameters are those of ROS 1: ``lazy`` subscribes to the selected topic alone, and
    only while the output has subscribers, ``latch``, and ``initial_topic``.
    """

    def __init__(self, node: Node, target: str, sources: list[str]) -> None:
        super().__init__(node, "mux")
        self._lazy = node.params.get("~lazy", False, type=bool)
        latch = node.params.get("~latch", False, type=bool)
        self._output = RawOutput(node, target, latch=latch, changed=self._follow)
        with self._lock:
            self._begin(sources)
        node.service(f"{self._output.name}_select", srv.MuxSelect, self._serve_select)

    def _make(self, topic: str) -> RawInput:
        return RawInput(self._node, topic, self._receive)

    def _add(self, topic: str) -> None:
        super()._add(topic)
        self._follow()

    def _select(self, chosen: RawInput | None, shown: str) -> None:
        super()._select(chosen, shown)
        self._follow()

    def _follow(self) -> None:
        """Open the inputs that are needed, and close the others."""
        with self._lock:
            idle = self._lazy and self._output.advertised
            for topic in self._topics.values():
                if idle and not (topic is self._selected and self._output.subscribed):
                    topic.close()
                else:
                    topic.open()

    def _receive(self, data: bytes, info: MessageInfo, source: RawInput) -> None:
        if not self._output.advertised:
            self._output.advertise(info, source)
            self._follow()
        if source is self._selected:
            self._output.publish(data, info, source)


class Demux(_TopicChoice[RawOutput]):
    """Pass a topic on to the selected one of several, at first the first one."""

    def __init__(self, node: Node, source: str, targets: list[str]) -> None:
        super().__init__(node, "demux")
        with self._lock:
            self._begin(targets)
        RawInput(node, source, self._receive).open()

    def _make(self, topic: str) -> RawOutput:
        return RawOutput(self._node, topic, latch=False)

    def _receive(self, data: bytes, info: MessageInfo, source: RawInput) -> None:
        with self._lock:
            outputs, selected = list(self._topics.values()), self._selected
        # All are announced, so that subscribers of those selected later are connected by then.
        for output in outputs:
            output.advertise(info, source)
        if selected is not None:
            selected.publish(data, info, source)


def mux() -> None:
    """Pass on the selected one of several topics."""
    _run(Mux, "mux OUT_TOPIC IN_TOPIC1 [IN_TOPIC2 ...]")


def demux() -> None:
    """Pass a topic on to the selected one of several."""
    _run(Demux, "demux IN_TOPIC OUT_TOPIC1 [OUT_TOPIC2 ...]")


def _run(kind: type[Mux | Demux], usage: str) -> None:
    given = list(parse(sys.argv[1:]).rest)
    if len(given) < 2:  # noqa: PLR2004
        sys.exit(f"usage: {usage}")
    with Node(f"{base_name(given[0])}_{kind.__name__.lower()}", anonymous=True) as node:
        serve_loggers(node)
        kind(node, given[0], given[1:])
        node.spin()


def call_service() -> None:
    """Call the service that the name of the program tells."""
    program = Path(sys.argv[0]).name
    kind, _, verb = program.partition("_")
    argument, doing = _VERBS[verb]
    given = list(parse(sys.argv[1:]).rest)
    if len(given) != 1 + bool(argument):
        sys.exit(f"usage: {program} {kind.upper()}_NAME {argument}".rstrip())
    name, *topic = given
    with Node(program, anonymous=True) as node:
        client = node.client(f"{name}/{verb}", _service_type(kind, verb))
        _say(f'Waiting for service "{name}/{verb}"')
        try:
            client.wait_for_service(_FOREVER)
            _say(doing.format(topic="".join(topic), kind=kind, name=name))
            response = client(*topic)
        except RoszError as error:
            if node.is_shutdown:
                return
            sys.exit(f"{program}: {error}")
        if verb == "list":
            _say(str(list(response.topics)))


def _service_type(kind: str, verb: str) -> type[Service]:
    """Return the type of a service, such as that of ``select`` of a ``mux``."""
    service: type[Service] = getattr(srv, f"{kind.title()}{verb.title()}")
    return service


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()
