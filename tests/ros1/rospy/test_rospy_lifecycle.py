"""The node of rospy, from init_node to shutdown; the outputs are those of real rospy 1.15."""

from __future__ import annotations

import signal

import pytest
from network import Network, eventually

from .rospy_programs import Printed, run, start

HOOKS = """
    import sys, threading, time
    import rospy

    def say(*words):
        print(" ".join(map(str, words)) + "\\n", end="", flush=True)

    rospy.on_shutdown(lambda: say("hook 1", rospy.is_shutdown()))
    rospy.init_node("life")
    rospy.on_shutdown(lambda: say("hook 2"))
    rospy.core.add_shutdown_hook(lambda reason: say("last", reason))
    rospy.core.add_preshutdown_hook(lambda reason: say("before", reason))
"""
STOPPED = ["ready", "hook 1 False", "hook 2"]


def ended(reason: str) -> list[str]:
    return [*STOPPED, f"before {reason}", f"last {reason}"]


def test_before_init_node(printed: Printed) -> None:
    assert printed("""
        import rospy
        from std_msgs.msg import String
        from std_srvs.srv import Empty
        show("shut down", rospy.is_shutdown)
        show("initialized", rospy.core.is_initialized)
        show("name", rospy.get_name)
        show("namespace", rospy.get_namespace)
        show("uri", rospy.get_node_uri)
        show("time", rospy.get_time)
        show("rate", lambda: rospy.Rate(10))
        show("sleep", lambda: rospy.sleep(0.001))
        show("info", lambda: rospy.loginfo("not shown"))
        show("spin", rospy.spin)
        show("param", lambda: rospy.get_param("~none"))
        show("default", lambda: rospy.get_param("~none", 3))
        show("private", lambda: rospy.Publisher("~x", String, queue_size=1))
        show("topic", lambda: rospy.Publisher("x", String, queue_size=1).name)
        show("publish", lambda: rospy.Publisher("x", String, queue_size=1).publish("a"))
        show("proxy", lambda: rospy.ServiceProxy("none", Empty)())
        show("hook", lambda: rospy.on_shutdown(3))
        """) == [
        "shut down -> False",
        "initialized -> False",
        "name -> '/unnamed'",
        "namespace -> '/'",
        "uri -> None",
        "time -> ROSInitException | time is not initialized. Have you called init_node()?",
        "rate -> ROSInitException | time is not initialized. Have you called init_node()?",
        "sleep -> None",
        "info -> None",
        "spin -> ROSInitException | client code must call rospy.init_node() first",
        "param -> KeyError | '~none'",
        "default -> 3",
        "private -> ValueError | ~name topics cannot be created before init_node() has been called",
        "topic -> '/x'",
        "publish -> ROSException | ROS node has not been initialized yet."
        " Please call init_node() first",
        "proxy -> ServiceException | service [/none] unavailable",
        "hook -> TypeError | shutdown hook [3] must be a function or callable object:"
        " <class 'int'>",
    ]


def test_warnings_before_init_node_go_to_stderr_as_python_logs_them(network: Network) -> None:
    assert run(network, "import rospy\nrospy.logwarn('early %d', 1)\n") == ["early 1"]


def test_init_node_twice(printed: Printed) -> None:
    lines = printed("""
        import sys
        import rospy
        sys.argv[0] = "node.py"
        show("empty", lambda: rospy.init_node(""))
        show("namespace", lambda: rospy.init_node("a/b"))
        show("first", lambda: rospy.init_node("one"))
        show("same", lambda: rospy.init_node("one"))
        show("other", lambda: rospy.init_node("two"))
        show("name", rospy.get_name)
        """)
    assert lines == [
        "empty -> ValueError | name must not be empty",
        "namespace -> ValueError | namespaces are not allowed in node names",
        "first -> None",
        "same -> None",
        "other -> ROSException | rospy.init_node() has already been called with different"
        " arguments: ('one', ['node.py'], False, None, False, False)",
        "name -> '/one'",
    ]


def test_names_come_from_the_command_line(network: Network) -> None:
    script = """
        import os, rospy
        rospy.init_node("me", anonymous=True)
        print(rospy.get_name().replace(str(os.getpid()), "PID").rstrip("0123456789"))
        print(rospy.get_namespace())
    """
    assert run(network, script) == ["/me_PID_", "/"]
    assert run(network, script, "__name:=you", "__ns:=/far/away") == ["/far/away/you", "/far/away/"]
    assert run(network, script, "__name:=it", ROS_NAMESPACE="home") == ["/home/it", "/home/"]


