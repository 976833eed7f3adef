"""Managed nodes of rclpy: their states, seen from inside and by their services."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.msgs.lifecycle_msgs.msg import Transition, TransitionEvent
from rosz.msgs.lifecycle_msgs.srv import (
    ChangeState,
    GetAvailableStates,
    GetAvailableTransitions,
    GetState,
)
from rosz.msgs.std_msgs.msg import Int32
from rosz.ros2.rclpy import executors
from rosz.ros2.rclpy.lifecycle import (
    LifecycleNode,
    LifecyclePublisher,
    LifecycleState,
    SimpleManagedEntity,
    TransitionCallbackReturn,
    TransitionError,
)

from .conftest import Start

SUCCESS, FAILURE, ERROR = TransitionCallbackReturn


class Recorded(LifecycleNode):
    """A managed node that records its callbacks, and returns what a test wants."""

    def __init__(self, start: Start, **options: Any) -> None:
        super().__init__("managed", context=start(), **options)
        self.calls: list[tuple[str, str]] = []
        self.results: dict[str, Any] = {}
        self.runner = executors.SingleThreadedExecutor(context=self.context)
        self.runner.add_node(self)

    def _record(self, name: str, state: LifecycleState) -> Any:
        self.calls.append((name, state.label))
        result = self.results.get(name, SUCCESS)
        if isinstance(result, Exception):
            raise result
        inherited: Callable[[LifecycleState], Any] = getattr(super(), name)
        return inherited(state) if result is SUCCESS else result

    def on_configure(self, state: LifecycleState) -> Any:
        return self._record("on_configure", state)

    def on_activate(self, state: LifecycleState) -> Any:
        return self._record("on_activate", state)

    def on_error(self, state: LifecycleState) -> Any:
        return self._record("on_error", state)

    @property
    def state(self) -> str:
        return self._rosz_state.label

    def spin_until(self, condition: Callable[[], object], what: str) -> None:
        def look() -> object:
            self.runner.spin_once(timeout_sec=0.01)
            return condition()

        eventually(look, what)


def test_the_states_of_a_life(start: Start) -> None:
    node = Recorded(start)
    assert node.state == "unconfigured"
    assert node.trigger_configure() is SUCCESS
    assert node.state == "inactive"
    assert node.trigger_activate() is SUCCESS
    assert node.state == "active"
    assert node.trigger_deactivate() is node.trigger_cleanup() is SUCCESS
    assert node.state == "unconfigured"
    assert node.trigger_shutdown() is SUCCESS
    assert node.state == "finalized"
    assert node.calls == [("on_configure", "unconfigured"), ("on_activate", "inactive")]
    with pytest.raises(TransitionError, match="'finalized' has no transition 'configure'"):
        node.trigger_configure()


@pytest.mark.parametrize(
    ("result", "recovery", "state"),
    [
        (FAILURE, SUCCESS, "inactive"),
        (ERROR, SUCCESS, "unconfigured"),
        (ERROR, FAILURE, "finalized"),
        (ERROR, ERROR, "finalized"),
        (ValueError("broken"), SUCCESS, "unconfigured"),
        ("no result", SUCCESS, "unconfigured"),
    ],
)
def test_callbacks_that_do_not_succeed(
    start: Start, result: Any, recovery: Any, state: str
) -> None:
    node = Recorded(start)
    node.trigger_configure()
    node.results = {"on_activate": result, "on_error": recovery}
    expected = result if isinstance(result, TransitionCallbackReturn) else ERROR
    assert node.trigger_activate() is expected
    assert node.state == state
    assert (("on_error", "inactive") in node.calls) == (expected is ERROR)


def test_publishers_and_other_parts_take_part(start: Start) -> None:
    node = Recorded(start)
    part = SimpleManagedEntity()
    node.add_managed_entity(part)
    heard: list[int] = []
    publisher = node.create_lifecycle_publisher(Int32, "n", 10)
    assert isinstance(publisher, LifecyclePublisher)
    node.create_subscription(Int32, "n", lambda message: heard.append(message.data), 10)
    eventually(lambda: publisher.get_subscription_count() == 1, "the link")
    publisher.publish(Int32(1))
    node.trigger_configure()
    publisher.publish(Int32(2))
    node.trigger_activate()
    assert part.is_activated
    publisher.publish(Int32(3))
    node.spin_until(lambda: heard, "the message of the active node")
    assert heard == [3]
    node.trigger_deactivate()
    assert not part.is_activated
    assert not publisher.is_activated
    assert node.destroy_lifecycle_publisher(publisher)
    with pytest.raises(TypeError, match="expected a ManagedEntity, got int"):
        node.add_managed_entity(1)


def test_a_method_that_works_when_enabled() -> None:
    calls: list[str] = []

    class Part(SimpleManagedEntity):
        @SimpleManagedEntity.when_enabled(  # type: ignore[untyped-decorator]
            when_not_enabled=lambda: calls.append("off")
        )
        def work(self, name: str) -> None:
            calls.append(name)

    part = Part()
    part.work("too early")
    part.on_activate(LifecycleState("inactive", 2))
    part.work("now")
    assert calls == ["off", "now"]


def test_others_change_the_state(start: Start, network: Network) -> None:
    node = Recorded(start)
    other = network.node("other")
    events: list[TransitionEvent] = []
    other.subscription("/managed/transition_event", TransitionEvent, events.append)

    def call(kind: Any, name: str, *fields: Any) -> Any:
        future = node.runner.create_task(lambda: None)
        answers: list[Any] = []
        client = other.client(f"/managed/{name}", kind)
        client.wait_for_service(TIMEOUT)
        thread = network.thread(lambda: answers.append(client.call(kind.Request(*fields))))
        node.spin_until(lambda: answers, f"the response of {name}")
        thread.join(TIMEOUT)
        assert future.done()
        return answers[0]

    assert call(GetState, "get_state").current_state.label == "unconfigured"
    labels = [
        state.label for state in call(GetAvailableStates, "get_available_states").available_states
    ]
    assert labels[:5] == ["unknown", "unconfigured", "inactive", "active", "finalized"]
    assert len(labels) == 11
    possible = call(GetAvailableTransitions, "get_available_transitions").available_transitions
    assert [
        (each.transition.id, each.transition.label, each.goal_state.label) for each in possible
    ] == [
        (1, "configure", "configuring"),
        (5, "shutdown", "shuttingdown"),
    ]
    graph = call(GetAvailableTransitions, "get_transition_graph").available_transitions
    assert len(graph) == 25
    assert call(ChangeState, "change_state", Transition(Transition.TRANSITION_CONFIGURE)).success
    assert not call(
        ChangeState, "change_state", Transition(Transition.TRANSITION_CLEANUP, "x")
    ).success
    assert call(ChangeState, "change_state", Transition(0, "activate")).success
    assert call(GetState, "get_state").current_state.id == 3
    eventually(lambda: len(events) >= 4, "the events")
    assert [(event.start_state.label, event.goal_state.label) for event in events] == [
        ("unconfigured", "configuring"),
        ("configuring", "inactive"),
        ("inactive", "activating"),
        ("activating", "active"),
    ]


def test_without_services(start: Start, network: Network) -> None:
    node = Recorded(start, enable_communication_interface=False)
    node.trigger_configure()
    names = [name for name, _ in node.get_service_names_and_types()]
    assert not [name for name in names if name.startswith("/managed/") and "state" in name]
    assert network
