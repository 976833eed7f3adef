"""rclpy.service: servers."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosz.errors import ServiceError
from rosz.node import Node as RoszNode
from rosz.ros2.rclpy.callback_groups import CallbackGroup

if TYPE_CHECKING:
    from rosz.message import Service as ServiceType

__all__ = ("Service",)

_LOOK_SECONDS = 0.5


class _Call:
    """A call that waits for an executor, and then its caller for the answer."""

    def __init__(self, request: Any) -> None:
        self.request = request
        self.answered = threading.Event()
        self.response: Any = None
        self.error: BaseException | None = None


class Service:
    """A server of a service; made by ``Node.create_service``."""

    def __init__(
        self,
        node: RoszNode,
        srv_name: str,
        srv_type: type[ServiceType],
        callback: Callable[[Any, Any], Any],
        *,
        group: CallbackGroup,
        wake: Callable[[], None],
    ) -> None:
        self.srv_type = srv_type
        self.callback = callback
        self.callback_group = group
        self._wake = wake
        self._calls: deque[_Call] = deque()
        self._service = node.service(srv_name, srv_type, self._serve)
        self._node = node

    @property
    def srv_name(self) -> str:
        """Full name of the service."""
        return self._service.name

    service_name = srv_name

    def _serve(self, request: Any) -> Any:
        """Hand a call over to the executor, and wait for what it makes of it."""
        call = _Call(request)
        self._calls.append(call)
        self._wake()
        while not call.answered.wait(_LOOK_SECONDS):
            if self._service.closed or self._node.is_shutdown:
                raise ServiceError("the server ended before it answered")
        if call.error is not None:
            raise ServiceError(f"{type(call.error).__name__}: {call.error}") from call.error
        return call.response

    def take(self) -> Callable[[], Any] | None:
        """Return what answers the oldest call, if there is one."""
        try:
            call = self._calls.popleft()
        except IndexError:
            return None
        return lambda: self._answer(call)

    async def _answer(self, call: _Call) -> None:
        try:
            result = self.callback(call.request, self.srv_type.Response())
            call.response = await result if hasattr(result, "__await__") else result
        except BaseException as error:
            call.error = error
            raise
        finally:
            call.answered.set()

    def destroy(self) -> None:
        """End it."""
        self._service.close()
