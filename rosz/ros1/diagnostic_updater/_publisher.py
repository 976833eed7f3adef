"""Tasks for topics, and a publisher that has one."""

from __future__ import annotations

from typing import Any

from rosz.ros1.diagnostic_updater._diagnostic_updater import CompositeDiagnosticTask, Updater
from rosz.ros1.diagnostic_updater._update_functions import (
    FrequencyStatus,
    FrequencyStatusParam,
    TimeStampStatus,
    TimeStampStatusParam,
)

__all__ = ("DiagnosedPublisher", "HeaderlessTopicDiagnostic", "TopicDiagnostic")


class HeaderlessTopicDiagnostic(CompositeDiagnosticTask):
    """Watches the frequency of a topic.

    Args:
        name: Name of the topic.
        diag: Updater that the task is added to.
        freq: Frequency that is expected.
    """

    def __init__(self, name: str, diag: Updater, freq: FrequencyStatusParam) -> None:
        super().__init__(f"{name} topic status")
        self.diag = diag
        self.freq = FrequencyStatus(freq)
        self.addTask(self.freq)
        diag.add(self)

    def tick(self) -> None:
        """Count a message."""
        self.freq.tick()

    def clear_window(self) -> None:
        """Forget all messages."""
        self.freq.clear()


class TopicDiagnostic(HeaderlessTopicDiagnostic):
    """Watches the frequency of a topic and the ages of its stamps.

    Args:
        name: Name of the topic.
        diag: Updater that the task is added to.
        freq: Frequency that is expected.
        stamp: Ages that are expected.
    """

    def __init__(
        self, name: str, diag: Updater, freq: FrequencyStatusParam, stamp: TimeStampStatusParam
    ) -> None:
        super().__init__(name, diag, freq)
        self.stamp = TimeStampStatus(stamp)
        self.addTask(self.stamp)

    def tick(self, stamp: Any) -> None:  # type: ignore[override]  # as in ROS 1
        """Count a message of a stamp."""
        self.stamp.tick(stamp)
        super().tick()


class DiagnosedPublisher(TopicDiagnostic):
    """A publisher whose messages are watched; they have a header.

    Args:
        pub: The publisher.
        diag: Updater that the task is added to.
        freq: Frequency that is expected.
        stamp: Ages that are expected.
    """

    def __init__(
        self, pub: Any, diag: Updater, freq: FrequencyStatusParam, stamp: TimeStampStatusParam
    ) -> None:
        super().__init__(pub.name, diag, freq, stamp)
        self.publisher = pub

    def publish(self, message: Any) -> None:
        """Count a message and publish it."""
        self.tick(message.header.stamp)
        self.publisher.publish(message)
