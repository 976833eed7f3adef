"""One client of a bridge, whose operations are performed in their order."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from typing import Any

from rosz.access import is_password
from rosz.bridges.clients import WRONG_TOO_OFTEN, OutgoingQueue
from rosz.bridges.rosbridge import operations as ops
from rosz.bridges.rosbridge.actions import SentGoals, ServedActions
from rosz.bridges.rosbridge.encoded import EncodedMessage
from rosz.bridges.rosbridge.services import ServedServices, ServiceCalls
from rosz.bridges.rosbridge.state import ClientState, RosbridgeResources
from rosz.bridges.rosbridge.topics import TopicOperations
from rosz.errors import RoszError, UsageError

_MAC_SECONDS = 5
"""Seconds for which an authentication message is valid, as in rosauth."""
_NO_PASSWORD = "the password is missing or wrong"  # noqa: S105  # text for the client


class RosbridgeClient:
    """A client.

    Args:
        pause: Function that counts a password, right or not, and returns the seconds for which it
            is refused.

    Attributes:
        trusted: Whether the client is authenticated.
        refuse: Function that ends the connection with a reason.
        message_numbers: Numbers for messages of topics; the ids of their fragments.
    """

    def __init__(
        self,
        shared: RosbridgeResources,
        queue: OutgoingQueue[EncodedMessage],
        name: str,
        refuse: Callable[[str], object],
        pause: Callable[[bool], float],
        *,
        trusted: bool,
    ) -> None:
        self.trusted: bool = trusted
        self.refuse = refuse
        self._pause = pause
        self.message_numbers = itertools.count(1)
        self._node = shared.node
        self._password = shared.policy.password
        self._state = state = ClientState(shared, queue, name)
        self._fragments = ops.Fragments(shared.limits.operation)
        topics = TopicOperations(state)
        services, calls = ServedServices(state), ServiceCalls(state)
        actions, goals = ServedActions(state), SentGoals(state)
        self._parts = (topics, services, calls, actions, goals)
        self._handlers: dict[type[ops.Operation], Callable[[Any], None]] = {
            ops.Advertise: topics.advertise,
            ops.Unadvertise: topics.unadvertise,
            ops.Publish: topics.publish,
            ops.Subscribe: topics.subscribe,
            ops.Unsubscribe: topics.unsubscribe,
            ops.CallServiceOperation: calls.call,
            ops.AdvertiseService: services.advertise,
            ops.UnadvertiseService: services.unadvertise,
            ops.ServiceResponse: services.respond,
            ops.SendActionGoal: goals.send,
            ops.CancelActionGoal: goals.cancel,
            ops.AdvertiseAction: actions.advertise,
            ops.UnadvertiseAction: actions.unadvertise,
            ops.ActionFeedback: actions.feedback,
            ops.ActionResult: actions.end,
            ops.SetLevel: state.set_level,
        }

    def handle(self, text: str | bytes) -> None:
        """Perform an operation, and report its result as a status message."""
        try:
            operation = self._read(text)
        except UsageError as error:
            if self.trusted:
                self._state.report("error", str(error), None)
            else:
                self.refuse(_NO_PASSWORD)
            return
        if operation is None:
            return
        if not self.trusted:
            self._authenticate(operation)
            return
        handler = self._handlers.get(type(operation))
        if handler is None:  # `Authenticate`, although no password is needed
            return
        name = str(operation.__struct_config__.tag)
        try:
            handler(operation)
        except RoszError as error:
            self._state.report("error", f"{name}: {error}", operation.id)
        except Exception as error:  # noqa: BLE001  # the boundary to messages of clients
            self._node.log.report(f"operation '{name}' of a client failed", error)
            self._state.report("error", f"{name}: {error}", operation.id)
        else:
            self._state.report("info", f"{name}: done", operation.id)

    def _read(self, text: str | bytes) -> ops.Operation | None:
        """Return the operation in a text; None if the text is a part, and others are missing.

        The last part returns the whole operation. Only authenticated clients may send parts.
        """
        operation = ops.read_text(text)
        while isinstance(operation, ops.Fragment) and self.trusted:
            whole = self._fragments.add(operation)
            if whole is None:
                return None
            text, operation = whole, ops.read_text(whole)
        self._state.size = len(text)
        return operation

    def _authenticate(self, operation: ops.Operation) -> None:
        """Trust the client if the operation authenticates it as in rosauth; otherwise refuse it."""
        if isinstance(operation, ops.Authenticate):
            now = time.time()
            recent = abs(now - operation.t) <= _MAC_SECONDS and now < operation.end
            wanted = operation.expected_mac(self._password)
            right = recent and is_password(operation.mac.lower(), wanted)
            if pause := self._pause(right):
                self.refuse(WRONG_TOO_OFTEN.format(pause))
                return
            if right:
                self.trusted = True
                return
        self.refuse(_NO_PASSWORD)

    def close(self) -> None:
        """End the subscriptions, publishers, services, calls and goals of the client."""
        self._state.close()
        for part in self._parts:
            part.close()
