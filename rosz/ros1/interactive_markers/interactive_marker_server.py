"""interactive_markers.interactive_marker_server: `InteractiveMarkerServer`.

``import *`` gives the names that ROS 1's gives.
"""

# ruff: noqa: N802  # ROS 1's names

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Any

from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
)
from rosz.ros1 import rospy

__all__ = (
    "Header",
    "InteractiveMarker",
    "InteractiveMarkerFeedback",
    "InteractiveMarkerInit",
    "InteractiveMarkerPose",
    "InteractiveMarkerServer",
    "InteractiveMarkerUpdate",
    "Lock",
    "MarkerContext",
    "UpdateContext",
    "rospy",
)

Callback = Callable[[InteractiveMarkerFeedback], Any]

_KEEP_ALIVE_PERIOD = 0.5
_OWNED_SECONDS = 1.0
"""Seconds after the feedback of one client in which that of others is dropped."""


class MarkerContext:
    """A marker that clients know.

    Attributes:
        last_feedback: Time of the newest feedback.
        last_client_id: Client that sent it.
        default_feedback_cb: Function for feedback that has none of its own.
        feedback_cbs: Functions by the type of feedback.
        int_marker: The marker.
    """

    def __init__(self) -> None:
        self.last_feedback = rospy.Time.now()
        self.last_client_id = ""
        self.default_feedback_cb: Callback | None = None
        self.feedback_cbs: dict[int, Callback] = {}
        self.int_marker = InteractiveMarker()


class UpdateContext:
    """A change of a marker that clients are not told of yet.

    Attributes:
        update_type: ``FULL_UPDATE``, ``POSE_UPDATE`` or ``ERASE``.
        int_marker: The marker; for ``POSE_UPDATE`` only pose and header count.
        default_feedback_cb: Function for feedback that has none of its own.
        feedback_cbs: Functions by the type of feedback.
    """

    FULL_UPDATE = 0
    POSE_UPDATE = 1
    ERASE = 2

    def __init__(self) -> None:
        self.update_type = self.FULL_UPDATE
        self.int_marker = InteractiveMarker()
        self.default_feedback_cb: Callback | None = None
        self.feedback_cbs: dict[int, Callback] = {}


