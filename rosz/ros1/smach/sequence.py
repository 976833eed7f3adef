"""smach.sequence: a state machine whose states follow each other as they were added."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from rosz.ros1.smach.state_machine import StateMachine

__all__ = ("Sequence",)


class Sequence(StateMachine):
    """States that follow each other.

    Args:
        outcomes: Outcomes that the sequence may have.
        connector_outcome: Outcome of each state that leads to the next.
        input_keys: Keys that it copies from the user data of its own container.
        output_keys: Keys that it copies back when it ends.
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
        """Add a state to the open sequence.

        Args:
            label: Name of the state in the sequence.
            state: The state.
            transitions: For outcomes of the state, the label or outcome that follows.
            remapping: For keys of the state, the keys of the sequence's user data.

        Returns:
            The state.

        Raises:
            InvalidStateError: The label is in use, or no sequence is open.
            InvalidTransitionError: A state has no such outcome.
        """
        self = Sequence._currently_opened_container()
        StateMachine.add(label, state, transitions, remapping)
        last, self._last_added_seq_label = self._last_added_seq_label, label
        if last is not None:
            before = self._transitions[last]
            if before.get(self._connector_outcome) is None:
                before[self._connector_outcome] = label
                self.check_state_spec(last, self._states[last], before)
        return state
