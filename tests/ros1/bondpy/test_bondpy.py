"""bondpy beside ROS 1's, and bonds between processes."""

from __future__ import annotations

import oracle
import oracle.apart
import pytest
from network import Network

STATES = """
import itertools
from bondpy import bondpy
from bond.msg import Status
def event(bond, what):
    if what in ("alive", "dead", "third"):
        other = "third" if what == "third" else "other"
        bond._on_bond_status(Status(id="id", instance_id=other, active=what != "dead"))
    elif what == "foreign":
        bond._on_bond_status(Status(id="another", instance_id="x", active=True))
    elif what in ("break", "shutdown"):
        getattr(bond, {"break": "break_bond"}.get(what, what))()
    elif hasattr(bond, "_expire"):
        bond._deadlines.pop(what + " timeout", None)
        bond._expire(what + " timeout")
    else:
        getattr(bond, "_on_" + what + "_timeout")()
kept = []
def played(events):
    del sent[:], logged[:]
    called = []
    noting = [lambda what=what: called.append(what) for what in ("broken", "formed")]
    bond = bondpy.Bond("topic", "id", *noting)
    kept.append(bond)  # ROS 1's publishes when it is collected
    states = []
    for one in events:
        try:
            event(bond, one)
        except TypeError:  # ROS 1 fails to format what it logs of a third end
            logged.append("error")
        except Exception as error:
            if type(error).__name__ != "TransitionUndefinedException":  # a late timer
                raise
        states.append(repr(bond).rpartition("(")[2])
    shown = [[name, m.id, m.instance_id == bond.instance_id, bool(m.active),
        round(m.heartbeat_timeout, 4), m.heartbeat_period] for name, m in sent]
    return [states, called, shown, list(logged), bond.is_broken(), bond.sister_instance_id]
events = ("alive", "dead", "break", "connect", "heartbeat", "disconnect", "third")
def limits():
    bond = bondpy.Bond("topic", "id")
    bond.connect_timeout, bond.heartbeat_period = rospy.Duration(3), 0.25
    return [bond.connect_timeout.to_sec(), bond.heartbeat_timeout, bond.disconnect_timeout,
        bond.heartbeat_period, repr(bond).partition(",")[0],
        bond.wait_until_formed(rospy.Duration(0.01)), bond.wait_until_broken(rospy.Duration(0.01))]
result = [
    {" ".join(each): played(each) for each in itertools.product(events, repeat=3)},
    played(["foreign", "alive", "foreign"]), played(["alive", "shutdown", "shutdown"]),
    played(["shutdown"]), played(["dead", "dead", "alive", "dead"]), limits(),
    bondpy.as_float_duration(rospy.Duration(2)), bondpy.as_ros_duration(2).to_sec(),
    Status._md5sum, Status._type,
]
"""

END = """
    import sys, rosz.ros1, rospy
    from bondpy import bondpy
    rospy.init_node(sys.argv[1])
    bond = bondpy.Bond("bonds", "one", lambda: print("broken"), lambda: print("formed"))
    bond.heartbeat_period, bond.heartbeat_timeout = 0.1, rospy.Duration(%s)
    bond.start()
    print("started", bond.wait_until_formed())
    if sys.argv[2] == "break":
        bond.break_bond()
    print("ended", bond.wait_until_broken(), bond.is_broken())
    bond.shutdown()
"""


@pytest.mark.ros1
def test_states_and_messages_are_those_of_ros_1() -> None:
    snippet = oracle.apart.WITHOUT_NETWORK + STATES
    assert oracle.apart.differences(snippet, "bondpy", "python3-bondpy") == []


@pytest.mark.system
def test_an_end_that_is_killed_breaks_the_bond(network: Network) -> None:
    ends = [network.program(END % 1.0, f"end_{number}", "wait") for number in "ab"]
    for end in ends:
        end.wait_for("started True")
    ends[0].process.kill()
    ends[1].wait_for("ended True True")
    assert ends[1].exit_code() == 0
    assert ends[1].lines.count("formed") == ends[1].lines.count("broken") == 1


@pytest.mark.system
def test_an_end_that_breaks_the_bond_tells_the_other_one(network: Network) -> None:
    ends = [network.program(END % 60.0, f"end_{what}", what) for what in ("wait", "break")]
    for end in ends:
        end.wait_for("ended True True")
        assert end.exit_code() == 0
        assert end.lines.count("broken") == 1
