"""interactive_markers beside ROS 1's."""

from __future__ import annotations

import oracle.apart
import pytest

SNIPPET = """
from geometry_msgs.msg import Point, Pose
from interactive_markers.interactive_marker_server import *
from interactive_markers.menu_handler import *
from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback
def of_marker(m):
    return [m.name, m.header.frame_id, m.header.stamp.to_sec(), m.pose.position.x,
        [[e.id, e.parent_id, e.title, e.command, e.command_type] for e in m.menu_entries]]
def take():
    shown = []
    for name, m in sent:
        if isinstance(m, InteractiveMarkerInit):
            shown.append([name, m.server_id, m.seq_num, [of_marker(one) for one in m.markers]])
        else:
            shown.append([name, m.server_id, m.seq_num, m.type,
                [of_marker(one) for one in m.markers], list(m.erases),
                [[p.name, p.header.frame_id, p.pose.position.x] for p in m.poses]])
    del sent[:]
    return shown
def marker(name, frame="base", x=0.0, stamp=0):
    return InteractiveMarker(name=name, header=Header(frame_id=frame, stamp=rospy.Time(stamp)),
        pose=Pose(position=Point(x=x)))
def pose(x):
    return Pose(position=Point(x=x))
called = []
def noting(what):
    return lambda feedback: called.append([what, feedback.marker_name, feedback.event_type])
def feedback(server, name, kind, client="rviz", x=0.0, entry=0, frame="map"):
    server.processFeedback(Feedback(marker_name=name, event_type=kind, client_id=client,
        pose=pose(x), menu_entry_id=entry, header=Header(frame_id=frame)))
    shown = server.get(name)
    return [list(called), shown and of_marker(shown)]
server = InteractiveMarkerServer("menu", "!", 7)
steps = [take(), [p.options for p in (server.init_pub, server.update_pub)],
    [[name, options] for name, _, options in subscribers],
    [[seconds, sorted(options.items())] for seconds, _, options in timers]]
def do(what):
    steps.append([what, take(), sorted(server.marker_contexts), server.seq_num])
server.applyChanges(); do("nothing")
server.insert(marker("a"), noting("a"))
server.insert(marker("b", stamp=5), noting("b"), Feedback.BUTTON_CLICK)
server.insert(marker("c"))
do([of_marker(server.get("a")), server.get("z"), server.setPose("a", pose(1)),
    server.setPose("z", pose(1))])
server.applyChanges(); do("three")
do([server.setPose("a", pose(2)), of_marker(server.get("a")), server.setPose("b", pose(3),
    Header(frame_id="odom")), server.setPose("a", pose(4), Header())])
server.applyChanges(); do("moved")
do([server.erase("c"), server.erase("z"), server.get("c"), server.setCallback("z", None),
    server.setCallback("a", noting("a2"), Feedback.MOUSE_UP)])
server.applyChanges(); do("erased")
do([feedback(server, "a", Feedback.POSE_UPDATE, x=9.0), feedback(server, "z", 1)])
clock[0] += 2
do([feedback(server, "a", Feedback.POSE_UPDATE, x=9.0), feedback(server, "a", Feedback.MOUSE_UP),
    feedback(server, "a", Feedback.MOUSE_UP, "other"), feedback(server, "b", Feedback.BUTTON_CLICK),
    feedback(server, "b", Feedback.POSE_UPDATE, x=8.0) if False else None])
server.applyChanges(); do("by hand")
clock[0] += 0.5
do(feedback(server, "a", Feedback.MOUSE_UP, "other"))
clock[0] += 2
do(feedback(server, "a", Feedback.MOUSE_UP, "other"))
server.insert(marker("a", x=6.0)); server.applyChanges(); do("replaced")
do(feedback(server, "a", Feedback.KEEP_ALIVE, "other"))
server.setCallback("b", noting("b2"))
do([feedback(server, "b", Feedback.POSE_UPDATE, x=8.0), of_marker(server.get("b"))])
menu = MenuHandler()
first = menu.insert("first", callback=noting("first"))
sub = menu.insert("sub", parent=first, callback=noting("sub"))
below = menu.insert("below", parent=sub, command_type=MenuEntry.ROSRUN, command="p n")
hidden = menu.insert("hidden", callback=noting("hidden"))
box = menu.insert("box", callback=noting("box"))
menu.insert("below hidden", parent=hidden)
do([first, sub, below, hidden, box, menu.insert("lost", parent=77), list(logged)])
do([menu.setVisible(hidden, False), menu.setVisible(99, True),
    menu.setCheckState(box, menu.CHECKED), menu.setCheckState(99, 1),
    menu.getCheckState(box), menu.getCheckState(first),
    menu.getCheckState(99), menu.getTitle(sub), menu.getTitle(99)])
do([menu.apply(server, "a"), menu.apply(server, "b"), of_marker(server.get("a"))])
server.applyChanges(); do("menu")
do([feedback(server, "a", Feedback.MENU_SELECT, "other", entry=one) for one in (sub, box, 55)])
menu.setCheckState(box, menu.UNCHECKED); menu.setVisible(hidden, True)
do([menu.reApply(server), of_marker(server.get("a"))])
server.erase("b"); server.applyChanges()
do([menu.reApply(server), sorted(menu.managed_markers_)])
server.keepAlive(None); do("alive")
server.clear(); server.applyChanges(); do("cleared")
result = [steps, [MenuHandler.NO_CHECKBOX, MenuHandler.CHECKED, MenuHandler.UNCHECKED],
    InteractiveMarkerServer.DEFAULT_FEEDBACK_CB, UpdateContext.ERASE, MarkerContext.__name__]
"""


@pytest.mark.ros1
def test_markers_and_menus_are_those_of_ros_1() -> None:
    snippet = oracle.apart.WITHOUT_NETWORK + SNIPPET
    found = oracle.apart.differences(snippet, "interactive_markers", "python3-interactive-markers")
    assert found == []
