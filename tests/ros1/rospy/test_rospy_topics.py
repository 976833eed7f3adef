"""rospy's publishers and subscribers; the outputs are those of real rospy 1.15."""

from __future__ import annotations

import threading

import pytest
from network import TIMEOUT, Network

from rosz.msgs.std_msgs.msg import String

from .rospy_programs import Printed, run, start

BEGIN = """
    import threading, time, warnings
    import rospy
    from geometry_msgs.msg import PointStamped
    from std_msgs.msg import Empty, Header, Int32, String

    rospy.init_node("topics")

    def until(condition):
        while not condition():
            time.sleep(0.002)
"""


@pytest.fixture
def printed(network: Network) -> Printed:
    return lambda script: run(network, BEGIN + script)


def test_arguments_of_publish(printed: Printed) -> None:
    lines = printed("""
    text = rospy.Publisher("text", String, queue_size=1)
    got = []
    rospy.Subscriber("text", String, lambda m: got.append(m.data))
    until(text.get_num_connections)
    show("value", lambda: text.publish("a"))
    show("message", lambda: text.publish(String("b")))
    show("keyword", lambda: text.publish(data="c"))
    show("nothing", lambda: text.publish())
    show("none", lambda: text.publish(None))
    show("two", lambda: text.publish(1, 2))
    show("both", lambda: text.publish("a", data="b"))
    show("other keyword", lambda: text.publish(dta="b"))
    show("other type", lambda: text.publish(Int32(3)))
    show("wrong value", lambda: text.publish(5))
    until(lambda: len(got) == 5)
    print(got)
    empty = rospy.Publisher("empty", Empty, queue_size=1)
    show("empty", lambda: empty.publish())
    show("not empty", lambda: empty.publish(1))
    number = rospy.Publisher("number", Int32, queue_size=1)
    show("unheard", lambda: number.publish("x"))
""")
    assert lines[:-2] == [
        "value -> None",
        "message -> None",
        "keyword -> None",
        "nothing -> None",
        "none -> None",
        "two -> TypeError | Invalid number of arguments, args should be ['data'] args are(1, 2)",
        "both -> TypeError | publish() can be called with arguments or keywords, but not both.",
        "other keyword -> AttributeError | dta is not an attribute of String",
        "other type -> TypeError | expected [string] but got [std_msgs/Int32]",
        "wrong value -> ROSSerializationException"
        " | field data must be of type bytes or an ascii string",
        "['a', 'b', 'c', '', '']",
        "empty -> None",
        "not empty -> TypeError | Invalid number of arguments, args should be [] args are(1,)",
    ]
    # Without subscribers rospy warns instead of raising an exception.
    assert "a message on '/number' cannot be published" in lines[-2]
    assert lines[-1] == "unheard -> None"


def test_invalid_topics(printed: Printed) -> None:
    assert printed("""
    show("name", lambda: rospy.Publisher("", String, queue_size=1))
    show("no class", lambda: rospy.Publisher("a", None, queue_size=1))
    show("no type", lambda: rospy.Publisher("a", "std_msgs/String", queue_size=1))
    show("no message", lambda: rospy.Subscriber("a", str, print))
    show("queue", lambda: rospy.Subscriber("a", String, print, queue_size="x"))
    show("buffer", lambda: rospy.Subscriber("a", String, print, buff_size=-1))
    gone = rospy.Publisher("a", String, queue_size=1)
    gone.unregister()
    gone.unregister()
    show("gone", lambda: gone.publish("x"))
    full = rospy.Publisher("~b", String, None, True, True, {"x": "y"}, 5)
    print(full.name, full.resolved_name, full.type, full.data_class is String, full.reg_type)
    half = rospy.Subscriber("c", String, print, 3, buff_size=10, tcp_nodelay=True)
    print(half.name, half.callback is print, half.callback_args, half.impl is not None)
""") == [
        "name -> ValueError | topic name is not a non-empty string",
        "no class -> ValueError | topic parameter 'data_class' is not initialized",
        "no type -> ValueError | data_class [std_msgs/String] is not a class",
        "no message -> ValueError | data_class [type] is not a message data class",
        "queue -> ROSException | queue size must be an integer",
        "buffer -> ROSException | buffer size must be a positive integer",
        "gone -> ROSException | publish() to an unregistered() handle",
        "/topics/b /topics/b std_msgs/String True pub",
        "/c True 3 True",
    ]


def test_a_missing_queue_size_warns(network: Network) -> None:
    lines = run(network, BEGIN + "\n    rospy.Publisher('x', String)\n", PYTHONWARNINGS="always")
    assert "SyntaxWarning: The publisher should be created with an explicit keyword" in lines[0]
    assert lines[1].strip() == "rospy.Publisher('x', String)"


