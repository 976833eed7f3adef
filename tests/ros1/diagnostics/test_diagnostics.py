"""diagnostic_updater beside ROS 1's."""

from __future__ import annotations

import oracle.apart
import pytest

SNIPPET = """
import diagnostic_updater as d
from diagnostic_updater import *
from std_msgs.msg import Header
class Stamped:
    header = Header(stamp=rospy.Time(999))
def status(one):
    return [one.level, one.name, one.message, one.hardware_id,
        [[pair.key, pair.value] for pair in one.values]]
def take():
    shown = [[name, m.header.stamp.to_sec(), [status(one) for one in m.status]] for name, m in sent]
    del sent[:]
    return shown
def merged(first, second):
    one = DiagnosticStatusWrapper()
    one.summary(*first)
    one.mergeSummary(*second)
    other = DiagnosticStatusWrapper(level=1, name="n", message="other", hardware_id="h")
    other.mergeSummary(one)
    other.add("key", 5.5)
    one.clearSummary()
    return [status(one), status(other)]
def frequencies():
    bound = {"min": 10.0, "max": 20.0}
    tasks = [d.FrequencyStatus(d.FrequencyStatusParam(*args)) for args in
        ((bound,), ({"min": 5},), ({"min": 10, "max": 10}, 0.5, 2), ({"min": 0, "max": 1}, 0, 3))]
    found = []
    for ticks in (15, 0, 50, 2, 1, 0):
        clock[0] += 1
        for task in tasks:
            for _ in range(ticks):
                task.tick()
            found.append(status(task.run(DiagnosticStatusWrapper())))
    bound["max"] = 100.0
    tasks[0].clear()
    clock[0] += 0.5
    tasks[0].tick()
    found.append([status(tasks[0].run(DiagnosticStatusWrapper())), tasks[0].getName()])
    return found
def stamps():
    task, found = d.TimeStampStatus(d.TimeStampStatusParam(-1, 2)), []
    for ages in ((), (0.5, 1), (3,), (-2,), (-2, 3), (clock[0], 1), (clock[0],), ()):
        for age in ages:
            task.tick(clock[0] - age)
        found.append(status(task.run(DiagnosticStatusWrapper())))
    plain = d.TimeStampStatus()
    plain.tick(rospy.Time.from_sec(clock[0] - 4))
    return found + [status(plain.run(DiagnosticStatusWrapper())), plain.getName()]
def good(stat):
    stat.summary(OK, "fine")
    return stat
class Own(DiagnosticTask):
    def run(self, stat):
        stat.summary(WARN, "warm")
        stat.add("degrees", 70)
        return stat
def updates():
    updater, found = Updater(), []
    updater.add("good", good)
    updater.add(FunctionDiagnosticTask("function", good))
    found.append(take())
    updater.force_update()
    updater.force_update()
    updater.setHardwareID("arm 5")
    updater.verbose = True
    updater.add(Own("own"))
    updater.add("silent", lambda stat: stat)
    both = CompositeDiagnosticTask("both")
    both.addTask(Own("a"))
    both.addTask(d.Heartbeat())
    updater.add(both)
    found.append(take())
    for seconds in (0.5, 0.4, 0.2, 1.0):
        clock[0] += seconds
        updater.update()
        found.append(take())
    updater.broadcast(ERROR, "stop")
    found += [updater.removeByName("own"), updater.removeByName("own"), len(updater.tasks)]
    published = d.DiagnosedPublisher(Publisher("/scan", None), updater,
        d.FrequencyStatusParam({"min": 1}), d.TimeStampStatusParam())
    headerless = d.HeaderlessTopicDiagnostic("cloud", updater, d.FrequencyStatusParam({"min": 1}))
    headerless.tick()
    published.publish(Stamped())
    sent.pop()
    clock[0] += 1
    updater.force_update()
    headerless.clear_window()
    return found + [take(), published.getName(), list(logged), updater.period]
levels = ((0, "a"), (0, ""), (1, "b"), (2, "c"), (1, ""))
result = [[merged(first, second) for first in levels for second in levels], frequencies(), stamps(),
    updates(), sorted(set(n for n in dir(d) if not n.startswith("_")) & {"rospy", "threading"}),
    isinstance(DiagnosticStatusWrapper(), d.DiagnosticStatus), [OK, WARN, ERROR]]
"""


@pytest.mark.ros1
def test_statuses_are_those_of_ros_1() -> None:
    snippet = oracle.apart.WITHOUT_NETWORK + SNIPPET
    found = oracle.apart.differences(snippet, "diagnostic_updater", "python3-diagnostic-updater")
    assert found == []