class InteractiveMarkerServer:
    """Shows markers to clients such as RViz, and calls functions for what people do with them.

    Clients learn of changes by `applyChanges`; callbacks change at once.

    Args:
        topic_ns: Namespace of the topics ``update``, ``update_full`` and ``feedback``.
        server_id: What is added to the name of the node, to tell servers of one node apart.
        q_size: Number of feedback messages that may wait.

    Raises:
        ROSInitException: ``rospy.init_node`` was not called.
    """

    DEFAULT_FEEDBACK_CB = 255

    def __init__(self, topic_ns: str, server_id: str = "", q_size: int = 100) -> None:
        self.topic_ns = topic_ns
        self.seq_num = 0
        self.mutex = Lock()
        self.server_id = rospy.get_name() + server_id
        self.marker_contexts: dict[str, MarkerContext] = {}
        self.pending_updates: dict[str, UpdateContext] = {}
        self.init_pub = rospy.Publisher(
            f"{topic_ns}/update_full", InteractiveMarkerInit, latch=True, queue_size=100
        )
        self.update_pub = rospy.Publisher(
            f"{topic_ns}/update", InteractiveMarkerUpdate, queue_size=100
        )
        self._feedback = rospy.Subscriber(
            f"{topic_ns}/feedback",
            InteractiveMarkerFeedback,
            self.processFeedback,
            queue_size=q_size,
        )
        period = rospy.Duration.from_sec(_KEEP_ALIVE_PERIOD)
        self._timer = rospy.Timer(period, self.keepAlive, reset=True)
        self.publishInit()

    def insert(
        self,
        marker: InteractiveMarker,
        feedback_cb: Any = -1,
        feedback_type: int = DEFAULT_FEEDBACK_CB,
    ) -> None:
        """Add a marker, or replace the one of its name.

        Args:
            marker: The marker.
            feedback_cb: Function for its feedback; the functions stay as they are when not given.
            feedback_type: Type of feedback that the function is for; all that have none of their
                own when not given.
        """
        with self.mutex:
            update = self.pending_updates.setdefault(marker.name, UpdateContext())
            update.update_type = UpdateContext.FULL_UPDATE
            update.int_marker = marker
        if feedback_cb != -1:
            self.setCallback(marker.name, feedback_cb, feedback_type)

    def setPose(self, name: str, pose: Any, header: Header | None = None) -> bool:
        """Move a marker.

        Args:
            name: Name of the marker.
            pose: The new pose.
            header: Its header; the one that the marker has when not given or without a frame.

        Returns:
            Whether clients know a marker of that name and none that replaces it waits.
        """
        with self.mutex:
            context, update = self.marker_contexts.get(name), self.pending_updates.get(name)
            if context is None or (
                update is not None and update.update_type == UpdateContext.FULL_UPDATE
            ):
                return False
            kept = context.int_marker.header
            self.doSetPose(update, name, pose, header if header and header.frame_id else kept)
            return True

    def erase(self, name: str) -> bool:
        """Remove a marker; return whether there is one of that name."""
        with self.mutex:
            if name not in self.pending_updates and name not in self.marker_contexts:
                return False
            update = self.pending_updates.setdefault(name, UpdateContext())
            update.update_type = UpdateContext.ERASE
            return True

    def clear(self) -> None:
        """Remove all markers."""
        self.pending_updates = {}
        for name in list(self.marker_contexts):
            self.erase(name)

    def setCallback(
        self, name: str, feedback_cb: Callback | None, feedback_type: int = DEFAULT_FEEDBACK_CB
    ) -> bool:
        """Set a function for the feedback of a marker.

        Args:
            name: Name of the marker.
            feedback_cb: The function; None removes it.
            feedback_type: Type of feedback; all that have no function of their own when not given.

        Returns:
            Whether there is a marker of that name.
        """
        with self.mutex:
            both = self.marker_contexts.get(name), self.pending_updates.get(name)
            for context in both:
                if context is None:
                    continue
                if feedback_type == self.DEFAULT_FEEDBACK_CB:
                    context.default_feedback_cb = feedback_cb
                elif feedback_cb:
                    context.feedback_cbs[feedback_type] = feedback_cb
                else:
                    context.feedback_cbs.pop(feedback_type, None)
            return any(both)

    def applyChanges(self) -> None:
        """Tell clients of all changes."""
        with self.mutex:
            if not self.pending_updates:
                return
            message = InteractiveMarkerUpdate(type=InteractiveMarkerUpdate.UPDATE)
            for name, update in self.pending_updates.items():
                self._apply(name, update, message)
            self.pending_updates = {}
        self.seq_num += 1
        self.publish(message)
        self.publishInit()

    def get(self, name: str) -> InteractiveMarker | None:
        """Return a marker with its changes; None if there is none of that name."""
        update, context = self.pending_updates.get(name), self.marker_contexts.get(name)
        if update is None:
            return context.int_marker if context is not None else None
        if update.update_type == UpdateContext.FULL_UPDATE:
            return update.int_marker
        if update.update_type == UpdateContext.ERASE or context is None:
            return None
        context.int_marker.pose = update.int_marker.pose
        return context.int_marker

    def getNames(self) -> list[str]:
        """Return the names of the markers that clients know."""
        return list(self.marker_contexts)

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Follow what a client does with a marker, and call its function."""
        with self.mutex:
            context = self.marker_contexts.get(feedback.marker_name)
            if context is None:
                return
            now = rospy.Time.now()
            if (
                context.last_client_id != feedback.client_id
                and (now - context.last_feedback).to_sec() < _OWNED_SECONDS
            ):
                rospy.logdebug(
                    "feedback of %s is dropped: another client moves it", feedback.marker_name
                )
                return
            context.last_feedback, context.last_client_id = now, feedback.client_id
            if feedback.event_type == InteractiveMarkerFeedback.POSE_UPDATE:
                own = context.int_marker.header
                header = own if own.stamp == rospy.Time() else feedback.header
                update = self.pending_updates.get(feedback.marker_name)
                self.doSetPose(update, feedback.marker_name, feedback.pose, header)
            callback = context.feedback_cbs.get(feedback.event_type, context.default_feedback_cb)
        if callback is not None:
            callback(feedback)

    def keepAlive(self, msg: Any) -> None:  # noqa: ARG002  # ROS 1's
        """Tell clients that the server lives."""
        self.publish(InteractiveMarkerUpdate(type=InteractiveMarkerUpdate.KEEP_ALIVE))

    def publish(self, update: InteractiveMarkerUpdate) -> None:
        """Publish an update with the server's name and number."""
        update.server_id = self.server_id
        update.seq_num = self.seq_num
        self.update_pub.publish(update)

    def publishInit(self) -> None:
        """Publish all markers, for clients that come later."""
        with self.mutex:
            markers = [context.int_marker for context in self.marker_contexts.values()]
            self.init_pub.publish(
                InteractiveMarkerInit(
                    server_id=self.server_id, seq_num=self.seq_num, markers=markers
                )
            )

    def doSetPose(self, update: UpdateContext | None, name: str, pose: Any, header: Header) -> None:
        """Note the pose of a marker; the mutex is held."""
        if update is None:
            update = self.pending_updates[name] = UpdateContext()
            update.update_type = UpdateContext.POSE_UPDATE
        elif update.update_type != UpdateContext.FULL_UPDATE:
            update.update_type = UpdateContext.POSE_UPDATE
        update.int_marker.pose = pose
        update.int_marker.header = header

    def _apply(self, name: str, update: UpdateContext, message: InteractiveMarkerUpdate) -> None:
        """Take over a change and add it to a message."""
        context = self.marker_contexts.get(name)
        if update.update_type == UpdateContext.FULL_UPDATE:
            if context is None:
                context = self.marker_contexts[name] = MarkerContext()
                context.default_feedback_cb = update.default_feedback_cb
                context.feedback_cbs = update.feedback_cbs
            context.int_marker = update.int_marker
            message.markers.append(context.int_marker)
        elif update.update_type == UpdateContext.ERASE:
            if self.marker_contexts.pop(name, None) is not None:
                message.erases.append(name)
        elif context is not None:
            marker = context.int_marker
            marker.pose, marker.header = update.int_marker.pose, update.int_marker.header
            message.poses.append(InteractiveMarkerPose(marker.header, marker.pose, marker.name))