def test_subscribers_of_a_topic_share_a_thread(printed: Printed) -> None:
    assert printed("""
    calls, threads = [], set()
    def first(m):
        threads.add(threading.get_ident())
        calls.append("a" + m.data)
    def second(m, extra):
        threads.add(threading.get_ident())
        calls.append("b" + m.data + extra)
    out = rospy.Publisher("x", String, queue_size=10)
    a = rospy.Subscriber("x", String, first)
    b = rospy.Subscriber("x", String, second, callback_args="!")
    until(out.get_num_connections)
    until(a.get_num_connections)
    for i in range(3):
        out.publish(str(i))
    until(lambda: len(calls) == 6)
    print(calls, len(threads), out.get_num_connections(), a.get_num_connections())
    print(a.impl is b.impl)
    a.unregister()
    out.publish("z")
    until(lambda: len(calls) == 7)
    print(calls[-1])
    b.unregister()
    until(lambda: not out.get_num_connections())
""") == ["['a0', 'b0!', 'a1', 'b1!', 'a2', 'b2!'] 1 1 1", "True", "bz!"]


def test_a_failing_callback_does_not_stop_the_others(printed: Printed) -> None:
    lines = printed("""
    got = []
    def bad(m):
        raise ValueError("boom")
    out = rospy.Publisher("x", String, queue_size=10)
    rospy.Subscriber("x", String, bad)
    rospy.Subscriber("x", String, got.append)
    until(out.get_num_connections)
    out.publish("1")
    out.publish("2")
    until(lambda: len(got) == 2)
""")
    assert "bad callback: <function bad at 0x" in lines[0]
    assert lines[1] == "Traceback (most recent call last):"
    assert "in bad" in lines[2]
    assert lines[-2:] == ["ValueError: boom", ""]


def test_latched_messages_reach_later_subscribers_of_the_process(printed: Printed) -> None:
    assert printed("""
    got = []
    out = rospy.Publisher("x", String, latch=True, queue_size=1)
    out.publish("one")
    a = rospy.Subscriber("x", String, lambda m: got.append("a " + m.data))
    until(lambda: got == ["a one"])
    b = rospy.Subscriber("x", String, lambda m: got.append("b " + m.data))
    until(lambda: got == ["a one", "b one"])
    plain = rospy.Publisher("x", String, queue_size=1)
    plain.publish("two")
    until(lambda: len(got) == 4)
    c = rospy.Subscriber("x", String, lambda m: got.append("c " + m.data))
    until(lambda: len(got) == 5)
    print(got[2:], rospy.wait_for_message("x", String, 60).data, plain.impl is out.impl)
""") == ["['a two', 'b two', 'c two'] two True"]


def test_a_second_publisher_can_make_a_topic_latch(printed: Printed) -> None:
    assert printed("""
    plain = rospy.Publisher("x", String, queue_size=1)
    rospy.Publisher("x", String, latch=True, queue_size=1)
    plain.publish("kept")
    print(rospy.wait_for_message("x", String, 60).data, plain.impl.ref_count)
""") == ["kept 2"]


def test_topics_created_before_init_node(network: Network) -> None:
    assert run(
        network,
        """
        import threading, rospy
        from std_msgs.msg import String
        from std_srvs.srv import Trigger
        came = threading.Event()
        out = rospy.Publisher("x", String, queue_size=1, latch=True)
        rospy.Subscriber("x", String, lambda m: came.set())
        rospy.Service("s", Trigger, lambda request: (True, "served"))
        rospy.init_node("late")
        out.publish("now")
        print(came.wait(60), out.name, rospy.ServiceProxy("s", Trigger)().message)
        """,
        "x:=y",
    ) == ["True /y served"]


def test_headers_are_numbered(printed: Printed) -> None:
    assert printed("""
    got = []
    out = rospy.Publisher("x", PointStamped, queue_size=10)
    rospy.Subscriber("x", PointStamped, got.append)
    until(out.get_num_connections)
    message = PointStamped(header=Header(stamp=rospy.Time(3), frame_id="map"))
    message.header.seq = 55
    for _ in range(2):
        out.publish(message)
        print(message.header.seq, message.header.stamp)
    until(lambda: len(got) == 2)
    print([(m.header.seq, m.header.stamp.to_sec(), m.header.frame_id) for m in got])
""") == ["1 3000000000", "2 3000000000", "[(1, 3.0, 'map'), (2, 3.0, 'map')]"]


def test_slow_callbacks_receive_the_newest_messages(printed: Printed) -> None:
    first, last = printed("""
    seen, go, busy = [], threading.Event(), threading.Event()
    def slow(m):
        seen.append(m.data)
        busy.set()
        go.wait()
    rospy.Subscriber("x", Int32, slow, queue_size=1)
    out = rospy.Publisher("x", Int32, queue_size=100)
    until(out.get_num_connections)
    out.publish(0)
    busy.wait()
    everything = []
    rospy.Subscriber("y", Int32, lambda m: everything.append(m.data))
    other = rospy.Publisher("y", Int32, queue_size=0)
    until(other.get_num_connections)
    for i in range(1, 2000):
        out.publish(i)
        other.publish(i)
    until(lambda: len(everything) == 1999)
    go.set()
    until(lambda: len(seen) == 2)
    print(seen)
    print(everything == list(range(1, 2000)))
""")
    assert (first, last) == ("[0, 1999]", "True")


