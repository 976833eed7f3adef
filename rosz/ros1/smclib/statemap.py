"""smclib.statemap: base classes of state machines that SMC generates."""

# ruff: noqa: N802  # SMC's names

from __future__ import annotations

import sys
from typing import Any

__all__ = ("FSMContext", "State", "StateUndefinedException", "TransitionUndefinedException")


class StateUndefinedException(Exception):
    """A transition was taken within another one, when there was no state."""


class TransitionUndefinedException(Exception):
    """A state has no transition of that name, and no default."""


class State:
    """A state.

    Args:
        name: Its name.
        id: Its number.
    """

    def __init__(self, name: str, id: int) -> None:  # noqa: A002  # SMC's
        self._name = name
        self._id = id

    def getName(self) -> str:
        """Return its name."""
        return self._name

    def getId(self) -> int:
        """Return its number."""
        return self._id


class FSMContext:
    """A state machine: a state, the one before, and a stack of states.

    Args:
        state: The first state.
    """

    def __init__(self, state: State) -> None:
        self._state: State | None = state
        self._previous_state: State | None = None
        self._state_stack: list[State] = []
        self._transition: Any = None
        self._debug_flag = False
        self._debug_stream: Any = sys.stderr

    def getDebugFlag(self) -> bool:
        """Return whether changes of the state are written."""
        return self._debug_flag

    def setDebugFlag(self, flag: bool) -> None:
        """Set whether changes of the state are written."""
        self._debug_flag = flag

    def getDebugStream(self) -> Any:
        """Return where changes of the state are written."""
        return self._debug_stream

    def setDebugStream(self, stream: Any) -> None:
        """Set where changes of the state are written."""
        self._debug_stream = stream

    def getState(self) -> State:
        """Return the state.

        Raises:
            StateUndefinedException: A transition is under way.
        """
        if self._state is None:
            raise StateUndefinedException("there is no state while a transition is under way")
        return self._state

    def isInTransition(self) -> bool:
        """Return whether a transition is under way."""
        return self._state is None

    def getTransition(self) -> Any:
        """Return the name of the transition that is under way."""
        return self._transition

    def clearState(self) -> None:
        """Leave the state; there is none until the next is set."""
        self._previous_state, self._state = self._state, None

    def getPreviousState(self) -> State | None:
        """Return the state that was left last."""
        return self._previous_state

    def setState(self, state: State) -> None:
        """Enter a state.

        Raises:
            ValueError: It is none.
        """
        self._state = _checked(state)
        self._write("NEW STATE", state)

    def isStateStackEmpty(self) -> bool:
        """Return whether no states are stacked."""
        return not self._state_stack

    def getStateStackDepth(self) -> int:
        """Return the number of stacked states."""
        return len(self._state_stack)

    def pushState(self, state: State) -> None:
        """Stack the state and enter another one.

        Raises:
            ValueError: It is none.
        """
        entered = _checked(state)
        if self._state is not None:
            self._state_stack.append(self._state)
        self._state = entered
        self._write("PUSH TO STATE", state)

    def popState(self) -> None:
        """Enter the state that was stacked last.

        Raises:
            ValueError: There is none.
        """
        if not self._state_stack:
            raise ValueError("no state is stacked")
        self._state = self._state_stack.pop()
        self._write("POP TO STATE", self._state)

    def emptyStateStack(self) -> None:
        """Forget all stacked states."""
        self._state_stack.clear()

    def _write(self, what: str, state: State) -> None:
        if self._debug_flag:
            self._debug_stream.write(f"{what:<16}: {state.getName()}\n")


def _checked(state: Any) -> State:
    if not isinstance(state, State):
        raise ValueError(f"expected a State, got {type(state).__name__}")  # noqa: TRY004  # SMC's
    return state
