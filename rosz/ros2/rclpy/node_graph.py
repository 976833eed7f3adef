"""What nodes of rclpy tell about names and about who else is there."""

from __future__ import annotations

from typing import Any

from rosz import names
from rosz.node import Node as RoszNode

__all__ = ("NodeGraph",)


class NodeGraph:
    """The names of a node, and its view of the others."""

    rosz_node: RoszNode

    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str:
        """Return the global name that the name of a topic means.

        Args:
            topic: Any legal name.
            only_expand: Whether to leave remappings out.
        """
        if only_expand:
            return names.resolve(topic, self.rosz_node.name)
        return self.rosz_node.resolve(topic)

    resolve_service_name = resolve_topic_name

    def get_node_names(self) -> list[str]:
        """Return the base names of all nodes."""
        return [names.basename(name) for name in self._rosz_view().nodes()]

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return base name and namespace of all nodes."""
        return [
            (names.basename(name), names.namespace(name).rstrip("/") or "/")
            for name in self._rosz_view().nodes()
        ]

    def get_topic_names_and_types(self, no_demangle: bool = False) -> list[tuple[str, list[str]]]:  # noqa: ARG002
        """Return all topics with their types."""
        return list(self._rosz_view().topics().items())

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return all services with their types."""
        return list(self._rosz_view().services().items())

    def count_publishers(self, topic_name: str) -> int:
        """Return how many publishers a topic has."""
        return len(self._rosz_view().publishers(self.resolve_topic_name(topic_name)))

    def count_subscribers(self, topic_name: str) -> int:
        """Return how many subscriptions a topic has."""
        return len(self._rosz_view().subscriptions(self.resolve_topic_name(topic_name)))

    def _rosz_view(self) -> Any:
        return self.rosz_node.context.graph.view()