def test_argv_replaces_the_command_line(network: Network) -> None:
    assert run(
        network,
        """
        import rospy
        rospy.init_node("me", argv=["prog", "a:=/b", "__name:=other", "_p:=[1, 2]"])
        print(rospy.get_name(), rospy.resolve_name("a"), rospy.get_param("~p"))
        print(rospy.myargv(), rospy.myargv(["x", "a:=b", "-v", "__name:=q"]))
        """,
        "kept",
        "gone:=1",
    )[0:1] == ["/other /b [1, 2]"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda n: n.name)
@pytest.mark.parametrize(
    ("body", "after"),
    [
        ("rospy.spin()", []),
        ("rate = rospy.Rate(10)\nwhile not rospy.is_shutdown(): rate.sleep()", []),
        ("while not rospy.is_shutdown(): rospy.sleep(0.05)", []),
        ("while not rospy.is_shutdown(): time.sleep(0.05)", []),
        ("rospy.wait_for_service('/nobody')", ["ROSInterruptException rospy shutdown"]),
        ("rospy.sleep(60)", ["ROSInterruptException ROS shutdown request"]),
        ("rospy.Rate(0.01).sleep()", ["ROSInterruptException ROS shutdown request"]),
    ],
    ids=["spin", "rate", "short sleeps", "time.sleep", "wait_for_service", "sleep", "slow rate"],
)
def test_signals_shut_the_node_down(
    network: Network, number: signal.Signals, body: str, after: list[str]
) -> None:
    steps = body.replace("\n", "\n        ")
    program = start(
        network,
        HOOKS
        + f"""
    rospy.is_shutdown()
    say("ready")
    try:
        {steps}
    except rospy.ROSInterruptException as error:
        say(type(error).__name__, error)
    say("end", rospy.is_shutdown())
""",
    )
    program.wait_for("ready")
    program.send(number)
    assert program.exit_code() == 0, program.output
    # A loop that checks the flag may end before the last hooks have run.
    assert sorted(program.lines) == sorted([*ended(f"signal-{number.value}"), *after, "end True"])
    assert program.lines[: len(STOPPED)] == STOPPED


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda n: n.name)
def test_a_second_signal_ends_a_program_that_does_not_check(
    network: Network, number: signal.Signals
) -> None:
    program = start(
        network,
        """
        import time, rospy
        rospy.init_node("unaware")
        stopped = []
        rospy.on_shutdown(lambda: stopped.append(True))
        print("ready", flush=True)
        while True:
            time.sleep(0.01)
            if stopped:
                print(stopped.pop(), flush=True)
        """,
    )
    program.wait_for("ready")
    program.send(number)
    program.wait_for("True")  # as in rospy, the first one raises nothing

    def sent_again() -> bool:  # within 0.1 s it counts as the first one
        program.send(number)
        return program.process.poll() is not None

    eventually(sent_again, "the end")
    assert program.exit_code() == 128 + number


def test_the_main_thread_waits_while_hooks_run(network: Network) -> None:
    """What a hook publishes, such as a stop, is the last that is published."""
    program = start(
        network,
        """
        import time, rospy
        rospy.init_node("loop")
        lines = []
        def hook():
            lines.append("begin")
            rospy.sleep(0.3)
            lines.append("end")
        rospy.on_shutdown(hook)
        print("ready", flush=True)
        while not rospy.is_shutdown():
            lines.append("moves")
            time.sleep(0.001)
        print(lines[lines.index("begin"):])
        """,
    )
    program.wait_for("ready")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
    assert program.lines[-1] == "['begin', 'end']"


def test_signals_left_to_the_program(network: Network) -> None:
    program = start(
        network,
        """
        import os, signal, sys, threading, rospy
        rospy.init_node("own", disable_signals=True)
        main = threading.get_ident()
        def interrupt():
            names = []
            while "spin" not in names or names[0] != "_wait":
                frame, names = sys._current_frames()[main], []
                while frame is not None:
                    names.append(frame.f_code.co_name)
                    frame = frame.f_back
            os.kill(os.getpid(), signal.SIGINT)
        threading.Thread(target=interrupt).start()
        try:
            rospy.spin()
        except KeyboardInterrupt:
            print("never")
        print("end", rospy.is_shutdown())
        """,
    )
    assert program.exit_code() == 0
    assert program.lines == ["end True"]


