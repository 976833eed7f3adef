"""Builds and executes containers of all kinds; it runs with ROS 1's smach, too."""

import pickle
import threading
import time

import smach

lines = []
smach.set_loggers(*[lambda text: None] * 4)


class Count(smach.State):
    def __init__(self, limit=3):
        smach.State.__init__(
            self, outcomes=["more", "done"], input_keys=["n"], output_keys=["n"]
        )
        self.limit = limit

    def execute(self, ud):
        ud.n = ud.n + 1
        return "done" if ud.n >= self.limit else "more"


class Wait(smach.State):
    def __init__(self, obeys=True):
        smach.State.__init__(self, outcomes=["done", "preempted"])
        self.obeys = obeys
        self.running = threading.Event()

    def execute(self, ud):
        self.running.set()
        while not self.preempt_requested():
            time.sleep(0.005)
        if self.obeys:
            self.service_preempt()
        return "preempted"


def show(name, *values):
    print(name, *[sorted(v) if isinstance(v, set) else v for v in values], flush=True)


def failed(name, act):
    try:
        show(name, act())
    except Exception as error:
        show(name, type(error).__name__)


# A machine with a loop, a nested machine with remapped keys, constants and callbacks.
events = []
top = smach.StateMachine(outcomes=["ok", "bad"], input_keys=["start"], output_keys=["total"])
inner = smach.StateMachine(outcomes=["done"], input_keys=["n"], output_keys=["n"])
with inner:
    smach.StateMachine.add("COUNT", Count(), {"more": "COUNT"})
with top:
    smach.StateMachine.add("INNER", inner, {"done": "CHECK"}, remapping={"n": "total"})
    smach.StateMachine.add(
        "CHECK",
        smach.CBState(
            lambda ud, a, b: "yes" if ud.limit == a + b else "no",
            cb_args=[1],
            cb_kwargs={"b": 2},
            outcomes=["yes", "no"],
            input_keys=["limit"],
        ),
        {"yes": "ok", "no": "bad"},
        constants={"limit": 3},
    )
top.userdata.total = 0
top.register_start_cb(lambda ud, states, *more: events.append(("start", states, more)), [7])
top.register_transition_cb(lambda ud, states: events.append(("transition", states, ud.total)))
top.register_termination_cb(lambda ud, states, out: events.append(("end", states, out)))
outer = smach.UserData()
outer.start, outer["total"] = 1, None
show("nested", top.execute(outer), outer.total, sorted(outer.keys()))
for event in events:
    show("event", *event)
show("edges", set(top.get_internal_edges()), set(inner.get_internal_edges()))
show("states", top.get_initial_states(), top.get_active_states(), top.is_running())
show("children", sorted(top.get_children()), top["INNER"] is inner)
top.set_initial_state(["CHECK"])
show("initial", top.execute(outer))
show("pickle", type(pickle.loads(pickle.dumps(smach.StateMachine(["a"])))).__name__)
failed("no such state", lambda: top["NOWHERE"])

# Sequences, and add_auto.
seq = smach.Sequence(outcomes=["done", "more"], connector_outcome="more")
seq.userdata.n = 0
with seq:
    smach.Sequence.add("ONE", Count(9))
    smach.Sequence.add("TWO", Count(9))
    smach.Sequence.add("THREE", Count(9), {"more": "done"})
show("sequence", seq.execute(), seq.userdata.n)
auto = smach.StateMachine(["done", "more"])
auto.userdata.n = 0
with auto:
    smach.StateMachine.add_auto("ONE", Count(9), ["more"])
    smach.StateMachine.add("TWO", Count(2))
show("auto", auto.execute(), auto.userdata.n)

# Iterators.
def iterate(break_on, items=(1, 2, 3)):
    it = smach.Iterator(
        outcomes=["found", "empty"], input_keys=[], output_keys=["seen"], it=lambda: items,
        it_label="item", exhausted_outcome="empty",
    )
    it.userdata.seen = []
    with it:
        def look(ud):
            ud["seen"] = ud["seen"] + [ud.item]
            return "stop" if ud.item == break_on else "next"
        smach.Iterator.set_contained_state(
            "LOOK", smach.CBState(look, outcomes=["next", "stop"]), loop_outcomes=["next"],
            final_outcome_map={"stop": "found"},
        )
    ud = smach.UserData()
    return it.execute(ud), ud.seen, sorted(map(str, map(tuple, it.get_internal_edges())))


show("iterator", *iterate(2))
show("iterator", *iterate(9))

# Concurrences: outcome map, outcome function, early end, preemption, failures.
def at_once(**options):
    states = options.pop("states")
    cc = smach.Concurrence(outcomes=["good", "bad", "preempted"], default_outcome="bad", **options)
    with cc:
        for label, state in states.items():
            smach.Concurrence.add(label, state, {"n": "n" + label} if label in "AB" else {})
    cc.userdata.nA = cc.userdata.nB = 5
    return cc


