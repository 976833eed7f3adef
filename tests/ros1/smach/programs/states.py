"""Executes the states of smach_ros in one node; it runs with ROS 1's smach_ros, too."""

import threading

import actionlib
import rospy
import smach
from actionlib.msg import TestAction, TestFeedback, TestGoal, TestResult
from rospy_tutorials.srv import AddTwoInts
from smach_msgs.msg import SmachContainerStatus, SmachContainerStructure
from smach_ros import (
    ActionServerWrapper,
    ConditionState,
    IntrospectionClient,
    IntrospectionServer,
    MonitorState,
    ServiceState,
    SimpleActionState,
    set_preempt_handler,
)
from std_msgs.msg import Int32

rospy.init_node("states")
smach.set_loggers(*[lambda text: None] * 4)
WAIT = rospy.Duration(60)


def show(name, *values):
    print("=", name, *values, flush=True)


def run(state, values=(), remapping=None):
    sm = smach.StateMachine(list(state.get_registered_outcomes()))
    for key, value in dict(values).items():
        sm.userdata[key] = value
    with sm:
        smach.StateMachine.add("STATE", state, remapping=remapping)
    return sm.execute(), {k: sm.userdata[k] for k in sorted(sm.userdata.keys())}


# A service.
rospy.Service("add", AddTwoInts, lambda request: request.a + request.b)
show("slots", *run(
    ServiceState("add", AddTwoInts, request_slots=["a", "b"], response_slots=["sum"]),
    {"a": 1, "b": 2},
))


def respond(ud, response):
    ud.out = response.sum * ud.factor
    return "big" if response.sum > 9 else None


for a in 3, 8:
    show("callbacks", *run(
        ServiceState(
            "add", AddTwoInts, request_cb=lambda ud, request, b: setattr(request, "b", b),
            request_cb_args=[4], request=AddTwoInts._request_class(a, 0), response_cb=respond,
            input_keys=["factor"], output_keys=["out"], outcomes=["big"],
        ),
        {"factor": 10},
    ))
show("no key", run(ServiceState("add", AddTwoInts, request_key="none"))[0])
show("fails", run(ServiceState("add", AddTwoInts, request_cb=lambda ud, r: 1 / 0))[0])

# A condition and a topic.
checks = []
show("condition", run(ConditionState(
    lambda ud: checks.append(1) or len(checks) > 2, poll_rate=rospy.Duration(0.01), max_checks=5
))[0], len(checks))
show("condition", run(ConditionState(lambda ud: False, poll_rate=rospy.Duration(0.01)))[0])
numbers = rospy.Publisher("numbers", Int32, queue_size=10)
stop = threading.Event()


def publish():
    number = 0
    while not stop.wait(0.02):
        numbers.publish(number)
        number += 1


threading.Thread(target=publish, daemon=True).start()


def small(ud, message):
    ud.last = message.data >= 0
    return message.data >= 0


monitor = MonitorState("numbers", Int32, small, max_checks=3, output_keys=["last"])
show("monitor", *run(monitor))
show("monitor", run(MonitorState("numbers", Int32, lambda ud, message: False))[0])
monitor = MonitorState("numbers", Int32, lambda ud, message: True)
threading.Timer(0.2, monitor.request_preempt).start()
show("monitor", run(monitor)[0])
stop.set()

# An action, executed by a wrapped machine.


class Work(smach.State):
    def __init__(self):
        smach.State.__init__(
            self, ["done", "bad", "preempted"], ["action_goal", "goal"],
            ["action_result", "action_feedback", "result"],
        )

    def execute(self, ud):
        feedback = TestFeedback(ud.action_goal.goal)
        ud.action_feedback = feedback
        if ud.goal == 3:
            while not self.preempt_requested():
                rospy.sleep(0.01)
            self.service_preempt()
            return "preempted"
        ud.result = ud.goal * 2
        return "bad" if ud.goal == 2 else "done"


inside = smach.StateMachine(
    ["done", "bad", "preempted"], ["action_goal", "goal"], ["action_feedback", "result"]
)
with inside:
    smach.StateMachine.add("WORK", Work(), {"done": "AGAIN"})
    smach.StateMachine.add("AGAIN", Work())
wrapper = ActionServerWrapper(
    "work", TestAction, inside, ["done"], ["bad"], ["preempted"], expand_goal_slots=True,
    pack_result_slots=True,
)
wrapper.run_server()
for number in 1, 2:
    show("action", *run(
        SimpleActionState("work", TestAction, goal_slots=["goal"], result_slots=["result"]),
        {"goal": number},
    ))
show("result", *run(
    SimpleActionState(
        "work", TestAction, goal=TestGoal(1), result_key="all", output_keys=["status"],
        result_cb=smach.CBInterface(
            lambda ud, status, result: setattr(ud, "status", status), output_keys=["status"]
        ),
    )
)[0:1])
show("timeout", run(
    SimpleActionState("work", TestAction, goal=TestGoal(3), exec_timeout=rospy.Duration(0.2))
)[0])
waiting = SimpleActionState("work", TestAction, goal=TestGoal(3))
threading.Timer(0.5, waiting.request_preempt).start()
show("preempted", run(waiting)[0], waiting.preempt_requested())
show("no server", run(
    SimpleActionState("nowhere", TestAction, server_wait_timeout=rospy.Duration(0.1))
)[0])
for wrong in {"goal_slots": ["none"]}, {"goal": len}, {"result_cb": 1}:
    try:
        SimpleActionState("work", TestAction, **wrong)
    except smach.InvalidStateError:
        show("wrong", sorted(wrong))

# Introspection: structure, state, and where to begin.
top = smach.StateMachine(["done"])
within = smach.StateMachine(["done"])
here = threading.Event()
with top:
    smach.StateMachine.add("FIRST", smach.CBState(lambda ud: "done", outcomes=["done"]), {"done": "IN"})
    smach.StateMachine.add("IN", within)
    with within:
        smach.StateMachine.add(
            "LAST",
            smach.CBState(lambda ud: here.wait(60) and "done", outcomes=["done"]),
        )
statuses, structures = {}, {}


def keep(message, where):
    where.setdefault(message.path, []).append(message)


for topic, kind, where in (
    ("status", SmachContainerStatus, statuses), ("structure", SmachContainerStructure, structures)
):
    rospy.Subscriber("viewed/smach/container_" + topic, kind, keep, where)
server = IntrospectionServer("viewed", top, "/TOP")
server.start()
client = IntrospectionClient()
while "/viewed" not in client.get_servers():
    rospy.sleep(0.05)
given = smach.UserData()
given.key = {"a": [1, 2.5]}
show("set", client.set_initial_state("viewed", "/TOP", ["IN"], given, rospy.Duration(60)))
show("begins", top.get_initial_states(), top.userdata.key)
set_preempt_handler(top)
thread = threading.Thread(target=top.execute)
thread.start()
while not any(one.active_states == ["LAST"] for one in statuses.get("/TOP/IN", ())):
    rospy.sleep(0.05)
while len(structures) < 2:
    rospy.sleep(0.05)
here.set()
thread.join()
for path in sorted(structures):
    one = structures[path][-1]
    show(path, one.children, one.internal_outcomes, one.outcomes_from, one.outcomes_to,
         one.container_outcomes)
show(sorted(statuses), statuses["/TOP"][-1].initial_states)
server.stop()
rospy.signal_shutdown("done")
