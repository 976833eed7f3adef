"""smach.container: a state that has states of its own."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, Self

from rosz.ros1.libraries.smach import util
from rosz.ros1.libraries.smach.state import State
from rosz.ros1.libraries.smach.user_data import Remapper, UserData

__all__ = ("Container", "run_user_code")

Callbacks = list[tuple[Callable[..., object], Sequence[Any]]]


def run_user_code(what: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function of the program, and return its result.

    Its failure becomes an InvalidUserCodeError, with the name ``what``.
    """
    try:
        return function(*arguments)
    except util.InvalidUserCodeError:
        util.logerr(f"{what} failed")
        raise
    except Exception as error:
        raise util.InvalidUserCodeError(f"{what} failed: {traceback.format_exc()}") from error


def execute_state(what: str, state: Any, userdata: UserData, remapping: Mapping[str, str]) -> Any:
    """Execute a state with the user data that it declares, and return its outcome.

    It sees the user data by the keys of its remapping; its failure is that of `run_user_code`.
    """
    inputs, outputs = state.get_registered_input_keys(), state.get_registered_output_keys()
    return run_user_code(what, state.execute, Remapper(userdata, inputs, outputs, remapping))


class Container(State):
    """Base class of containers; states are added within ``with container:``.

    Args:
        outcomes: Outcomes that the container may have.
        input_keys: Keys that it copies from the user data of its own container.
        output_keys: Keys that it copies back when it ends.

    Attributes:
        userdata: Values that its states share.
    """

    _construction_stack: ClassVar[list[Container]] = []
    _construction_lock: ClassVar[Any] = threading.RLock()
    _context_kwargs: ClassVar[Mapping[str, Any]] = {}

    def __init__(
        self,
        outcomes: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
    ) -> None:
        super().__init__(outcomes, input_keys, output_keys)
        self.userdata: UserData = UserData()
        self._states: dict[str, Any] = {}
        self._is_running = False
        self._start_cbs: Callbacks = []
        self._transition_cbs: Callbacks = []
        self._termination_cbs: Callbacks = []

    def __getitem__(self, key: str) -> Any:
        if key not in self._states:
            util.logerr(f"the container has no state '{key}'; there are {list(self._states)}")
            raise KeyError(key)
        return self._states[key]

    def get_children(self) -> dict[str, Any]:
        """Return the states by label."""
        return self._states

    def set_initial_state(self, initial_states: Sequence[str], userdata: Any) -> None:
        """Set the state to begin with, and user data.

        Args:
            initial_states: Label of the state.
            userdata: Values to take over.
        """
        raise NotImplementedError

    def get_initial_states(self) -> list[str]:
        """Return the labels of the states to begin with."""
        raise NotImplementedError

    def get_active_states(self) -> list[str]:
        """Return the labels of the states that run."""
        raise NotImplementedError

    def get_internal_edges(self) -> list[Any]:
        """Return the edges between states: outcome, label, and label or outcome to go to."""
        raise NotImplementedError

    def check_consistency(self) -> None:
        """Check that the container can be executed.

        Raises:
            InvalidTransitionError: A transition leads nowhere.
            InvalidStateError: A state is not valid.
        """
        raise NotImplementedError

    def is_running(self) -> bool:
        """Return whether the container is being executed."""
        return self._is_running

    def _copy_input_keys(self, parent_ud: Any, ud: Any) -> None:
        _copy(self.get_registered_input_keys(), parent_ud, ud)

    def _copy_output_keys(self, ud: Any, parent_ud: Any) -> None:
        _copy(self.get_registered_output_keys(), ud, parent_ud)

    def register_start_cb(
        self, start_cb: Callable[..., object], cb_args: Sequence[Any] = ()
    ) -> None:
        """Call a function with user data, initial states and ``cb_args`` when execution begins."""
        self._start_cbs.append((start_cb, cb_args))

    def register_transition_cb(
        self, transition_cb: Callable[..., object], cb_args: Sequence[Any] = ()
    ) -> None:
        """Call a function with user data, active states and ``cb_args`` after each transition."""
        self._transition_cbs.append((transition_cb, cb_args))

    def register_termination_cb(
        self, termination_cb: Callable[..., object], cb_args: Sequence[Any] = ()
    ) -> None:
        """Call a function with user data, last states, outcome and ``cb_args`` at the end."""
        self._termination_cbs.append((termination_cb, cb_args))

    def call_start_cbs(self) -> None:
        """Call the functions of `register_start_cb`."""
        _call_all("start", self._start_cbs, self.userdata, self.get_initial_states())

    def call_transition_cbs(self) -> None:
        """Call the functions of `register_transition_cb`."""
        _call_all("transition", self._transition_cbs, self.userdata, self.get_active_states())

    def call_termination_cbs(self, terminal_states: Any, outcome: Any) -> None:
        """Call the functions of `register_termination_cb`."""
        _call_all("termination", self._termination_cbs, self.userdata, terminal_states, outcome)

    def __enter__(self) -> None:
        self.open()

    def __exit__(self, *failure: Any) -> None:  # noqa: PYI036  # given to format_exception
        if failure[0] is None:
            self.close()
            return
        self._leave()
        if not issubclass(failure[0], util.InvalidStateError | util.InvalidTransitionError):
            text = "".join(traceback.format_exception(*failure))
            util.logerr(f"the construction of a container failed:\n{text}")

    @contextmanager
    def opened(self, **kwargs: Any) -> Iterator[Self]:
        """Open the container within ``with container.opened():``."""
        self.open()
        before, Container._context_kwargs = Container._context_kwargs, kwargs
        try:
            yield self
        finally:
            Container._context_kwargs = before
            self.close()

    def open(self) -> None:
        """Open the container, so that states can be added."""
        Container._construction_stack.append(self)
        Container._construction_lock.acquire()

    def close(self) -> None:
        """Close the container, and check it; a mistake is logged.

        Raises:
            InvalidStateError: Another container was opened after this one.
        """
        if not self.is_opened():
            raise util.InvalidStateError("cannot close a container that is not the one opened last")
        self._leave()
        self._is_consistent()

    def _is_consistent(self) -> bool:
        try:
            self.check_consistency()
        except (util.InvalidStateError, util.InvalidTransitionError):
            util.logerr("Container consistency check failed.")
            return False
        return True

    def _leave(self) -> None:
        Container._construction_stack.pop()
        Container._construction_lock.release()

    def is_opened(self) -> bool:
        """Return whether states can be added to this container."""
        stack = Container._construction_stack
        return bool(stack) and stack[-1] is self

    def assert_opened(self, msg: str = "") -> None:
        """Raise an error unless the container is open.

        Raises:
            InvalidConstructionError: It is not.
        """
        if not self.is_opened():
            raise util.InvalidConstructionError(msg)

    @classmethod
    def _currently_opened_container(cls) -> Self:
        if not Container._construction_stack:
            raise util.InvalidStateError(
                "no container is open: add states within 'with container:'"
            )
        opened = Container._construction_stack[-1]
        if not isinstance(opened, cls):
            raise util.InvalidStateError(
                f"the open container is a {type(opened).__name__}, not a {cls.__name__}"
            )
        return opened


def _copy(keys: Iterable[str], source: Any, target: Any) -> None:
    if source is None or target is None:
        return
    for key in keys:
        try:
            target[key] = source[key]
        except KeyError:
            util.logwarn(f"user data has no key '{key}', which a container declares")


def _call_all(kind: str, callbacks: Callbacks, *arguments: Any) -> None:
    try:
        for callback, more in callbacks:
            callback(*arguments, *more)
    except Exception:  # noqa: BLE001  # the callback boundary
        util.logerr(f"Could not execute {kind} callback: {traceback.format_exc()}")
