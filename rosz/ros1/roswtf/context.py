"""roswtf.context: what rules look at."""

from __future__ import annotations

import os
from typing import Any, Self

from rosz.ros1.rosgraph.masterapi import Master
from rosz.ros1.roswtf.model import WtfError, WtfWarning

__all__ = ("WtfContext", "WtfException")


class WtfException(Exception):
    """A context cannot be made."""


class WtfContext:
    """The facts that rules look at.

    Attributes:
        env: Environment variables.
        system_state: Publishers, subscribers and services, from ``Master.getSystemState``.
        nodes: Names of the nodes.
        topics: Names and types of the topics.
        services: Names of the services.
        warnings: Warnings of rules.
        errors: Errors of rules.
    """

    def __init__(self) -> None:
        self.pkg: str | None = None
        self.pkg_dir: str | None = None
        self.pkgs: list[str] = []
        self.launch_files: list[str] | None = None
        self.env: dict[str, str] = {}
        self.ros_root: str | None = None
        self.ros_package_path: str | None = None
        self.pythonpath: str | None = None
        self.ros_master_uri: str | None = None
        self.system_state: list[Any] | None = None
        self.nodes: list[str] | None = None
        self.topics: list[Any] | None = None
        self.services: list[str] | None = None
        self.warnings: list[WtfWarning] = []
        self.errors: list[WtfError] = []

    def as_dictionary(self) -> dict[str, Any]:
        """Return the attributes by their names."""
        return dict(vars(self))

    @classmethod
    def from_env(cls, env: dict[str, str] | None = None) -> Self:
        """Return the context of the network.

        Args:
            env: Environment variables; those of the process when not given.
        """
        made = cls()
        made.env = dict(os.environ if env is None else env)
        made.ros_root = made.env.get("ROS_ROOT")
        made.ros_package_path = made.env.get("ROS_PACKAGE_PATH")
        made.pythonpath = made.env.get("PYTHONPATH")
        made.ros_master_uri = made.env.get("ROS_MASTER_URI")
        master = Master("/roswtf")
        state = master.getSystemState()
        made.system_state = list(state)
        made.nodes = sorted({node for part in state for _, nodes in part for node in nodes})
        made.topics = list(master.getTopicTypes())
        made.services = [name for name, _ in state[2]]
        return made
