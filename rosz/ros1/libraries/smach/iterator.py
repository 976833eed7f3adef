"""smach.iterator: a container that executes one state for each of some items."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rosz.ros1.libraries.smach.container import Container, run_user_code
from rosz.ros1.libraries.smach.util import is_shutdown, loginfo, logwarn

Items = Iterable[Any] | Callable[[], Iterable[Any]]


class Iterator(Container):
    """One state, executed for each item.

    Args:
        outcomes: As for `Container`, as are ``input_keys`` and ``output_keys``.
        it: The items, or a function that returns them.
        it_label: Key of the current item in the user data.
        exhausted_outcome: Outcome when there are no more items.
    """

    def __init__(
        self,
        outcomes: Iterable[str],
        input_keys: Iterable[str],
        output_keys: Iterable[str],
        it: Items = (),
        it_label: str = "it_data",
        exhausted_outcome: str = "exhausted",
    ) -> None:
        super().__init__((*outcomes, exhausted_outcome), input_keys, output_keys)
        self._items: Items = it
        self._items_label = it_label
        self._exhausted_outcome = exhausted_outcome
        self._state_label = ""
        self._state: Any = None
        self._states = {self._state_label: self._state}
        self._loop_outcomes: list[str] = []
        self._break_outcomes: list[str] = []
        self._final_outcome_map: Mapping[str, str] = {}

    @staticmethod
    def set_iteritems(it: Items, it_label: str = "it_data") -> None:
        """Set the items of the open iterator, and their key; see `set_contained_state`."""
        self = Iterator._currently_opened_container()
        self._items, self._items_label = it, it_label

    @staticmethod
    def set_contained_state(
        label: str,
        state: Any,
        loop_outcomes: Sequence[str] = (),
        break_outcomes: Sequence[str] = (),
        final_outcome_map: Mapping[str, str] | None = None,
    ) -> None:
        """Set the state of the open iterator.

        Args:
            label: Name of the state.
            state: The state.
            loop_outcomes: Its outcomes after which the next item follows; all others end the loop.
            break_outcomes: Its outcomes that end the loop; these count if both are given.
            final_outcome_map: For the last outcome, the outcome of the container.

        Raises:
            InvalidStateError: No iterator is open.
        """
        self = Iterator._currently_opened_container()
        self._state_label, self._state = label, state
        self._states = {label: state}
        if loop_outcomes and break_outcomes:
            logwarn(f"iterator state '{label}': loop_outcomes have no effect with break_outcomes")
        registered = state.get_registered_outcomes()
        if break_outcomes:
            self._break_outcomes = list(break_outcomes)
            self._loop_outcomes = [
                outcome for outcome in registered if outcome not in break_outcomes
            ]
        else:
            self._loop_outcomes = list(loop_outcomes)
            self._break_outcomes = [
                outcome for outcome in registered if outcome not in loop_outcomes
            ]
        self._final_outcome_map = final_outcome_map or {}

    def execute(self, parent_ud: Any = None) -> Any:
        """Execute the state for each item, and return the outcome.

        Raises:
            InvalidUserCodeError: The state failed.
        """
        self._is_running = True
        try:
            self._copy_input_keys(parent_ud, self.userdata)
            self.call_start_cbs()
            last = self._run()
            outcome = self._final_outcome_map.get(last, last)
            self._copy_output_keys(self.userdata, parent_ud)
        finally:
            self._is_running = False
        self.call_termination_cbs(self._state_label, outcome)
        return outcome

    def _run(self) -> Any:
        """Return the outcome of the state that ended the loop, or that of no more items."""
        outcome: Any = self._exhausted_outcome
        for item in self._items() if callable(self._items) else self._items:
            if is_shutdown():
                return outcome
            loginfo(f"Iterating {item} of {self._items}")
            self.userdata[self._items_label] = item
            what = f"iterator state '{self._state_label}' of type '{self._state}'"
            outcome = run_user_code(what, self._state.execute, self.userdata)
            loops = not self._loop_outcomes or outcome in self._loop_outcomes
            if self._preempt_requested or outcome in self._break_outcomes or not loops:
                self._preempt_requested = False
                return outcome
            self.call_transition_cbs()
        return self._exhausted_outcome

    def request_preempt(self) -> None:
        """Request that the loop and its state end soon."""
        self._preempt_requested = True
        if self._is_running:
            self._state.request_preempt()

    def get_initial_states(self) -> list[str]:
        """Return the label of the state."""
        return [self._state_label]

    def set_initial_state(self, initial_states: Sequence[str], userdata: Any) -> None:
        """Set user data; see `Container.set_initial_state`.

        Raises:
            KeyError: The label is not that of the state.
        """
        if len(initial_states) > 1:
            logwarn(f"an iterator has one state, not {list(initial_states)}")
        for label in initial_states[:1]:
            self[label]
        self.userdata.update(userdata)

    def get_active_states(self) -> list[str]:
        """Return the label of the state if it runs."""
        return [self._state_label] if self._is_running else []

    def get_internal_edges(self) -> list[Any]:
        """Return the edges: outcome, label, and label or outcome to go to."""
        edges: list[Any] = [
            (outcome, self._state_label, self._state_label) for outcome in self._loop_outcomes
        ]
        for outcome in self._break_outcomes:
            final = self._final_outcome_map.get(outcome, outcome)
            edges.append((outcome, self._state_label, None if final == outcome else final))
        return edges

    def check_consistency(self) -> None:
        """Do nothing: one state is always consistent."""
