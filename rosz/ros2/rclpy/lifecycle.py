"""rclpy.lifecycle: managed nodes, whose states others may see and change.

The states and transitions are those of ROS 2's design article "Managed nodes", with the numbers of
lifecycle_msgs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from enum import Enum
from functools import partialmethod, wraps
from typing import Any, NamedTuple

from rosz.errors import RoszError
from rosz.msgs.lifecycle_msgs import srv
from rosz.msgs.lifecycle_msgs.msg import State as StateMessage
from rosz.msgs.lifecycle_msgs.msg import Transition, TransitionDescription, TransitionEvent
from rosz.ros2.rclpy.entities import Publisher as PlainPublisher
from rosz.ros2.rclpy.executors import CallbackGroup
from rosz.ros2.rclpy.node import Node as PlainNode


class TransitionError(RoszError):
    """No transition of that kind begins in the state of the node."""


class TransitionCallbackReturn(Enum):
    """The result of a callback of a transition."""

    SUCCESS = Transition.TRANSITION_CALLBACK_SUCCESS
    FAILURE = Transition.TRANSITION_CALLBACK_FAILURE
    ERROR = Transition.TRANSITION_CALLBACK_ERROR

    def to_label(self) -> str:
        """Return the label of the transition that ends the one of the callback."""
        return f"transition_{self.name.lower()}"


class LifecycleState(NamedTuple):
    """A state: its name and its number."""

    label: str
    state_id: int


class _Edge(NamedTuple):
    """A transition: its number, its label, and its two states."""

    number: int
    label: str
    start: LifecycleState
    goal: LifecycleState


def _all_states() -> Iterator[LifecycleState]:
    for constant in vars(StateMessage):
        _, state, label = constant.rpartition("_STATE_")
        if state:
            yield LifecycleState(label.lower(), getattr(StateMessage, constant))


_STATES = {state.label: state for state in sorted(_all_states(), key=lambda state: state.state_id)}


def _edges(
    label: str, begins: dict[int, str], transient: str, results: int, goals: tuple[str, str, str]
) -> list[_Edge]:
    """Return the transitions into and out of a transient state.

    Args:
        label: Label of those that lead into it.
        begins: Their numbers, and the states where they start.
        transient: The state.
        results: Number of the transition for success; failure and error follow.
        goals: States that success, failure and error lead to.
    """
    state = _STATES[transient]
    into = [_Edge(number, label, _STATES[start], state) for number, start in begins.items()]
    return into + [
        _Edge(results + index, result.to_label(), state, _STATES[goal])
        for index, (result, goal) in enumerate(zip(TransitionCallbackReturn, goals, strict=True))
    ]


_FAULT = "errorprocessing"
_ENDS = {5: "unconfigured", 6: "inactive", 7: "active"}
_EDGES = (
    *_edges(
        "configure", {1: "unconfigured"}, "configuring", 10, ("inactive", "unconfigured", _FAULT)
    ),
    *_edges("cleanup", {2: "inactive"}, "cleaningup", 20, ("unconfigured", "inactive", _FAULT)),
    *_edges("activate", {3: "inactive"}, "activating", 30, ("active", "inactive", _FAULT)),
    *_edges("deactivate", {4: "active"}, "deactivating", 40, ("inactive", "active", _FAULT)),
    *_edges("shutdown", _ENDS, "shuttingdown", 50, ("finalized", "finalized", _FAULT)),
    *_edges("", {}, _FAULT, 60, ("unconfigured", "finalized", "finalized")),
)
_CALLBACKS = {
    "configuring": "on_configure",
    "cleaningup": "on_cleanup",
    "activating": "on_activate",
    "deactivating": "on_deactivate",
    "shuttingdown": "on_shutdown",
    _FAULT: "on_error",
}
_Result = TransitionCallbackReturn


class ManagedEntity:
    """A part of a managed node that takes part in its transitions."""

    def _rosz_all(self, callback: str, state: LifecycleState) -> _Result:  # noqa: ARG002
        """Call a callback of the entities that belong to this one, which has none."""
        return _Result.SUCCESS

    def on_configure(self, state: LifecycleState) -> _Result:
        """Prepare to work, coming from a state."""
        return self._rosz_all("on_configure", state)

    def on_cleanup(self, state: LifecycleState) -> _Result:
        """Undo what `on_configure` did."""
        return self._rosz_all("on_cleanup", state)

    def on_shutdown(self, state: LifecycleState) -> _Result:
        """Prepare for the end."""
        return self._rosz_all("on_shutdown", state)

    def on_activate(self, state: LifecycleState) -> _Result:
        """Begin to work."""
        return self._rosz_all("on_activate", state)

    def on_deactivate(self, state: LifecycleState) -> _Result:
        """Stop working."""
        return self._rosz_all("on_deactivate", state)

    def on_error(self, state: LifecycleState) -> _Result:
        """Recover from an error of another callback."""
        return self._rosz_all("on_error", state)


class SimpleManagedEntity(ManagedEntity):
    """A managed entity that works only while it is activated."""

    def __init__(self) -> None:
        self._enabled = False

    def on_activate(self, state: LifecycleState) -> _Result:  # noqa: ARG002
        """Begin to work."""
        self._enabled = True
        return _Result.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> _Result:  # noqa: ARG002
        """Stop working."""
        self._enabled = False
        return _Result.SUCCESS

    @property
    def is_activated(self) -> bool:
        """Whether the entity is activated."""
        return self._enabled

    @staticmethod
    def when_enabled(
        wrapped: Callable[..., Any] | None = None,
        *,
        when_not_enabled: Callable[..., Any] | None = None,
    ) -> Any:
        """Decorate a method that has an effect only while the entity is activated.

        Args:
            wrapped: The method.
            when_not_enabled: Function to call instead while it is not activated.
        """

        def decorate(method: Callable[..., Any]) -> Callable[..., None]:
            @wraps(method)
            def call(self: SimpleManagedEntity, *args: Any, **options: Any) -> None:
                if self.is_activated:
                    method(self, *args, **options)
                elif when_not_enabled is not None:
                    when_not_enabled()

            return call

        return decorate if wrapped is None else decorate(wrapped)


class LifecyclePublisher(SimpleManagedEntity, PlainPublisher):
    """A publisher whose messages are dropped while its node is not active."""

    def __init__(self, *args: Any, **options: Any) -> None:
        SimpleManagedEntity.__init__(self)
        PlainPublisher.__init__(self, *args, **options)

    def publish(self, msg: Any) -> None:
        """Publish a message if the node is active; see `rclpy.publisher.Publisher.publish`."""
        if self.is_activated:
            super().publish(msg)


class LifecycleNodeMixin(ManagedEntity):
    """The states of a managed node, for a class that derives from `rclpy.node.Node` as well.

    Callbacks of transitions that are not overridden call those of the managed entities.

    Args:
        enable_communication_interface: Whether others may see and change the state, by services
            and the topic ``~/transition_event``.
        callback_group: Group of the services; the node's default group when not given.
    """

    def __init__(
        self,
        *,
        enable_communication_interface: bool = True,
        callback_group: CallbackGroup | None = None,
    ) -> None:
        self._rosz_state = _STATES["unconfigured"]
        self._rosz_managed: list[ManagedEntity] = []
        self._rosz_events: PlainPublisher | None = None
        if enable_communication_interface:
            self._rosz_serve(callback_group)

    _rosz_self: Any = property(lambda self: self)  # a node, which the type checker cannot know

    def _rosz_serve(self, group: CallbackGroup | None) -> None:
        name = self._rosz_self.get_fully_qualified_name()

        def offer(kind: type[Any], service: str, field: str, value: Callable[[Any], Any]) -> None:
            def respond(request: Any, response: Any) -> Any:
                setattr(response, field, value(request))
                return response

            self._rosz_self.create_service(kind, f"{name}/{service}", respond, callback_group=group)

        offer(srv.ChangeState, "change_state", "success", self._rosz_change_state)
        offer(srv.GetState, "get_state", "current_state", lambda _: _message(self._rosz_state))
        states = list(map(_message, _STATES.values()))
        offer(srv.GetAvailableStates, "get_available_states", "available_states", lambda _: states)
        kind, field = srv.GetAvailableTransitions, "available_transitions"
        offer(kind, "get_available_transitions", field, lambda _: _described(self._rosz_edges()))
        offer(kind, "get_transition_graph", field, lambda _: _described(_EDGES))
        # Not `self.create_publisher`, which a subclass may have overridden.
        self._rosz_events = PlainNode.create_publisher(
            self._rosz_self, TransitionEvent, f"{name}/transition_event", 10
        )

    def _rosz_edges(self) -> Iterable[_Edge]:
        return [edge for edge in _EDGES if edge.start == self._rosz_state]

    def _rosz_change_state(self, request: Any) -> bool:
        wanted = request.transition
        for edge in self._rosz_edges():
            if edge.label == wanted.label or (not wanted.label and edge.number == wanted.id):
                return self._rosz_run(edge) is _Result.SUCCESS
        self._rosz_self.get_logger().error(
            f"no transition '{wanted.label or wanted.id}' from the state '{self._rosz_state.label}'"
        )
        return False

    def _rosz_trigger(self, label: str) -> _Result:
        """Pass a transition, and return the result of its callback.

        Raises:
            TransitionError: The state of the node does not allow it.
        """
        for edge in self._rosz_edges():
            if edge.label == label:
                return self._rosz_run(edge)
        raise TransitionError(
            f"a node in the state '{self._rosz_state.label}' has no transition '{label}'"
        )

    def _rosz_run(self, edge: _Edge) -> _Result:
        """Pass a transition, with its callback, and return the callback's result."""
        before = self._rosz_state
        self._rosz_enter(edge)
        result = self._rosz_call(before)
        self._rosz_finish(result)
        if result is _Result.ERROR:
            self._rosz_finish(self._rosz_call(before))
        return result

    def _rosz_finish(self, result: _Result) -> None:
        label = result.to_label()
        self._rosz_enter(next(edge for edge in self._rosz_edges() if edge.label == label))

    def _rosz_call(self, before: LifecycleState) -> _Result:
        """Call the callback of the present state."""
        name = _CALLBACKS[self._rosz_state.label]
        try:
            result = getattr(self, name)(before)
        except Exception as error:  # noqa: BLE001  # leads to error processing, as in rclpy
            self._rosz_self.rosz_node.log.report(f"{name} failed", error)
            return _Result.ERROR
        if not isinstance(result, _Result):
            self._rosz_self.get_logger().error(
                f"{name} returned {result!r}; expected a TransitionCallbackReturn"
            )
            return _Result.ERROR
        return result

    def _rosz_enter(self, edge: _Edge) -> None:
        self._rosz_state = edge.goal
        if self._rosz_events is not None:
            now = self._rosz_self.get_clock().now().nanoseconds
            changed = _description(edge)
            self._rosz_events.publish(
                TransitionEvent(now, changed.transition, changed.start_state, changed.goal_state)
            )

    def _rosz_all(self, callback: str, state: LifecycleState) -> _Result:
        """Call a callback of each managed entity until one does not succeed."""
        for entity in self._rosz_managed:
            result: _Result = getattr(entity, callback)(state)
            if result is not _Result.SUCCESS:
                return result
        return _Result.SUCCESS

    trigger_configure = partialmethod(_rosz_trigger, "configure")
    trigger_cleanup = partialmethod(_rosz_trigger, "cleanup")
    trigger_activate = partialmethod(_rosz_trigger, "activate")
    trigger_deactivate = partialmethod(_rosz_trigger, "deactivate")
    trigger_shutdown = partialmethod(_rosz_trigger, "shutdown")

    def add_managed_entity(self, entity: ManagedEntity) -> None:
        """Let an entity take part in the transitions.

        Raises:
            TypeError: It is not a `ManagedEntity`.
        """
        if not isinstance(entity, ManagedEntity):
            raise TypeError(f"expected a ManagedEntity, got {type(entity).__name__}")
        if entity not in self._rosz_managed:
            self._rosz_managed.append(entity)

    def create_lifecycle_publisher(
        self, msg_type: type[Any], topic: str, qos_profile: Any, **options: Any
    ) -> LifecyclePublisher:
        """Create a publisher that sends only while the node is active.

        The arguments are those of `rclpy.node.Node.create_publisher`.
        """
        options |= {"publisher_class": LifecyclePublisher}
        made: Any = PlainNode.create_publisher(
            self._rosz_self, msg_type, topic, qos_profile, **options
        )
        self.add_managed_entity(made)
        return made  # type: ignore[no-any-return]

    def destroy_lifecycle_publisher(self, publisher: LifecyclePublisher) -> bool:
        """Close a publisher; return whether it belonged to the node."""
        if publisher in self._rosz_managed:
            self._rosz_managed.remove(publisher)
        return bool(self._rosz_self.destroy_publisher(publisher))


class LifecycleNode(LifecycleNodeMixin, PlainNode):
    """A managed node.

    Args:
        node_name: Base name; ``__node:=`` on the command line overrides it.
        enable_communication_interface: Whether others may see and change the state.
        options: Options of `rclpy.node.Node`.
    """

    def __init__(
        self, node_name: str, *, enable_communication_interface: bool = True, **options: Any
    ) -> None:
        PlainNode.__init__(self, node_name, **options)
        LifecycleNodeMixin.__init__(
            self, enable_communication_interface=enable_communication_interface
        )


def _message(state: LifecycleState) -> StateMessage:
    return StateMessage(state.state_id, state.label)


def _description(edge: _Edge) -> TransitionDescription:
    return TransitionDescription(
        Transition(edge.number, edge.label), _message(edge.start), _message(edge.goal)
    )


def _described(edges: Iterable[_Edge]) -> list[TransitionDescription]:
    return list(map(_description, edges))


Node = LifecycleNode
NodeMixin = LifecycleNodeMixin
Publisher = LifecyclePublisher
State = LifecycleState
