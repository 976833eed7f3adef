"""The settings of one node while a page shows them, as rqt_reconfigure does."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import Any

from rosz.access import PagePolicy
from rosz.node import Node
from rosz.reconfigure import Client, Config, Description

_TIMEOUT = 5.0


class Reconfiguration:
    """Follows and changes the settings of a server of dynamic_reconfigure until it is closed.

    Args:
        node: The node of the page.
        permission: The changes that the page may make.
        name: Name of the server.

    Attributes:
        version: Number that grows with each configuration that comes.
    """

    def __init__(self, node: Node, permission: PagePolicy, name: str) -> None:
        self.name = name
        self.version: int = 0
        self._permission = permission
        self._lock = threading.Lock()
        self._description: Description | None = None
        self._config: Config | None = None
        self._client = Client(
            node,
            name,
            timeout=_TIMEOUT,
            config_callback=self._receive,
            description_callback=self._describe,
        )

    def _describe(self, description: Description) -> None:
        with self._lock:
            self._description = description

    def _receive(self, config: Config) -> None:
        with self._lock:
            self._config = config
            self.version += 1

    def state(self) -> tuple[Description, Config] | None:
        """Return the description and the newest values; None before they have come."""
        with self._lock:
            if self._description is None or self._config is None:
                return None
            return self._description, self._config

    def update(self, changes: Mapping[str, Any]) -> None:
        """Change settings.

        Raises:
            UsageError: The page may not.
            ParamError: The setting does not exist, or a value cannot be converted.
            ServiceNotFound: The server is gone.
            ServiceError: The server refused the change.
            WaitTimeout: The server did not reply in time.
        """
        self._permission.check("call", f"{self.name}/set_parameters")
        self._client.update(changes)

    def close(self) -> None:
        """Follow them no longer."""
        self._client.close()
