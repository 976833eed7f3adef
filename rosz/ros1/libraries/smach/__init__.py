"""smach: hierarchical state machines in Python (ROS wiki, smach).

Nothing here needs a node; `smach_ros` has the states that use topics, services and actions.
"""

from __future__ import annotations

import threading
import traceback
from collections import abc
from collections.abc import Iterable, Mapping
from typing import Any

from rosz.ros1.libraries.smach import container
from rosz.ros1.libraries.smach.concurrence import Concurrence
from rosz.ros1.libraries.smach.container import Container
from rosz.ros1.libraries.smach.iterator import Iterator
from rosz.ros1.libraries.smach.state import CBState, State
from rosz.ros1.libraries.smach.user_data import Remapper, UserData
from rosz.ros1.libraries.smach.util import *  # noqa: F403
from rosz.ros1.libraries.smach.util import (
    InvalidConstructionError,
    InvalidStateError,
    InvalidTransitionError,
    InvalidUserCodeError,
    SmachError,
    is_shutdown,
    logdebug,
    logerr,
    loginfo,
    logwarn,
    set_loggers,
)

Transitions = dict[str, str | None]


class StateMachine(Container):
    """States, and for each of their outcomes the state or the outcome that follows."""

    def __init__(
        self,
        outcomes: Iterable[str],
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys)
        self._transitions: dict[str, Transitions] = {}
        self._remappings: dict[str, Mapping[str, str]] = {}
        self._constants: dict[str, Mapping[str, Any]] = {}
        self._initial_state_label: str | None = None
        self._current_label: str | None = None
        self._current_state: Any = None
        self._preempted_label: str | None = None
        self._preempted_state: Any = None
        self._last_added_label: str | None = None
        self._connector_outcomes: abc.Sequence[str] = ()
        # A callback, which runs while the lock is held, may request a preemption.
        self._state_transitioning_lock = threading.RLock()

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in vars(self).items() if k != "_state_transitioning_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._state_transitioning_lock = threading.RLock()

    @staticmethod
    def add(
        label: str,
        state: Any,
        transitions: Mapping[str, str | None] | None = None,
        remapping: Mapping[str, str] | None = None,
        constants: Mapping[str, Any] | None = None,
    ) -> Any:
        """Add a state to the open machine, and return it.

        Args:
            label: Name of the state in the machine.
            state: The state.
            transitions: For outcomes of the state, the label or outcome that follows; an outcome
                that is not named is that of the machine.
            remapping: For keys of the state, the keys of the machine's user data.
            constants: Values to put into the machine's user data before the state is executed.

        Raises:
            InvalidStateError: The label is in use, or no machine is open.
            InvalidTransitionError: The state has no such outcome.
        """
        self = StateMachine._currently_opened_container()
        given = dict(transitions or {})
        logdebug(f"adding state '{label}' with transitions {given}")
        if self._initial_state_label is None:
            self._initial_state_label = label
        self.check_state_spec(label, state, given)
        if label in self._states:
            raise InvalidStateError(f"cannot add state '{label}': the label is in use")
        self._states[label] = state
        self._transitions[label] = {**dict.fromkeys(state.get_registered_outcomes()), **given}
        self._remappings[label] = remapping or {}
        self._constants[label] = constants or {}
        if self._last_added_label is not None:
            for outcome in self._connector_outcomes:
                self._transitions[self._last_added_label][outcome] = label
            self._connector_outcomes, self._last_added_label = (), None
        return state

    @staticmethod
    def add_auto(
        label: str,
        state: Any,
        connector_outcomes: abc.Sequence[str],
        transitions: Mapping[str, str | None] | None = None,
        remapping: Mapping[str, str] | None = None,
        constants: Mapping[str, Any] | None = None,
    ) -> Any:
        """Add a state that leads to the one added next, by the connector outcomes; see `add`.

        Raises:
            InvalidStateError: The state has no such outcome.
        """
        self = StateMachine._currently_opened_container()
        StateMachine.add(label, state, transitions, remapping, constants)
        registered = state.get_registered_outcomes()
        if not set(connector_outcomes) <= set(registered):
            raise InvalidStateError(
                f"cannot connect state '{label}' by outcomes {list(connector_outcomes)}: it has"
                f" only {list(registered)}"
            )
        self._last_added_label = label
        self._connector_outcomes = connector_outcomes
        return state

    def execute(self, parent_ud: Any = None) -> Any:
        """Execute states, from the initial one until the machine has an outcome.

        Returns:
            The outcome; None if the machine is not consistent or the program ends.

        Raises:
            InvalidUserCodeError: A state failed.
            InvalidTransitionError: A state returned a value that is not one of its outcomes.
        """
        with self._state_transitioning_lock:
            if not self._is_consistent():
                return None
            self._is_running = True
            self._preempted_label = self._preempted_state = None
            self._set_current_state(self._initial_state_label)
            self._copy_input_keys(parent_ud, self.userdata)
            loginfo(
                f"State machine starting in initial state '{self._current_label}' with userdata:"
                f" \n\t{self.userdata.keys()}"
            )
            self.call_start_cbs()
        outcome = None
        try:
            while outcome is None and self._is_running and not is_shutdown():
                outcome = self._update_once()
            self._copy_output_keys(self.userdata, parent_ud)
        finally:
            self._is_running = False
        return outcome

    def _update_once(self) -> str | None:
        """Execute the current state, and go on to the next."""
        with self._state_transitioning_lock:
            label, state = self._current_label, self._current_state
            if label is None or label not in self._states:
                raise InvalidStateError(f"no state '{label}'; there are {list(self._states)}")
            if self.preempt_requested():
                self._pass_preempt_on()
        for key, value in self._constants[label].items():
            self.userdata[key] = value
        what = f"state '{label}' of type '{state}'"
        outcome = container.execute_state(what, state, self.userdata, self._remappings[label])
        with self._state_transitioning_lock:
            return self._follow(label, state, outcome)

    def _pass_preempt_on(self) -> None:
        """Preempt the state that comes next, unless the last one has ended because of it."""
        loginfo("Preempt requested on state machine before executing the next state.")
        if self._preempted_state is None or self._preempted_state.preempt_requested():
            self._preempt_current_state()
        else:
            self._preempt_requested = False
            self._preempted_state = None

    def _follow(self, label: str, state: Any, outcome: Any) -> str | None:
        """Go on to the next state; return the outcome of the machine if there is none."""
        if outcome not in state.get_registered_outcomes():
            raise InvalidTransitionError(
                f"state '{label}' of type '{state}' returned '{outcome}'; expected one of"
                f" {list(state.get_registered_outcomes())}"
            )
        target = self._transitions[label].get(outcome)
        if target in self._states:
            self._set_current_state(target)
            loginfo(f"State machine transitioning '{label}':'{outcome}'-->'{target}'")
            self.call_transition_cbs()
            return None
        preempted = self._preempt_requested and self._preempted_state is not None
        if preempted and not state.preempt_requested():
            self.service_preempt()
        ends = self.get_registered_outcomes()
        final = outcome if target is None or target not in ends else target
        if final not in ends:
            raise InvalidTransitionError(
                f"outcome '{outcome}' of state '{label}' leads to '{target}', which is neither a"
                f" state nor an outcome of the machine: {list(ends)}"
            )
        self._set_current_state(None)
        loginfo(f"State machine terminating '{label}':'{outcome}':'{final}'")
        self.call_termination_cbs([label], final)
        return str(final)

    def _set_current_state(self, state_label: str | None) -> None:
        self._current_label = state_label
        self._current_state = None if state_label is None else self._states[state_label]

    def request_preempt(self) -> None:
        """Request that the machine and its current state end soon."""
        with self._state_transitioning_lock:
            self._preempt_requested = True
            if self._current_state is not None:
                self._preempt_current_state()

    def _preempt_current_state(self) -> None:
        if self._preempted_state is self._current_state:
            return
        if self._preempted_state is not None:
            self._preempted_state.recall_preempt()
        self._preempted_state, self._preempted_label = self._current_state, self._current_label
        try:
            self._preempted_state.request_preempt()
        except Exception:  # noqa: BLE001  # the callback boundary
            text = traceback.format_exc()
            logerr(f"Failed to preempt contained state '{self._preempted_label}': {text}")

    def set_initial_state(self, initial_states: abc.Sequence[str], userdata: Any = None) -> None:
        """Set the state to begin with, and user data; further states give a warning."""
        if len(initial_states) > 1:
            logwarn(f"a state machine begins with one state: the first of {list(initial_states)}")
        if initial_states:
            self._initial_state_label = initial_states[0]
        self.userdata.update(UserData() if userdata is None else userdata)

    def get_active_states(self) -> list[str]:
        """Return the label of the current state."""
        return [str(self._current_label)]

    def get_initial_states(self) -> list[str]:
        """Return the label of the state to begin with."""
        return [str(self._initial_state_label)]

    def get_internal_edges(self) -> list[Any]:
        """Return the edges: outcome, label, and label or outcome to go to."""
        return [
            (outcome, label, target)
            for label, transitions in self._transitions.items()
            for outcome, target in transitions.items()
        ]

    def check_state_spec(
        self, label: str, state: Any, transitions: Mapping[str, str | None]
    ) -> None:
        """Check that a state has the outcomes that its transitions name.

        Raises:
            InvalidTransitionError: It has not.
        """
        registered = state.get_registered_outcomes()
        for outcome in transitions:
            if outcome not in registered:
                raise InvalidTransitionError(
                    f"state '{label}' has no outcome '{outcome}'; it has {list(registered)}"
                )

    def check_consistency(self) -> None:
        """Check that each transition leads to a state or an outcome of the machine."""
        ends = set(self.get_registered_outcomes())
        mistakes = []
        if self._initial_state_label is None:
            mistakes.append("No initial state set.")
        elif self._initial_state_label not in self._states:
            mistakes.append(f"Initial state '{self._initial_state_label}' is not in the machine.")
        for label, transitions in self._transitions.items():
            targets = {target for target in transitions.values() if target}
            unknown = sorted(targets - ends - self._states.keys())
            unnamed = {outcome for outcome, target in transitions.items() if not target}
            if unknown:
                mistakes.append(f"State '{label}' references unknown states: {unknown}")
            if unnamed - ends:
                mistakes.append(
                    f"State '{label}' references unregistered outcomes: {sorted(unnamed - ends)}"
                )
        if mistakes:
            raise InvalidTransitionError(
                "\n\t".join(("State machine failed consistency check:", *mistakes))
                + f"\n\n\tAvailable states: {sorted(ends | self._states.keys())}"
            )


class Sequence(StateMachine):
    """States that follow each other.

    Args:
        outcomes: As for `Container`, as are ``input_keys`` and ``output_keys``.
        connector_outcome: Outcome of each state that leads to the next.
    """

    def __init__(
        self,
        outcomes: Iterable[str],
        connector_outcome: str,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys)
        self._connector_outcome = connector_outcome
        self._last_added_seq_label: str | None = None

    @staticmethod
    def add(  # type: ignore[override]  # smach's
        label: str,
        state: Any,
        transitions: Mapping[str, str | None] | None = None,
        remapping: Mapping[str, str] | None = None,
    ) -> Any:
        """Add a state to the open sequence; see `StateMachine.add`."""
        self = Sequence._currently_opened_container()
        StateMachine.add(label, state, transitions, remapping)
        last, self._last_added_seq_label = self._last_added_seq_label, label
        if last is not None:
            before = self._transitions[last]
            if before.get(self._connector_outcome) is None:
                before[self._connector_outcome] = label
                self.check_state_spec(last, self._states[last], before)
        return state
