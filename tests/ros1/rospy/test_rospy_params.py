"""rospy's parameters, master and names; the outputs are those of real rospy 1.15."""

from __future__ import annotations

import pytest
from network import Network

from .rospy_programs import Printed, run

BEGIN = """
    import rospy
    rospy.init_node("me")
"""


@pytest.fixture
def printed(network: Network) -> Printed:
    return lambda script: run(network, BEGIN + script)


def test_names_that_only_some_tools_take(network: Network) -> None:
    lines = run(
        network,
        BEGIN
        + """
    import warnings
    warnings.simplefilter("always")
    warnings.showwarning = lambda message, *_: print(message, flush=True)
    rospy.set_param("/p/bad name", 1)
    rospy.set_param("1p", 2)
    rospy.set_param("~fine", 3)
    print(rospy.get_param("/p/bad name"), rospy.get_param("/1p"), rospy.has_param("~fine"))
""",
    )
    problem = "is not a legal ROS graph resource name. This may cause problems with other ROS tools"
    assert lines == [f"'/p/bad name' {problem}", f"'1p' {problem}", "1 2 True"]


def test_parameters(network: Network) -> None:
    lines = run(
        network,
        BEGIN
        + """
    print(rospy.get_param("~p"), rospy.get_param("~l"), rospy.get_param("~"))
    rospy.set_param("a", 1)
    rospy.set_param("~b", "x")
    rospy.set_param("/c/d", (1, 2))
    rospy.set_param("/c/e", {"x": 1.5, "y": {"z": True}})
    print(rospy.get_param("/a"), rospy.get_param("/me/b"), rospy.get_param("c"))
    print(rospy.has_param("a"), rospy.has_param("~none"), rospy.has_param("/c"))
    print(rospy.search_param("b"), rospy.search_param("a"), rospy.search_param("none"))
    print([n for n in rospy.get_param_names() if n.startswith(("/a", "/me", "/c"))])
    print(rospy.get_param_cached("/c/e/y/z"), rospy.get_param("none", None))
    rospy.delete_param("a")
    for name in ("a", "/none", "~none"):
        show("get", lambda: rospy.get_param(name))
        show("delete", lambda: rospy.delete_param(name))
    show("cached", lambda: rospy.get_param_cached("none"))
    show("none", lambda: rospy.set_param("x", None))
    show("object", lambda: rospy.set_param("x", {"y": object()}))
    show("number", lambda: rospy.set_param(3, 1))
    print(rospy.get_param("none", default=4), rospy.get_param(3, 5))
""",
        "_p:=3",
        "_l:=[1, two]",
    )
    assert lines[:13] == [
        "3 [1, 'two'] {'p': 3, 'l': [1, 'two']}",
        "1 x {'d': [1, 2], 'e': {'x': 1.5, 'y': {'z': True}}}",
        "True False True",
        "/me/b /a None",
        "['/a', '/c/d', '/c/e/x', '/c/e/y/z', '/me/b', '/me/l', '/me/p']",
        "True None",
        "get -> KeyError | 'a'",
        "delete -> KeyError | 'a'",
        "get -> KeyError | '/none'",
        "delete -> KeyError | '/none'",
        "get -> KeyError | '~none'",
        "delete -> KeyError | '~none'",
        "cached -> KeyError | 'none'",
    ]
    assert [line.partition(" | ")[0] for line in lines[13:16]] == [
        "none -> TypeError",
        "object -> TypeError",
        "number -> TypeError",
    ]
    assert lines[16] == "4 5"


def test_the_master(printed: Printed) -> None:
    assert printed("""
    from std_msgs.msg import String
    from std_srvs.srv import Empty
    import time
    out = rospy.Publisher("x", String, queue_size=1)
    rospy.Subscriber("x", String, print)
    rospy.Service("s", Empty, lambda r: [])
    while not out.get_num_connections():
        time.sleep(0.002)
    rospy.wait_for_service("s")
    master = rospy.get_master()
    code, text, (published, heard, served) = master.getSystemState()
    print(code, text, [x for x in published if x[0] == "/x"], [x for x in heard if x[0] == "/x"])
    print([x for x in served if x[0] == "/s"])
    print(["/x", "std_msgs/String"] in master.getTopicTypes()[2])
    print(master.getPublishedTopics("/")[:2], rospy.get_published_topics("/nothing"))
    print(master.lookupNode("/me")[:2], master.lookupNode("/you"))
    print(master.lookupService("/s")[:2], master.lookupService("/t"))
    master["p"] = [1]
    print(master["p"], "p" in master, "q" in master, "/p" in list(master))
    del master["p"]
    show("gone", lambda: master["p"])
    show("other", lambda: master.registerPublisher("x"))
    print(master.getPid()[0], master.hasParam("/p"), master.getParam("/p"))
""")[:-2] == [
        "1 current system state [['/x', ['/me']]] [['/x', ['/me']]]",
        "[['/s', ['/me']]]",
        "True",
        "[1, 'current topics'] []",
        "[1, 'node api'] [-1, 'unknown node [/you]', '']",
        "[1, 'rosrpc URI'] [-1, 'no provider', '']",
        "[1] True False True",
        "gone -> KeyError | 'p'",
    ]


