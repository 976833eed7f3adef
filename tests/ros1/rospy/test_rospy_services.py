"""rospy's services and their callers; the outputs are those of real rospy 1.15."""

from __future__ import annotations

import signal

import pytest
from network import Network

from .rospy_programs import Printed, run, start

BEGIN = """
    import threading, time
    import rospy
    from rospy_tutorials.srv import AddTwoInts, AddTwoIntsRequest, AddTwoIntsResponse
    from std_srvs.srv import Empty, SetBool, Trigger, TriggerResponse

    rospy.init_node("services")
"""
ERROR = "ServiceException | service [/s] responded with an error: "


@pytest.fixture
def printed(network: Network) -> Printed:
    return lambda script: run(network, BEGIN + script)


VALID = [
    ("AddTwoInts", "lambda r: AddTwoIntsResponse(r.a + r.b)", "sum=7"),
    ("AddTwoInts", "lambda r: r.a + r.b", "sum=7"),
    ("AddTwoInts", "lambda r: [r.a]", "sum=3"),
    ("AddTwoInts", "lambda r: (r.b,)", "sum=4"),
    ("AddTwoInts", "lambda r: {'sum': 1}", "sum=1"),
    ("AddTwoInts", "lambda r: []", "sum=0"),
    ("SetBool", "lambda r: (r.data, 'm')", "success=True, message='m'"),
    ("SetBool", "lambda r: {'success': True}", "success=True, message=''"),
    ("Empty", "lambda r: []", "EmptyResponse()"),
]
INVALID = [
    ("AddTwoInts", "lambda r: None", "service handler returned None"),
    ("Empty", "lambda r: None", "service handler returned None"),
    (
        "AddTwoInts",
        "lambda r: [1, 2]",
        "handler returned wrong number of values: Invalid number of arguments,"
        " args should be ['sum'] args are(1, 2)",
    ),
    (
        "AddTwoInts",
        "lambda r: {'x': 1}",
        "handler returned invalid value: x is not an attribute of AddTwoIntsResponse",
    ),
    (
        "SetBool",
        "lambda r: True",
        "handler returned invalid value: Invalid number of arguments,"
        " args should be ['success', 'message'] args are(True,)",
    ),
    ("AddTwoInts", "refuse", "mine"),
]
CALL = """
    def refuse(request):
        raise rospy.ServiceException("mine")
    VALUES = {"AddTwoInts": (3, 4), "SetBool": (True,), "Empty": ()}
    def call(number, kind, handler):
        rospy.Service(f"s{number}", kind, handler)
        proxy = rospy.ServiceProxy(f"s{number}", kind)
        show("call", lambda: proxy(*VALUES[kind.__name__]))
"""


def outcomes(network: Network, handlers: list[tuple[str, str, str]]) -> list[str]:
    """Return what calls of services with some handlers show, each on a line."""
    calls = (f"call({n}, {kind}, {code})" for n, (kind, code, _) in enumerate(handlers))
    return run(network, BEGIN + CALL + "\n".join(f"    {call}" for call in calls))


def test_valid_results_of_handlers(network: Network) -> None:
    for line, (_, handler, shown) in zip(outcomes(network, VALID), VALID, strict=True):
        assert shown in line, handler


def test_invalid_results_of_handlers(network: Network) -> None:
    texts = [f"service cannot process request: {shown}".encode() for _, _, shown in INVALID]
    assert outcomes(network, INVALID) == [
        f"call -> {ERROR.replace('[/s]', f'[/s{number}]')}{text!r}"
        for number, text in enumerate(texts)
    ]


def test_handler_errors_are_logged_and_sent_to_the_caller(printed: Printed) -> None:
    lines = printed("""
    def bad(request):
        raise ValueError("boo")
    def wide(request):
        return 2 ** 70
    service = rospy.Service("s", AddTwoInts, bad)
    show("call", lambda: rospy.ServiceProxy("s", AddTwoInts)(1, 2))
    service.shutdown("over")
    service.spin()
    while rospy.get_master().lookupService("/s")[0] == 1:
        time.sleep(0.002)
    show("gone", lambda: rospy.ServiceProxy("s", AddTwoInts)(1, 2))
    rospy.Service("w", AddTwoInts, wide, error_handler=lambda *e: print("told", e[:2]))
    show("wide", lambda: rospy.ServiceProxy("w", AddTwoInts)(1, 2))
""")
    assert "[ERROR] [" in lines[0]
    assert lines[0].endswith("]: Error processing request: boo")
    assert "ValueError: boo" in lines[1]
    assert lines[2] == f"call -> {ERROR}b'error processing request: boo'"
    assert lines[3] == "gone -> ServiceException | service [/s] unavailable"
    assert lines[4].startswith("told (")
    assert lines[5].endswith(
        "b'error processing request: field sum exceeds specified width [int64]'"
    )