def fixed(outcome, *outcomes):
    return smach.CBState(lambda ud: outcome, outcomes=[outcome, *outcomes])


cc = at_once(states={"A": Count(), "B": Count()}, outcome_map={"good": {"A": "done", "B": "done"}})
show("concurrence", cc.execute(), cc.userdata.nA, cc.userdata.nB, set(cc.get_internal_edges()))
cc = at_once(
    states={"X": fixed("x", "y"), "Y": fixed("y")},
    outcome_map={"good": {"X": "y"}, "preempted": {"X": "x", "Y": "y"}, "bad": {"X": "x"}},
)
show("map", cc.execute())
cc = at_once(states={"X": fixed("x")}, outcome_cb=lambda out: "good" if out == {"X": "x"} else None)
show("function", cc.execute())
cc = at_once(
    states={"X": fixed("x"), "W": Wait()},
    child_termination_cb=lambda out: out["X"] == "x",
    outcome_map={"good": {"W": "preempted"}},
)
show("early", cc.execute())
for obeys in True, False:
    waits = Wait(obeys)
    cc = at_once(states={"W": waits}, outcome_map={"good": {"W": "preempted"}})
    threading.Thread(target=lambda: (waits.running.wait(), cc.request_preempt())).start()
    show("preempted", cc.execute(), waits.preempt_requested(), cc.preempt_requested())
cc = at_once(states={"X": smach.CBState(lambda ud: 1 / 0, outcomes=["x"])})
failed("child fails", cc.execute)
failed("no children", at_once(states={}).execute)
failed("no such outcome", lambda: smach.Concurrence(["a"], "b"))

# Preemption of a machine, whose state obeys or does not.
for obeys in True, False:
    waits, then = Wait(obeys), Wait()
    sm = smach.StateMachine(["done", "preempted"])
    with sm:
        smach.StateMachine.add("WAIT", waits, {"preempted": "preempted" if obeys else "THEN"})
        smach.StateMachine.add("THEN", then)
    threading.Thread(target=lambda: (waits.running.wait(), sm.request_preempt())).start()
    show("preempt", sm.execute(), sm.preempt_requested(), waits.preempt_requested())

# Mistakes.
def add(*arguments):
    sm = smach.StateMachine(["done"])
    with sm:
        smach.StateMachine.add("A", Count(), {"more": "A"})
        smach.StateMachine.add(*arguments)


def misplace():
    with smach.Concurrence(["a"], "a"):
        smach.StateMachine.add("A", Count())


smach.Container._construction_stack[:] = []
failed("same label", lambda: add("A", Count()))
smach.Container._construction_stack[:] = []
failed("unknown outcome", lambda: add("B", Count(), {"other": "A"}))
smach.Container._construction_stack[:] = []
failed("outside", lambda: smach.StateMachine.add("A", Count()))
failed("misplaced", misplace)
smach.Container._construction_stack[:] = []
broken = smach.StateMachine(["done"])
with broken:
    smach.StateMachine.add("A", Count(), {"more": "NOWHERE"})
failed("inconsistent", broken.check_consistency)
failed("executed anyway", broken.execute)
wrong = smach.StateMachine(["x"])
with wrong:
    smach.StateMachine.add("A", smach.CBState(lambda ud: "y", outcomes=["x"]))
failed("wrong outcome", wrong.execute)
fails = smach.StateMachine(["x"])
with fails:
    smach.StateMachine.add("A", smach.CBState(lambda ud: ud.missing, outcomes=["x"]))
failed("undeclared key", fails.execute)

# User data.
class Thing:
    def __init__(self):
        self.value = [1]


data = smach.UserData()
data.thing, data.a, data["b c"] = Thing(), 1, 2
seen = smach.Remapper(data, ["thing", "x"], ["x", "y"], {"x": "a", "y": "z"})
show("remapped", seen.x, seen["x"], "x" in seen, "a" in seen, "y" in seen)
seen.y, seen.x = 5, 4
seen.nothing = 3
show("written", data.z, data.a, "nothing" in data, sorted(data.keys()))
thing = seen.thing
thing.value = 2
show("read only", thing.value, seen.thing.value, data.thing.value)
failed("not deleted", lambda: delattr(thing, "value"))
failed("not an input", lambda: seen.z)
failed("no such key", lambda: data.nothing)
taken = data.extract(["a", "z"], {"p": "a"})
show("extracted", sorted(taken.keys()), taken.p)
data.merge(taken, ["p"], {"p": "q"})
show("merged", data.q)


@smach.cb_interface(outcomes=["new"], input_keys=["i"], output_keys=["o"])
def declared(ud):
    ud.o = ud.i + 1
    return "new"


state = smach.CBState(declared, io_keys=["io"])
show(
    "interface", set(state.get_registered_outcomes()), set(state.get_registered_input_keys()),
    set(state.get_registered_output_keys()), smach.has_smach_interface(declared),
)