@pytest.mark.parametrize(
    ("body", "code"),
    [("pass", 0), ("sys.exit(4)", 4), ("raise ValueError('boo')", 1)],
    ids=["end", "exit", "exception"],
)
def test_hooks_run_at_exit(network: Network, body: str, code: int) -> None:
    lines = run(network, f"{HOOKS}\n    say('ready')\n    {body}\n", code=code)
    assert [line for line in lines if line in ended("atexit")] == ended("atexit")
    assert ("ValueError: boo" in lines) is (code == 1)


def test_signal_shutdown_ends_waits_of_other_threads(network: Network) -> None:
    lines = run(
        network,
        HOOKS
        + """
    from std_msgs.msg import String
    def wait():
        try:
            rospy.wait_for_message("/nothing", String)
        except rospy.ROSInterruptException as error:
            say("waiter", error)
    thread = threading.Thread(target=wait)
    thread.start()
    say("ready")
    rospy.signal_shutdown("enough")
    rospy.signal_shutdown("again")
    thread.join()
    show("spin", rospy.spin)
    show("late hook", lambda: rospy.on_shutdown(lambda: say("at once")))
    show("publisher", lambda: rospy.Publisher("x", String, queue_size=1).publish("a"))
    show("subscriber", lambda: rospy.Subscriber("x", String, print).name)
""",
    )
    assert sorted(lines[:6]) == sorted([*ended("enough"), "waiter rospy shutdown"])
    assert lines[6:] == [
        "spin -> None",
        "at once",
        "late hook -> None",
        "publisher -> None",
        "subscriber -> '/x'",
    ]


def test_hooks_may_use_the_node(network: Network) -> None:
    program = start(
        network,
        """
        import sys
        import rospy
        from std_msgs.msg import String
        from std_srvs.srv import Trigger
        rospy.init_node("robot")
        heard = []
        rospy.Subscriber("stop", String, lambda m: heard.append(m.data))
        stop = rospy.Publisher("stop", String, queue_size=1)
        while not stop.get_num_connections():
            rospy.sleep(0.01)
        rospy.Service("brake", Trigger, lambda request: (True, "braking"))
        def hook():
            stop.publish("halt")
            while not heard:
                rospy.sleep(0.01)
            print(heard, rospy.ServiceProxy("brake", Trigger)().message, flush=True)
        rospy.on_shutdown(hook)
        rospy.on_shutdown(lambda: 1 / 0)
        rospy.on_shutdown(lambda: sys.exit("in a hook"))
        rospy.on_shutdown(lambda: print("last", flush=True))
        rospy.is_shutdown()
        print("ready", flush=True)
        rospy.spin()
        """,
    )
    program.wait_for("ready")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
    assert program.lines[1] == "['halt'] braking"
    assert program.lines[-1] == "last"
    assert "ZeroDivisionError: division by zero" in program.lines
    assert "SystemExit: in a hook" in program.lines


def test_a_new_node_of_the_same_name_takes_over(network: Network) -> None:
    script = """
        import rospy
        rospy.init_node("only")
        rospy.on_shutdown(lambda: print("replaced", flush=True))
        print("ready", flush=True)
        rospy.spin()
        print("end", rospy.is_shutdown())
    """
    older = start(network, script)
    older.wait_for("ready")
    newer = start(network, script)
    newer.wait_for("ready")
    assert older.exit_code() == 0
    assert older.lines[-2:] == ["replaced", "end True"]
    newer.send(signal.SIGINT)
    assert newer.exit_code() == 0


def test_spin_on_another_thread(printed: Printed) -> None:
    assert printed("""
        import threading, rospy
        rospy.init_node("spinner")
        thread = threading.Thread(target=rospy.spin)
        thread.start()
        rospy.signal_shutdown("enough")
        thread.join(60)
        print(thread.is_alive())
        """) == ["False"]


def test_other_nodes_see_the_node(network: Network) -> None:
    node = network.node("watcher")
    program = start(
        network,
        """
        import rospy
        from std_msgs.msg import String
        rospy.init_node("seen", argv=["p", "__ns:=/deep"])
        rospy.Publisher("out", String, queue_size=3)
        rospy.Subscriber("~in", String, print)
        print(rospy.get_published_topics("/deep"), flush=True)
        rospy.spin()
        """,
    )
    program.wait_for("[['/deep/out', 'std_msgs/String']]")
    graph = node.context.graph
    eventually(lambda: "/deep/seen/in" in graph.view().topics(), "the subscription")
    assert "/deep/seen" in graph.view().nodes()
    eventually(lambda: "/deep/seen/set_logger_level" in graph.view().services(), "its services")
    assert "/deep/seen/get_loggers" in graph.view().services()