def test_arguments_of_calls(printed: Printed) -> None:
    assert printed("""
    rospy.Service("s", AddTwoInts, lambda r: r.a + r.b)
    add = rospy.ServiceProxy("s", AddTwoInts, persistent=True, headers={"x": "y"})
    add.wait_for_service(60)
    print(add(1, 2).sum, add(a=3, b=4).sum, add(AddTwoIntsRequest(5, 6)).sum, add().sum)
    print(add.call(1, 1).sum, add.call(AddTwoIntsRequest(a=2)).sum, add(b=9).sum)
    show("one", lambda: add(1))
    show("both", lambda: add(1, b=2))
    show("keyword", lambda: add(c=1))
    show("value", lambda: add("a", "b"))
    add.close()
    print(add(1, 2).sum, add.resolved_name, add.service_class is AddTwoInts)
    show("twice", lambda: rospy.Service("s", AddTwoInts, print))
    show("no class", lambda: rospy.ServiceProxy("s", str))
    show("no name", lambda: rospy.Service("", AddTwoInts, print))
    show("other type", lambda: rospy.ServiceProxy("s", Trigger)())
""")[:10] == [
        "3 7 11 0",
        "2 2 9",
        "one -> TypeError | Invalid number of arguments, args should be ['a', 'b'] args are(1,)",
        "both -> TypeError | publish() can be called with arguments or keywords, but not both.",
        "keyword -> AttributeError | c is not an attribute of AddTwoIntsRequest",
        "value -> _FieldError | field a must be an integer type",
        "3 /s True",
        "twice -> ServiceException | service [/s] already registered",
        "no class -> AttributeError | service_class must be the class of a service,"
        " got <class 'str'>; it has no attribute '_request_class'",
        "no name -> ValueError | service name is not a non-empty string",
    ]


def test_wait_for_service(printed: Printed) -> None:
    assert printed("""
    from std_msgs.msg import String
    show("none", lambda: rospy.wait_for_service("none", 0.1))
    show("duration", lambda: rospy.wait_for_service("none", timeout=rospy.Duration(0.1)))
    show("zero", lambda: rospy.wait_for_service("none", 0))
    show("message", lambda: rospy.wait_for_message("none", String, 0.1))
    threading.Timer(0.2, lambda: rospy.Service("late", Empty, lambda r: [])).start()
    show("late", lambda: rospy.wait_for_service("late"))
    out = rospy.Publisher("x", String, queue_size=1, latch=True)
    out.publish("there")
    print(rospy.wait_for_message("x", String, 60).data)
""") == [
        "none -> ROSException | timeout exceeded while waiting for service /none",
        "duration -> ROSException | timeout exceeded while waiting for service /none",
        "zero -> ValueError | timeout must be non-zero",
        "message -> ROSException | timeout exceeded while waiting for message on topic none",
        "late -> None",
        "there",
    ]


def test_calls_between_processes_and_from_handlers(network: Network) -> None:
    server = start(
        network,
        BEGIN
        + """
    rospy.Service("inner", AddTwoInts, lambda r: r.a + r.b)
    def outer(request):
        return rospy.ServiceProxy("inner", AddTwoInts)(request.a, request.b).sum * 10
    rospy.Service("outer", AddTwoInts, outer)
    print("ready", flush=True)
    rospy.spin()
""",
    )
    server.wait_for("ready")
    assert run(
        network,
        """
        import rospy
        from rospy_tutorials.srv import AddTwoInts
        rospy.wait_for_service("outer", 60)
        print(rospy.ServiceProxy("outer", AddTwoInts)(1, 2).sum)
        """,
    ) == ["30"]
    server.send(signal.SIGINT)
    assert server.exit_code() == 0


def test_shutdown_ends_a_call(printed: Printed) -> None:
    assert printed("""
    busy, never = threading.Event(), threading.Event()
    def wait(request):
        busy.set()
        never.wait(60)
        return []
    rospy.Service("slow", Empty, wait)
    def end():
        busy.wait()
        rospy.signal_shutdown("enough")
    threading.Thread(target=end).start()
    show("call", lambda: rospy.ServiceProxy("slow", Empty)())
    show("after", lambda: rospy.ServiceProxy("slow", Empty)())
    never.set()
""") == [
        "call -> ServiceException | service [/slow] returned no response",
        "after -> ServiceException | service [/slow] unavailable",
    ]


def test_invalid_timeouts_are_refused(network: Network) -> None:
    lines = run(
        network,
        f"""{BEGIN}
    from std_msgs.msg import String

    nan = float("nan")
    show("message", lambda: rospy.wait_for_message("none", String, timeout=nan))
    show("service", lambda: rospy.wait_for_service("none", timeout=nan))
""",
    )
    told = "UsageError | timeout is 'nan': expected a number of seconds"
    assert lines == [f"message -> {told}", f"service -> {told}"]


def test_the_header_of_a_request_names_its_caller(printed: Printed) -> None:
    lines = printed("""
    headers = []
    def answer(request):
        headers.append(request._connection_header)
        return True, ""
    rospy.Service("s", SetBool, answer)
    rospy.ServiceProxy("s", SetBool)(True)
    print([headers[0][key] for key in ("callerid", "service", "type", "md5sum")])
""")
    assert lines == ["['/services', '/s', 'std_srvs/SetBool', '09fb03525b03e7ea1fd3992bafd87e16']"]


def test_a_service_knows_its_uri(printed: Printed) -> None:
    assert printed("""
    import rosgraph
    service = rospy.Service("s", Empty, lambda request: [])
    rospy.wait_for_service("s")
    print(service.uri == rosgraph.Master("/services").lookupService("/s"))
""") == ["True"]
