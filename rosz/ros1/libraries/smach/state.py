"""smach.state: states, which containers execute."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rosz.ros1.libraries.smach.util import has_smach_interface


class State:
    """Base class of states; a state of a program overrides `execute`.

    Args:
        outcomes: Outcomes that `execute` may return.
        input_keys: Keys of the user data that it may read.
        output_keys: Keys of the user data that it may write.
        io_keys: Keys of the user data that it may read and write.
    """

    def __init__(
        self,
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        io_keys: Iterable[str] = (),
    ) -> None:
        both = tuple(io_keys)
        self._outcomes = set(outcomes)
        self._input_keys = {*input_keys, *both}
        self._output_keys = {*output_keys, *both}
        self._preempt_requested = False

    def execute(self, ud: Any) -> Any:
        """Execute the state.

        Args:
            ud: The user data, as far as the keys were declared.

        Returns:
            One of the outcomes.
        """
        raise NotImplementedError

    def register_outcomes(self, new_outcomes: Iterable[str]) -> None:
        """Declare further outcomes."""
        self._outcomes = self._outcomes.union(new_outcomes)

    def get_registered_outcomes(self) -> tuple[str, ...]:
        """Return the outcomes."""
        return tuple(self._outcomes)

    def register_io_keys(self, keys: Iterable[str]) -> None:
        """Declare further keys that the state may read and write."""
        both = tuple(keys)
        self.register_input_keys(both)
        self.register_output_keys(both)

    def register_input_keys(self, keys: Iterable[str]) -> None:
        """Declare further keys that the state may read."""
        self._input_keys = self._input_keys.union(keys)

    def get_registered_input_keys(self) -> tuple[str, ...]:
        """Return the keys that the state may read."""
        return tuple(self._input_keys)

    def register_output_keys(self, keys: Iterable[str]) -> None:
        """Declare further keys that the state may write."""
        self._output_keys = self._output_keys.union(keys)

    def get_registered_output_keys(self) -> tuple[str, ...]:
        """Return the keys that the state may write."""
        return tuple(self._output_keys)

    def request_preempt(self) -> None:
        """Request that the state ends soon."""
        self._preempt_requested = True

    def service_preempt(self) -> None:
        """Answer the request; a state calls this before it ends because of it."""
        self._preempt_requested = False

    def recall_preempt(self) -> None:
        """Take the request back."""
        self._preempt_requested = False

    def preempt_requested(self) -> bool:
        """Return whether the state is requested to end."""
        return self._preempt_requested


class CBState(State):
    """A state that calls a function, which returns the outcome.

    Args:
        cb: Function called with the user data and the arguments below.
        cb_args: Further arguments.
        cb_kwargs: Further keyword arguments.
        outcomes: As for `State`, besides those that the function declares (``cb_interface``).
        input_keys: Keys that it may read, likewise.
        output_keys: Keys that it may write, likewise.
        io_keys: Keys that it may read and write.
    """

    def __init__(  # noqa: PLR0917  # smach's
        self,
        cb: Callable[..., Any],
        cb_args: Sequence[Any] = (),
        cb_kwargs: Mapping[str, Any] | None = None,
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        io_keys: Iterable[str] = (),
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys, io_keys)
        self._cb = cb
        self._cb_args = cb_args
        self._cb_kwargs = cb_kwargs or {}
        if has_smach_interface(cb):
            declared: Any = cb
            self.register_input_keys(declared.get_registered_input_keys())
            self.register_output_keys(declared.get_registered_output_keys())
            self.register_outcomes(declared.get_registered_outcomes())

    def execute(self, ud: Any) -> Any:
        """Call the function."""
        return self._cb(ud, *self._cb_args, **self._cb_kwargs)
