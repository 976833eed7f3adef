"""interactive_markers: markers that people move in RViz, and their menus (ROS wiki).

``import *`` of its submodules gives the names that ROS 1's gives.
"""

# ruff: noqa: N802  # ROS 1's names

from __future__ import annotations

from collections.abc import Callable, Iterable
from threading import Lock
from typing import Any

from rosz.msgs.std_msgs.msg import Header
from rosz.msgs.visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
    MenuEntry,
)
from rosz.ros1.client import rospy

__all__: tuple[str, ...] = ()

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
    """Shows markers to clients such as RViz, and calls functions when people move or click them.

    Clients learn of changes by `applyChanges`; callbacks change at once.

    Args:
        topic_ns: Namespace of the topics ``update``, ``update_full`` and ``feedback``.
        server_id: Suffix of the name of the node, which tells servers of one node apart.
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
        """Set a function for the feedback of a marker; return whether there is one of the name.

        Args:
            name: Name of the marker.
            feedback_cb: The function; None removes it.
            feedback_type: Type of feedback; all that have no function of their own when not given.
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
        """Handle the feedback of a client about a marker, and call its function."""
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


class EntryContext:
    """An entry of a menu.

    Attributes:
        title: Its text.
        command: Command that a client runs, for the types ``ROSRUN`` and ``ROSLAUNCH``.
        command_type: Type of MenuEntry.
        sub_entries: Handles of the entries below it.
        visible: Whether clients show it.
        check_state: ``NO_CHECKBOX``, ``CHECKED`` or ``UNCHECKED``.
        feedback_cb: Function that is called when it is chosen.
    """

    def __init__(self) -> None:
        self.title = ""
        self.command = ""
        self.command_type = 0
        self.sub_entries: list[int] = []
        self.visible = True
        self.check_state = MenuHandler.NO_CHECKBOX
        self.feedback_cb: Callback | None = None


class MenuHandler:
    """A menu of markers whose entries call functions."""

    NO_CHECKBOX = 0
    CHECKED = 1
    UNCHECKED = 2

    def __init__(self) -> None:
        self.top_level_handles_: list[int] = []
        self.entry_contexts_: dict[int, EntryContext] = {}
        self.current_handle_ = 1
        self.managed_markers_: set[str] = set()

    def insert(
        self,
        title: str,
        parent: int | None = None,
        command_type: int = MenuEntry.FEEDBACK,
        command: str = "",
        callback: Callback | None = None,
    ) -> int | None:
        """Add an entry.

        Args:
            title: Its text.
            parent: Handle of the entry that it is below; none when not given.
            command_type: Type of MenuEntry.
            command: Command that a client runs, for the types ``ROSRUN`` and ``ROSLAUNCH``.
            callback: Function that is called when it is chosen.

        Returns:
            The handle of the entry, or None if the parent does not exist.
        """
        handle = self.doInsert(title, command_type, command, callback)
        if parent is None:
            self.top_level_handles_.append(handle)
        elif parent in self.entry_contexts_:
            self.entry_contexts_[parent].sub_entries.append(handle)
        else:
            rospy.logerr("no menu entry has handle %s, which '%s' names", parent, title)
            return None
        return handle

    def setVisible(self, handle: int, visible: bool) -> bool:
        """Set whether clients show an entry. Return whether the entry exists."""
        if handle not in self.entry_contexts_:
            return False
        self.entry_contexts_[handle].visible = visible
        return True

    def setCheckState(self, handle: int, check_state: int) -> bool:
        """Set the check box of an entry. Return whether the entry exists."""
        if handle not in self.entry_contexts_:
            return False
        self.entry_contexts_[handle].check_state = check_state
        return True

    def getCheckState(self, handle: int) -> int | None:
        """Return the state of the check box, or None if the entry does not exist."""
        context = self.entry_contexts_.get(handle)
        return context.check_state if context is not None else None

    def getTitle(self, handle: int) -> str | None:
        """Return the text of an entry, or None if the entry does not exist."""
        context = self.entry_contexts_.get(handle)
        return context.title if context is not None else None

    def apply(self, server: Any, marker_name: str) -> bool:
        """Give a marker the menu as it is now; call the server's ``applyChanges`` afterwards.

        Args:
            server: The InteractiveMarkerServer.
            marker_name: Name of the marker.

        Returns:
            Whether there is a marker of that name.
        """
        marker = server.get(marker_name)
        if marker is None:
            self.managed_markers_.discard(marker_name)
            return False
        marker.menu_entries = []
        self.pushMenuEntries(self.top_level_handles_, marker.menu_entries, 0)
        server.insert(marker, self.processFeedback, InteractiveMarkerFeedback.MENU_SELECT)
        self.managed_markers_.add(marker_name)
        return True

    def reApply(self, server: Any) -> bool:
        """Give the menu as it is now to all markers that have it; return whether all are there."""
        applied = [self.apply(server, name) for name in sorted(self.managed_markers_)]
        return all(applied)

    def processFeedback(self, feedback: InteractiveMarkerFeedback) -> None:
        """Call the function of the entry that was chosen."""
        context = self.entry_contexts_.get(feedback.menu_entry_id)
        if context is not None and context.feedback_cb is not None:
            context.feedback_cb(feedback)

    def pushMenuEntries(
        self, handles_in: Iterable[int], entries_out: list[MenuEntry], parent_handle: int
    ) -> bool:
        """Add visible entries, and those below them, to a list of messages."""
        for handle in handles_in:
            context = self.entry_contexts_[handle]
            if context.visible:
                entries_out.append(self.makeEntry(context, handle, parent_handle))
                self.pushMenuEntries(context.sub_entries, entries_out, handle)
        return True

    def makeEntry(self, context: EntryContext, handle: int, parent_handle: int) -> MenuEntry:
        """Return the message of an entry."""
        box = {self.CHECKED: "[x] ", self.UNCHECKED: "[ ] "}.get(context.check_state, "")
        return MenuEntry(
            id=handle,
            parent_id=parent_handle,
            title=box + context.title,
            command=context.command,
            command_type=context.command_type,
        )

    def doInsert(
        self, title: str, command_type: int, command: str, feedback_cb: Callback | None
    ) -> int:
        """Make an entry that is in no list yet; return its handle."""
        handle = self.current_handle_
        self.current_handle_ += 1
        context = self.entry_contexts_[handle] = EntryContext()
        context.title, context.command = title, command
        context.command_type, context.feedback_cb = command_type, feedback_cb
        return handle
