"""smach_ros.service_state: a state that calls a service."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rosz.ros1 import rospy
from rosz.ros1.smach import State
from rosz.ros1.smach_ros.user_callback import (
    CallbackFailed,
    UserCallback,
    copy_from,
    copy_to,
    fill,
)

__all__ = ("ServiceState",)

_WAIT_PERIOD = 1.0
"""Seconds after which a wait for the service looks whether it was preempted."""


class ServiceState(State):
    """Call a service; the outcomes are ``succeeded``, ``aborted`` and ``preempted``.

    Args:
        service_name: Name of the service.
        service_spec: Class of the service.
        request: Request to begin with.
        request_cb: Function called with the user data and the request, which may return another.
        request_cb_args: Further arguments of it.
        request_cb_kwargs: Further keyword arguments of it.
        request_key: Key of the request in the user data.
        request_slots: Fields of the request to set from user data of the same keys.
        response_cb: Function called with the user data and the response, which may return an
            outcome.
        response_cb_args: Further arguments of it.
        response_cb_kwargs: Further keyword arguments of it.
        response_key: Key for the response in the user data.
        response_slots: Fields of the response to copy to user data of the same keys.
        input_keys: Further keys that the functions read.
        output_keys: Further keys that the functions write.
        outcomes: Further outcomes.

    Raises:
        InvalidStateError: A function is not callable.
    """

    def __init__(  # noqa: PLR0917  # smach's
        self,
        service_name: str,
        service_spec: Any,
        request: Any = None,
        request_cb: Callable[..., Any] | None = None,
        request_cb_args: Sequence[Any] = (),
        request_cb_kwargs: Mapping[str, Any] | None = None,
        request_key: str | None = None,
        request_slots: Iterable[str] = (),
        response_cb: Callable[..., Any] | None = None,
        response_cb_args: Sequence[Any] = (),
        response_cb_kwargs: Mapping[str, Any] | None = None,
        response_key: str | None = None,
        response_slots: Iterable[str] = (),
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        outcomes: Iterable[str] = (),
    ) -> None:
        super().__init__(("succeeded", "aborted", "preempted", *outcomes), input_keys, output_keys)
        self._service_name, self._service_spec = service_name, service_spec
        self._request = service_spec._request_class() if request is None else request
        self._response: Any = None
        self._proxy: Any = None
        keys = tuple(input_keys), tuple(output_keys)
        self._request_cb = UserCallback(self, request_cb, request_cb_args, request_cb_kwargs, keys)
        self._response_cb = UserCallback(
            self, response_cb, response_cb_args, response_cb_kwargs, keys
        )
        self._request_key, self._request_slots = request_key, tuple(request_slots)
        self._response_key, self._response_slots = response_key, tuple(response_slots)
        self.register_input_keys((*self._request_slots, *([request_key] if request_key else [])))
        self.register_output_keys(
            (*self._response_slots, *([response_key] if response_key else []))
        )

    def execute(self, ud: Any) -> Any:
        """Call the service."""
        if not self._connect():
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            return "aborted"
        try:
            return self._call(ud)
        except CallbackFailed:
            return "aborted"
        except rospy.ServiceException as error:
            rospy.logerr(f"service '{self._service_name}' failed: {error}")
            return "aborted"

    def _connect(self) -> bool:
        """Wait for the service; return False if preempted or shut down."""
        while self._proxy is None:
            if self.preempt_requested() or rospy.is_shutdown():
                return False
            try:
                rospy.wait_for_service(self._service_name, _WAIT_PERIOD)
            except rospy.ROSInterruptException:
                return False
            except rospy.ROSException:
                rospy.logwarn(f"Still waiting for service '{self._service_name}'...")
                continue
            self._proxy = rospy.ServiceProxy(self._service_name, self._service_spec)
        return not self.preempt_requested()

    def _call(self, ud: Any) -> Any:
        name = self._service_name
        if self._request_key is not None:
            self._request = copy_from(ud, self._request_key)
        fill(self._request, ud, self._request_slots)
        changed = self._request_cb.call(f"request callback of service '{name}'", ud, self._request)
        if changed is not None:
            self._request = changed
        self._response = self._proxy(self._request)
        what = f"response callback of service '{name}'"
        outcome = self._response_cb.choose(what, ud, self._response)
        copy_to(ud, self._response, self._response_key, self._response_slots)
        return "succeeded" if outcome is None else outcome
