"""interactive_markers.menu_handler: `MenuHandler`.

``import *`` gives the names that ROS 1's gives.
"""

# ruff: noqa: N802  # ROS 1's names

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from rosz.msgs.visualization_msgs.msg import InteractiveMarkerFeedback, MenuEntry
from rosz.ros1 import rospy

__all__ = ("EntryContext", "InteractiveMarkerFeedback", "MenuEntry", "MenuHandler", "rospy")

Callback = Callable[[InteractiveMarkerFeedback], Any]


class EntryContext:
    """An entry of a menu.

    Attributes:
        title: Its text.
        command: What a client does for it, for the types ``ROSRUN`` and ``ROSLAUNCH``.
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
            command: What a client does for it, for the types ``ROSRUN`` and ``ROSLAUNCH``.
            callback: Function that is called when it is chosen.

        Returns:
            Its handle; None if there is no such parent.
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
        """Set whether clients show an entry; return whether there is one of that handle."""
        if handle not in self.entry_contexts_:
            return False
        self.entry_contexts_[handle].visible = visible
        return True

    def setCheckState(self, handle: int, check_state: int) -> bool:
        """Set the check box of an entry; return whether there is one of that handle."""
        if handle not in self.entry_contexts_:
            return False
        self.entry_contexts_[handle].check_state = check_state
        return True

    def getCheckState(self, handle: int) -> int | None:
        """Return the state of the check box; None if there is no entry of that handle."""
        context = self.entry_contexts_.get(handle)
        return context.check_state if context is not None else None

    def getTitle(self, handle: int) -> str | None:
        """Return the text of an entry; None if there is no entry of that handle."""
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
