"""Recording the parameters: all of them at the begin of each bag, and every change.

Changes are messages of ROS 2's type on ``/parameter_events``, which any tool can read. The metadata
``parameters`` has all values as YAML, also those that ROS 2 has no type for.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from rosz.bags.bag import Channel
from rosz.bags.messages import described
from rosz.bags.record.recording import BagFiles, Sink
from rosz.errors import BagError, ClosedError, NoReplica, RoszError
from rosz.lifecycle import Closable, Closing
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.rcl_interfaces.msg import Parameter, ParameterEvent
from rosz.node.ros2 import to_ros2
from rosz.params import Value, joined, leaves, split
from rosz.params.replica import ParamClient
from rosz.qos import PARAMETERS
from rosz.worker import Worker

if TYPE_CHECKING:
    from rosz.node import Node
    from rosz.params.replica import Changed, Follower

_TOPIC = "/parameter_events"
_RETRY_SECONDS = 1.0
_SECOND = 1_000_000_000


class ParameterRecord(Closing):
    """Records the parameters of a network.

    Where no process holds parameters yet, it looks again until one does.

    Args:
        node: Node whose session it uses.
        sink: The destination of the changes; bags also get all parameters at once.
        report: Function called with a sentence for the user.
    """

    def __init__(self, node: Node, sink: Sink, report: Callable[[str], object]) -> None:
        self._node = node
        self._sink = sink
        self._report = report
        self._follower: Follower | None = None
        self._parts: list[Closable] = []
        cls = ParameterEvent
        self._channel = Channel(_TOPIC, cls._type_name, qos=(PARAMETERS,), **described(cls))
        self._track = sink.track(self._channel, node.context.types)
        self._worker: Worker[Callable[[], object]] = Worker("rosz-bag-parameters")
        self._worker.submit(self._connect)

    def _connect(self) -> None:
        context = self._node.context
        try:
            follower = ParamClient(context.session, context.domain).follow()
        except NoReplica:
            self._worker.later(_RETRY_SECONDS, self._connect)
            return
        except ClosedError:
            return
        except RoszError as error:
            self._report(f"WARNING: parameters are not recorded: {error}")
            return
        self._follower = follower
        self._parts = [follower.watch("/", self._on_change), follower]
        if isinstance(self._sink, BagFiles):
            self.begin(self._sink)

    def begin(self, files: BagFiles) -> None:
        """Write all parameters into a bag that has been opened.

        Raises:
            BagError: The file cannot be written.
        """
        if self._follower is None:
            return
        from rosz.params.yaml import dump  # PyYAML takes 3 MB, and there may be no parameters

        tree = self._follower.get("/")
        files.add_metadata("parameters", {"yaml": dump(tree)})
        rows = [Parameter(name, to_ros2(value)) for name, value in _leaves("/", tree).items()]
        self._write(files, ParameterEvent(new_parameters=rows), self._node.now())

    def _on_change(self, change: Changed) -> None:
        event = ParameterEvent(node="")
        old = _leaves(change.name, change.old)
        new = _leaves(change.name, change.new)
        for name, value in new.items():
            if name not in old:
                event.new_parameters.append(Parameter(name, to_ros2(value)))
            elif old[name] != value:
                event.changed_parameters.append(Parameter(name, to_ros2(value)))
        event.deleted_parameters = [
            Parameter(name, to_ros2(value)) for name, value in old.items() if name not in new
        ]
        with suppress(BagError):  # the recorder sees it too
            self._write(self._sink, event, change.time)

    def _write(self, sink: Sink, event: ParameterEvent, sent: int) -> None:
        now = self._node.now()
        event.stamp = Time(*divmod(now, _SECOND))
        track = self._track
        if sink is not self._sink:
            track = sink.track(self._channel, self._node.context.types)
        sink.write(track, now, event.to_cdr(), sent, 0)

    def close(self) -> None:
        """Stop following the parameters; a second call has no effect."""
        self._worker.close()
        for part in self._parts:
            part.close()


def _leaves(name: str, value: Value) -> dict[str, Value]:
    """Return the parameters at or below a name that are not dictionaries, by full names."""
    return {joined(path): leaf for path, leaf in leaves(value, split(name)) if leaf is not None}
