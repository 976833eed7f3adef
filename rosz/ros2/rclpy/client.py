"""rclpy.client: callers of services."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rosz.errors import RoszError, WaitTimeout
from rosz.node import Node as RoszNode
from rosz.ros2.rclpy.task import Future

if TYPE_CHECKING:
    from rosz.message import Service as ServiceType

__all__ = ("Client",)

_FOREVER = threading.TIMEOUT_MAX / 2


class Client:
    """A caller of a service; made by ``Node.create_client``.

    Args:
        node: The node.
        srv_name: Name of the service.
        srv_type: Its type.
        call_soon: Has a function called by the executor that spins the node.
        executor: Gives that executor.
    """

    def __init__(
        self,
        node: RoszNode,
        srv_name: str,
        srv_type: type[ServiceType],
        *,
        call_soon: Callable[[Callable[[], object]], None],
    ) -> None:
        self.srv_type = srv_type
        self._client = node.client(srv_name, srv_type, timeout=_FOREVER)
        self._call_soon = call_soon

    @property
    def srv_name(self) -> str:
        """Full name of the service."""
        return self._client.name

    service_name = srv_name

    def call(self, request: Any, timeout_sec: float | None = None) -> Any:
        """Call, and wait for the response; not in a callback of the same executor's service.

        Args:
            request: Of the service's request type.
            timeout_sec: Seconds; for ever when not given.

        Raises:
            ServiceError: Nobody serves it, or the server answered with an error.
            WaitTimeout: There was no answer in time.
        """
        return self._client.call(request, timeout_sec)

    def call_async(self, request: Any) -> Future:
        """Call, and go on meanwhile.

        Args:
            request: Of the service's request type.

        Returns:
            What is done, while the node is spun, when the response has come. Where nobody serves
            the service yet, the call waits until somebody does.
        """
        future = Future()

        def call() -> None:
            try:
                self._client.wait_for_service(_FOREVER)
                response = self._client.call(request)
            except RoszError as error:
                failure = error
                self._call_soon(lambda: future.set_exception(failure))
            else:
                self._call_soon(lambda: future.set_result(response))

        threading.Thread(target=call, name=f"rosz-call{self.srv_name}", daemon=True).start()
        return future

    def remove_pending_request(self, future: Future) -> None:
        """Give a call up; an answer that comes yet is ignored."""
        future.cancel()

    def service_is_ready(self) -> bool:
        """Tell whether somebody serves it."""
        try:
            self._client.wait_for_service(0.0)
        except WaitTimeout:
            return False
        return True

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Wait until somebody serves it.

        Args:
            timeout_sec: Seconds; for ever when not given.

        Returns:
            Whether somebody does.
        """
        try:
            self._client.wait_for_service(_FOREVER if timeout_sec is None else timeout_sec)
        except WaitTimeout:
            return False
        return True

    def destroy(self) -> None:
        """End it."""
        self._client.close()