def test_names(network: Network) -> None:
    script = """
        import rospy
        import rospy.names as names
        print(names.get_mappings(), names.get_resolved_mappings(), rospy.resolve_name("~a"))
        rospy.init_node("me")
        print(names.get_mappings(), names.get_resolved_mappings())
        for name in ("", "a", "/a", "~a", "a/", "//a//b", "~", "x", "ns/y", "/x"):
            print(repr(name), rospy.resolve_name(name), rospy.remap_name(name))
        print(rospy.resolve_name("a", "/p/q"), rospy.resolve_name("~a", "/p/q"))
        print(names.canonicalize_name("/a//b/"), names.make_global_ns("a"))
        print(names.namespace("/a/b"), names.namespace("/a"), names.ns_join("/a", "b"))
        print(names.scoped_name("/ns/me", "/ns/x/y"), names.is_global("/a"), names.is_private("~a"))
    """
    assert run(network, script, "x:=xx", "/ns/y:=/yy") == [
        "{'x': 'xx', '/ns/y': '/yy'} {} /unnamed/a",
        "{'x': 'xx', '/ns/y': '/yy'} {'/x': '/xx', '/ns/y': '/yy'}",
        "'' / ",
        "'a' /a a",
        "'/a' /a /a",
        "'~a' /me/a ~a",
        "'a/' /a a/",
        "'//a//b' /a/b //a//b",
        "'~' /me/ ~",
        "'x' /xx /xx",
        "'ns/y' /yy ns/y",
        "'/x' /xx /xx",
        "/p/a /p/q/a",
        "/a/b /a/",
        "/a/ / /a/b",
        "x/y True True",
    ]
    inside = run(network, script, "x:=xx", "__ns:=/deep", "__name:=you")
    assert inside[1] == ("{'x': 'xx', '__ns': '/deep', '__name': 'you'} {'/deep/x': '/deep/xx'}")
    assert inside[2:6] == ["'' /deep/ ", "'a' /deep/a a", "'/a' /a /a", "'~a' /deep/you/a ~a"]


def test_missing_names_say_what_to_use_instead(network: Network) -> None:
    lines = run(
        network,
        """
        import rospy, rospy.impl
        show("typo", lambda: rospy.Subscribr)
        show("tcpros", lambda: rospy.topics.get_topic_manager)
        show("handler", lambda: rospy.impl.tcpros_base.TCPROSTransport)
        from rospy.impl.tcpros_base import DEFAULT_BUFF_SIZE
        from rospy.impl.tcpros_service import ServiceProxy
        print(DEFAULT_BUFF_SIZE, ServiceProxy is rospy.ServiceProxy)
        from rospy.exceptions import ROSInitException
        from rospy.core import loginfo, is_shutdown_requested, get_caller_id
        from rospy.rostime import wallsleep
        print(rospy.Header, rospy.msproxy.MasterProxy is rospy.MasterProxy)
        import rospy.nothing
        """,
        code=1,
    )
    assert lines[0] == (
        "typo -> AttributeError | module 'rospy' of rosz has no attribute 'Subscribr';"
        " did you mean 'Subscriber'?"
    )
    assert "no attribute 'get_topic_manager'; messages travel over Zenoh" in lines[1]
    assert "module 'rospy.impl.tcpros_base' of rosz has no attribute" in lines[2]
    assert lines[3:5] == ["65536 True", "<class 'rosz.msgs.std_msgs.msg.Header'> True"]
    assert lines[-1] == "ModuleNotFoundError: No module named 'rospy.nothing'"
