"""Sends goals of all kinds to one's own server; it runs with ROS 1's actionlib, too."""

import threading

import actionlib
import rospy
from actionlib.action_client import ActionClient, CommState, TerminalState
from actionlib.action_server import ActionServer
from actionlib.exceptions import ActionException
from actionlib.msg import TestAction, TestFeedback, TestGoal, TestResult
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from std_msgs.msg import String

rospy.init_node("goals")
WAIT = 60


def show(name, *values):
    print("=", name, *values, flush=True)


class Seen:
    """The changes of a goal, in order."""

    def __init__(self):
        self.states, self.feedback = [], []
        self.changed = threading.Condition()

    def change(self, handle):
        with self.changed:
            self.states.append(CommState.to_string(handle.get_comm_state()))
            self.changed.notify_all()

    def hear(self, handle, feedback):
        with self.changed:
            self.feedback.append(feedback.feedback)
            self.changed.notify_all()

    def until(self, condition):
        with self.changed:
            assert self.changed.wait_for(condition, WAIT), (self.states, self.feedback)

    def end(self):
        self.until(lambda: "DONE" in self.states)


kept, cancelled = {}, []
arrived = threading.Event()


def on_goal(handle):
    goal = handle.get_goal().goal
    if goal == 1:
        handle.set_accepted("taken")
        handle.set_succeeded(TestResult(7), "well")
    elif goal == 2:
        handle.set_accepted()
        handle.set_aborted(None, "no")
    elif goal == 3:
        handle.set_rejected(TestResult(3), "never")
    elif goal == 4:
        handle.set_canceled(text="recalled")
    elif goal == 9:
        handle.set_succeeded()  # not accepted: an error in the log
        handle.set_accepted()
        handle.set_succeeded(0, "nothing")
    else:
        kept[goal] = handle
        if goal >= 20:
            handle.set_accepted()
            handle.publish_feedback(TestFeedback(goal))
        arrived.set()


def on_cancel(handle):
    cancelled.append((handle.get_goal().goal, GoalStatus.to_string(handle.get_goal_status().status)))
    handle.set_canceled(TestResult(handle.get_goal().goal), "cancelled")


server = ActionServer("act", TestAction, on_goal, on_cancel, False)
server.start()
client = ActionClient("act", TestAction)
show("server", client.wait_for_server(rospy.Duration(WAIT)))


def result_of(handle):
    return (
        TerminalState.to_string(handle.get_terminal_state()), handle.get_goal_status_text(),
        handle.get_result().result,
    )


for number in 1, 2, 3, 4, 9:
    seen = Seen()
    handle = client.send_goal(TestGoal(number), seen.change, seen.hear)
    seen.end()
    first = seen.states[:-2] if number in (3, 4) else seen.states
    show(number, first[-1], *result_of(handle))
    show(number, CommState.to_string(handle.get_comm_state()))

# Feedback, and a cancellation by the handle; before that the goal is not over.
seen = Seen()
handle = client.send_goal(TestGoal(20), seen.change, seen.hear)
seen.until(lambda: seen.feedback and "ACTIVE" in seen.states)
show("running", seen.feedback, handle.get_result(), GoalStatus.to_string(handle.get_goal_status()))
show("not over", TerminalState.to_string(handle.get_terminal_state()))
handle.cancel()
seen.end()
show("cancelled", *result_of(handle))

# Several goals at once, cancelled by time, then all.
arrived.clear()
pairs = []
for number in 21, 22, 10:
    seen = Seen()
    pairs.append((client.send_goal(TestGoal(number), seen.change, seen.hear), seen))
    if number >= 20:
        seen.until(lambda: seen.feedback)
    if number == 21:
        between = rospy.Time.now()
show("equal", pairs[0][0] == pairs[1][0], pairs[0][0] == pairs[0][0], len({p[0] for p in pairs}))
client.cancel_goals_at_and_before_time(between)
pairs[0][1].end()
show("by time", *result_of(pairs[0][0]))
pairs[2][1].until(lambda: "PENDING" in pairs[2][1].states)
client.cancel_all_goals()
for handle, seen in pairs[1:]:
    seen.end()
    show("all", *result_of(handle))

show("cancelled", sorted(cancelled))

# A cancellation that arrives before its goal; a goal that was sent before one.
goals = rospy.Publisher("act/goal", server.ActionGoal, queue_size=5)
cancels = rospy.Publisher("act/cancel", GoalID, queue_size=5)
results, statuses = {}, threading.Event()
rospy.Subscriber(
    "act/result", server.ActionResult,
    lambda m: results.setdefault(m.status.goal_id.id, m.status) and statuses.set(),
)
known = threading.Event()
rospy.Subscriber(
    "act/status", GoalStatusArray,
    lambda m: any(s.goal_id.id == "early" for s in m.status_list) and known.set(),
)
while not (goals.get_num_connections() and cancels.get_num_connections()):
    rospy.sleep(0.01)
rospy.sleep(0.5)
cancels.publish(GoalID(id="early"))
show("known", known.wait(WAIT))
for name, stamp in ("early", rospy.Time(0)), ("old", rospy.Time(5)):
    one = server.ActionGoal(goal=TestGoal(30))
    one.goal_id.id, one.goal_id.stamp = name, stamp
    statuses.clear()
    goals.publish(one)
    statuses.wait(WAIT)
    show(name, GoalStatus.to_string(results[name].status))

# Mistakes.
for wrong in (lambda: client.send_goal(String("no")), lambda: actionlib.SimpleActionClient("a", String)):
    try:
        wrong()
        show("sent")
    except (ActionException, AttributeError, rospy.ROSSerializationException):
        show("refused")
simple = actionlib.SimpleActionClient("act", TestAction)
show("nothing", simple.get_result(), simple.get_state(), simple.gh)
simple.wait_for_server()
show("simple", GoalStatus.to_string(simple.send_goal_and_wait(TestGoal(1))), simple.get_result().result)
show("handle", CommState.to_string(simple.gh.get_comm_state()), simple.simple_state)

# After the shutdown goals and cancellations go nowhere.
rospy.signal_shutdown("over")
client.send_goal(TestGoal(1))
client.cancel_all_goals()
simple.send_goal(TestGoal(1))
simple.cancel_goal()
show("over", simple.wait_for_server(rospy.Duration(1)), rospy.is_shutdown())