def test_the_header_of_a_message_waits_for_the_token_of_its_publisher(printed: Printed) -> None:
    (line,) = printed("""
    import threading, time
    from rosz.qos import QoS
    from rosz.ros1.client.rospy import shared
    from rosz.ros1.state import context
    from rosz.wire import Kind, Token, entity_key, format_token, gid, pack_attachment
    shared._ORIGIN_TIMEOUT = 60  # a busy machine may take longer to start a thread
    session = context().session
    kind = "std_msgs/msg/String", String._type_hash
    domain = context().domain
    token = Token(domain=domain, zid=session.zid, node_id=900, entity_id=901, kind=Kind.PUBLISHER,
                  namespace="/", node="late", name="/x", type_name=kind[0], type_hash=kind[1],
                  qos=QoS())
    callers, tokens = [], []
    def declare():
        tokens.append(session.token(format_token(token)))
    def receive(message):
        threading.Thread(target=declare).start()
        callers.append(message._connection_header["callerid"])
    rospy.Subscriber("x", String, receive)
    attachment = pack_attachment(1, time.time_ns(), gid(format_token(token)))
    session.put(entity_key(domain, "/x", *kind), String._encode(String("a")), attachment=attachment)
    until(lambda: callers)
    print(callers)
""")
    assert line == "['/late']"


def test_any_message(printed: Printed) -> None:
    lines = printed("""
    got, known = [], []
    rospy.Subscriber("x", rospy.AnyMsg, got.append)
    rospy.Subscriber("x", String, lambda m: known.append((m.data, m._connection_header)))
    out = rospy.Publisher("x", String, queue_size=1)
    until(lambda: out.get_num_connections() == 2)
    out.publish("abc")
    until(lambda: got and known)
    message, header = got[0], got[0]._connection_header
    print(sorted(header))
    print([header[k] for k in ("type", "topic", "callerid", "latching", "md5sum")])
    print(known[0][0], known[0][1] == header)
    print(String().deserialize(message._buff).data)
    copy = rospy.Publisher("copy", rospy.AnyMsg, queue_size=1, latch=True)
    show("unknown", lambda: copy.publish(rospy.AnyMsg()))
    copy.publish(message)
    print(rospy.wait_for_message("copy", String, 60).data)
""")
    assert lines[:4] == [
        "['callerid', 'latching', 'md5sum', 'message_definition', 'topic', 'type']",
        "['std_msgs/String', '/x', '/topics', '0', '992ce8a1687cec8c8bd883ec73ca41d1']",
        "abc True",
        "abc",
    ]
    assert "cannot publish on '/copy': its type is not known" in lines[4]
    assert lines[5] == "abc"


def test_a_listener_is_notified_of_each_subscriber(printed: Printed) -> None:
    assert printed("""
    class Greeter(rospy.SubscribeListener):
        def peer_subscribe(self, topic, publish, publish_to_it):
            publish_to_it(String("hello, only you"))
            publish(String("hello, all"))
        def peer_unsubscribe(self, topic, left):
            print("gone", topic, left, flush=True)
            over.set()
    over, got = threading.Event(), []
    out = rospy.Publisher("x", String, subscriber_listener=Greeter(), queue_size=5)
    sub = rospy.Subscriber("x", String, lambda m: got.append(m.data))
    until(lambda: len(got) == 2)
    print(sorted(got))
    sub.unregister()
    over.wait(60)
""") == ["['hello, all', 'hello, only you']", "gone /x 0"]


def test_remapped_topics_reach_other_nodes(network: Network) -> None:
    node = network.node("other")
    came = threading.Event()
    texts: list[str] = []

    def take(message: String) -> None:
        texts.append(message.data)
        came.set()

    node.subscription("/far/out", String, take)
    start(
        network,
        """
        import rospy
        from std_msgs.msg import String
        rospy.init_node("talker")
        out = rospy.Publisher("chatter", String, queue_size=10)
        rate = rospy.Rate(50)
        while not rospy.is_shutdown():
            out.publish("hello")
            rate.sleep()
        """,
        "chatter:=/far/out",
    )
    assert came.wait(TIMEOUT)
    assert texts[0] == "hello"


@pytest.mark.parametrize(
    ("kind", "value", "text"),
    [
        ("std_msgs.msg.Int32", "2**40", "field data exceeds specified width [int32]"),
        ("std_msgs.msg.UInt8", "-1", "field data must be unsigned integer type"),
        ("std_msgs.msg.Float64", "'x'", "field data must be float type"),
        ("std_msgs.msg.String", "1.5", "field data must be of type bytes or an ascii string"),
        ("geometry_msgs.msg.Point", "'x', 0, 0", "field x must be float type"),
    ],
)
def test_errors_of_values_are_those_of_genpy(kind: str, value: str, text: str) -> None:
    from importlib import import_module

    from rosz.errors import EncodeError
    from rosz.ros1.client.rospy.msg import encode

    module, _, name = kind.rpartition(".")
    message = getattr(import_module(f"rosz.msgs.{module}"), name)(*eval(f"({value},)"))
    with pytest.raises(EncodeError) as caught:
        encode(message)
    assert str(caught.value) == text
    assert isinstance(caught.value.__cause__, EncodeError)
