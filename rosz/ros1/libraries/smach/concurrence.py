"""smach.concurrence: a container that executes all its states at once."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rosz.ros1.libraries.smach import util
from rosz.ros1.libraries.smach.container import Container, execute_state, run_user_code

_CHECK_PERIOD = 0.1
"""Seconds after which a wait looks whether the program ends."""

OutcomeMap = Mapping[str, Mapping[str, str]]


class Concurrence(Container):
    """States that are executed at once, each on a thread of its own.

    Args:
        outcomes: As for `Container`, as are ``input_keys`` and ``output_keys``.
        default_outcome: Outcome if neither the map nor the function says another.
        outcome_map: For outcomes, the outcomes of states that lead to them, by label; of several
            that apply the one with most states counts.
        outcome_cb: Function called with the outcomes of the states, which returns the outcome or
            None.
        child_termination_cb: Function called with the outcomes so far whenever a state has ended;
            if it returns true, the other states are preempted.

    Raises:
        InvalidStateError: The outcomes do not fit together.
    """

    def __init__(  # noqa: PLR0917  # smach's
        self,
        outcomes: Iterable[str],
        default_outcome: str,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        outcome_map: OutcomeMap | None = None,
        outcome_cb: Callable[..., Any] | None = None,
        child_termination_cb: Callable[..., Any] | None = None,
    ) -> None:
        declared = tuple(outcomes)
        super().__init__(declared, input_keys, output_keys)
        mistakes = [
            f"'{name}' is not an outcome of the concurrence"
            for name in (default_outcome, *(outcome_map or ()))
            if name not in declared
        ]
        mistakes += [
            f"{name} is not callable"
            for name, function in (
                ("outcome_cb", outcome_cb),
                ("child_termination_cb", child_termination_cb),
            )
            if function and not callable(function)
        ]
        if mistakes:
            raise util.InvalidStateError(
                "\n\t".join(("invalid outcomes of a concurrence:", *mistakes))
            )
        self._default_outcome = default_outcome
        self._outcome_map: OutcomeMap = outcome_map or {}
        self._outcome_cb = outcome_cb
        self._child_termination_cb = child_termination_cb
        self._remappings: dict[str, Mapping[str, str]] = {}
        self._child_outcomes: dict[str, Any] = {}
        self._done_cond = threading.Condition()
        self._ended_early = False
        self._failed = False

    @staticmethod
    def add(label: str, state: Any, remapping: Mapping[str, str] | None = None) -> Any:
        """Add a state to the open concurrence, and return it.

        Args:
            label: Name of the state in the container.
            state: The state.
            remapping: For keys of the state, the keys of the container's user data.

        Raises:
            InvalidStateError: No concurrence is open.
        """
        self = Concurrence._currently_opened_container()
        self._states[label] = state
        self._remappings[label] = remapping or {}
        return state

    def execute(self, parent_ud: Any = None) -> Any:
        """Execute all states, until all have ended.

        Returns:
            The outcome; ``preempted`` if the container was preempted and all states ended then.

        Raises:
            InvalidStateError: There is no state, or a state failed.
            InvalidUserCodeError: The function that chooses the outcome failed.
        """
        if not self._states:
            raise util.InvalidStateError("cannot execute a concurrence without states")
        self._ended_early = self._failed = False
        self._child_outcomes = {}
        self._copy_input_keys(parent_ud, self.userdata)
        util.loginfo(f"Concurrence starting with userdata: \n\t{self.userdata.keys()}")
        self.call_start_cbs()
        self._is_running = True
        try:
            self._run()
            if self._failed:
                raise util.InvalidStateError("a state of a concurrence failed")
            serviced = self.preempt_requested() and self._serviced_preempt()
            outcome = "preempted" if serviced else self._choose()
        finally:
            self._is_running = False
        self._child_outcomes = {}
        self.call_termination_cbs(list(self._states), outcome)
        self._copy_output_keys(self.userdata, parent_ud)
        return outcome

    def _run(self) -> None:
        """Execute the states on threads; preempt those that run when the end is decided."""
        self._child_outcomes = dict.fromkeys(self._states)
        threads = [
            threading.Thread(name=f"concurrent_split:{label}", target=self._run_state, args=[label])
            for label in self._states
        ]
        for thread in threads:
            thread.start()
        with self._done_cond:
            while not self._is_decided():
                self._done_cond.wait(_CHECK_PERIOD)
        for label in self.get_active_states():
            self._states[label].request_preempt()
        for thread in threads:
            while thread.is_alive() and not util.is_shutdown():
                thread.join(_CHECK_PERIOD)

    def _is_decided(self) -> bool:
        over = self._ended_early or self._failed or self.preempt_requested()
        return over or not self.get_active_states() or util.is_shutdown()

    def _run_state(self, label: str) -> None:
        try:
            self._child_outcomes[label] = self._outcome_of(label)
            with self._done_cond:
                self.call_transition_cbs()
                if self._child_termination_cb and run_user_code(
                    "the child termination callback",
                    self._child_termination_cb,
                    self._child_outcomes,
                ):
                    self._ended_early = True
        except util.SmachError:  # which has written itself to the log
            self._failed = True
        finally:
            with self._done_cond:
                self._done_cond.notify_all()

    def _outcome_of(self, label: str) -> Any:
        """Execute a state, and return its outcome."""
        what = f"concurrent state '{label}'"
        outcome = execute_state(what, self._states[label], self.userdata, self._remappings[label])
        if outcome is None:
            raise util.InvalidStateError(f"concurrent state '{label}' returned no outcome")
        util.loginfo(f"Concurrent state '{label}' returned outcome '{outcome}' on termination.")
        return outcome

    def _serviced_preempt(self) -> bool:
        """Return whether all states have ended so; the request to others is withdrawn."""
        missed = [label for label, state in self._states.items() if state.preempt_requested()]
        for label in missed:
            util.logwarn(f"State '{label}' in concurrence did not service preempt.")
            self._states[label].recall_preempt()
        if not missed:
            util.loginfo("Concurrence serviced preempt.")
            self.service_preempt()
        return not missed

    def _choose(self) -> Any:
        """Return the outcome that follows from those of the states."""
        util.loginfo(f"Concurrent Outcomes: {self._child_outcomes}")
        ended = self._child_outcomes.items()
        fitting = [name for name, given in self._outcome_map.items() if given.items() <= ended]
        outcome: Any = max(
            fitting, key=lambda name: len(self._outcome_map[name]), default=self._default_outcome
        )
        if self._outcome_cb is None:
            return outcome
        chosen = run_user_code("the outcome callback", self._outcome_cb, dict(self._child_outcomes))
        if isinstance(chosen, str) and chosen:
            return chosen
        if chosen:
            util.logerr(f"the outcome callback returned {chosen!r}, which is not a string")
        util.logwarn(f"the outcome callback chose no outcome: it is '{outcome}'")
        return outcome

    def request_preempt(self) -> None:
        """Request that the container and its states end soon."""
        self._preempt_requested = True
        with self._done_cond:
            self._done_cond.notify_all()

    def get_initial_states(self) -> list[str]:
        """Return the labels of all states."""
        return list(self._states)

    def set_initial_state(self, initial_states: Sequence[str], userdata: Any) -> None:
        """Set user data; a concurrence always begins with all states."""
        if initial_states and set(initial_states) != self._states.keys():
            util.logwarn(
                f"a concurrence begins with all its states, not only {list(initial_states)}"
            )
        self.userdata.update(userdata)

    def get_active_states(self) -> list[str]:
        """Return the labels of the states that have not ended."""
        return [label for label, outcome in self._child_outcomes.items() if outcome is None]

    def get_internal_edges(self) -> list[Any]:
        """Return the edges of the outcome map: outcome, label, outcome of the container."""
        return [
            (outcome, label, final)
            for final, given in self._outcome_map.items()
            for label, outcome in given.items()
        ]

    def check_consistency(self) -> None:
        """Check that the states have the outcomes that the outcome map names."""
        for outcome, label, _ in self.get_internal_edges():
            if label not in self._states:
                raise util.InvalidStateError(
                    f"the outcome map names '{label}', which is not a state"
                )
            registered = self._states[label].get_registered_outcomes()
            if outcome not in registered:
                raise util.InvalidTransitionError(
                    f"the outcome map names outcome '{outcome}' of state '{label}', which has only"
                    f" {list(registered)}"
                )
