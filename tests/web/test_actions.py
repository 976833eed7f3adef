"""What pages change, without pages: messages, calls, parameters, and the log that they show."""

from __future__ import annotations

import math
import threading
from typing import Any

import pytest
from network import TIMEOUT, Network, eventually

from rosz.access import PagePolicy
from rosz.errors import NotFoundError, UsageError, YamlError
from rosz.introspect.rosout import LogFilter
from rosz.msgs.actionlib_msgs.msg import GoalStatus
from rosz.msgs.builtin_interfaces.msg import Time
from rosz.msgs.geometry_msgs.msg import (
    PoseStamped,
    PoseWithCovarianceStamped,
    Twist,
    Vector3,
)
from rosz.msgs.nav_msgs.msg import Odometry
from rosz.msgs.sensor_msgs.msg import BatteryState, Image
from rosz.msgs.std_msgs.msg import Float64MultiArray, Header, String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.web.model import (
    FieldCondition,
    FloorPlan,
    Form,
    ImageWatch,
    LogBook,
    ParameterModel,
    Plot,
    Sending,
    System,
    TopicWatch,
    VelocityPublisher,
    call_service,
    find_floor,
    form_of,
    message_tree,
    split_fields,
)
from rosz.web.model.floor import Surroundings, draw_floor
from rosz.web.model.forms import FormField, form_fields, read_form
from rosz.web.model.plotting import Series, plottable_fields


def test_forms_have_all_fields_and_take_some() -> None:
    assert read_form(Twist, form_of(Twist), 0) == Twist()
    assert read_form(PoseStamped, form_of(PoseStamped), 0) == PoseStamped()
    assert read_form(Twist, "{linear: {x: 2}}", 0).linear.x == 2.0
    assert read_form(Twist, " ", 0) == Twist()
    with pytest.raises(UsageError, match="is not YAML"):
        read_form(Twist, "{linear: ", 0)


def _fields(fields: tuple[FormField, ...]) -> dict[str, FormField]:
    found = {".".join(one.path): one for one in fields}
    for one in fields:
        found |= _fields(one.fields)
    return found


def test_a_form_has_an_editor_for_each_type_of_field() -> None:
    found = _fields(form_fields(PoseWithCovarianceStamped))
    assert found["header.stamp"].kind == "yaml"
    assert found["header.frame_id"].kind == "text"
    assert found["pose.pose.position"].kind == "message"
    assert found["pose.pose.position.x"].kind == "number"
    assert found["pose.covariance"].kind == "yaml"
    assert sum(one.size for one in form_fields(Twist)) == 6
    battery = _fields(form_fields(BatteryState))
    assert battery["present"].kind == "bool"
    assert battery["present"].hint == "a battery is plugged in"
    health = battery["power_supply_health"]
    assert (health.kind, health.choices[2]) == ("choice", "POWER_SUPPLY_HEALTH_OVERHEAT")
    status = _fields(form_fields(GoalStatus))["status"]
    assert (status.kind, status.choices[3]) == ("choice", "SUCCEEDED")
    pixels = _fields(form_fields(Image))["is_bigendian"]
    assert (pixels.kind, pixels.low, pixels.high) == ("integer", 0, 255)


def test_a_field_is_written_into_the_text_and_the_text_into_the_fields() -> None:
    form = Form(Twist)
    fields = _fields(form.fields)
    form.write("{angular: {z: 2}}", 0)
    assert form.value(fields["angular.z"]) == 2.0
    assert form.value(fields["linear.x"]) == 0.0
    assert form.change(fields["linear.x"], 1.5, 0) == ""
    assert form.text == "linear: {x: 1.5}\nangular: {z: 2}"
    assert read_form(Twist, form.text, 0) == Twist(Vector3(x=1.5), Vector3(z=2.0))
    form.write("{linear: {x: much}}", 0)
    assert "linear.x" in form.fault
    assert "no field can be written" in form.change(fields["linear.x"], 2.0, 0)
    assert form.text == "{linear: {x: much}}"


def test_values_that_yaml_writes_otherwise_come_back() -> None:
    form = Form(PoseStamped)
    stamp, frame = (_fields(form.fields)[name] for name in ("header.stamp", "header.frame_id"))
    assert form.value(stamp) == "{secs: 0, nsecs: 0}"
    assert form.change(stamp, "now", 5 * 10**9) == ""
    assert form.change(frame, "on", 5 * 10**9) == ""
    assert form.value(stamp) == "now"
    read = read_form(PoseStamped, form.text, 7 * 10**9)
    assert (read.header.stamp.secs, read.header.frame_id) == (7, "on")
    assert "<header.stamp>" in form.change(stamp, "{secs: ", 0)
    assert form.value(stamp) == "now"
    image = Form(Image)
    fields = _fields(image.fields)
    assert image.change(fields["data"], "[1, 2, 255]", 0) == ""
    assert image.change(fields["height"], 3.0, 0) == ""
    assert "0 to 4294967295" in image.change(fields["height"], -1, 0)
    assert read_form(Image, image.text, 0) == Image(height=3, data=bytes([1, 2, 255]))


def test_a_tree_is_cut_where_it_is_long() -> None:
    tree = message_tree(Float64MultiArray(data=[0.5] * 1000), "array")
    data = tree["children"][1]
    assert data["value"] == "1000 elements"
    assert len(data["children"]) == 31
    assert data["children"][-1]["value"] == "and 970 more"
    assert message_tree("a" * 1000, "text")["value"].endswith('…"')


def test_a_watched_topic_keeps_the_newest_message(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    publisher = robot.publisher("chatter", String, latch=True)
    publisher.publish(String(data="first"))
    system = System(page, PagePolicy())
    graph = system.graph.use().value
    eventually(lambda: graph.survey().view.publishers("/chatter"), "the publisher")
    watch = TopicWatch(page, graph.survey(), "/chatter")
    eventually(lambda: watch.message() is not None, "the latched message")
    publisher.publish(String(data="second"))
    eventually(lambda: watch.message() == String(data="second"), "the newest message")
    watch.close()


def test_a_page_publishes_once_and_at_a_rate(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    got: list[Any] = []
    enough = threading.Event()

    def receive(message: Twist) -> None:
        got.append(message.linear.x)
        if got.count(2.0) >= 3:
            enough.set()

    robot.subscription("cmd_vel", Twist, receive)
    with pytest.raises(UsageError, match="read-only"):
        Sending(page, PagePolicy(read_only=True), "/cmd_vel", "geometry_msgs/Twist")
    page.context.graph.wait_for_subscribers("/cmd_vel", 1, TIMEOUT)
    sending = Sending(page, PagePolicy(), "/cmd_vel", "geometry_msgs/Twist")
    sending.send("linear: {x: 1}")
    eventually(lambda: got == [1.0], "the message")
    sending.repeat("linear: {x: 2}", 50)
    assert enough.wait(TIMEOUT)
    assert sending.repeats
    sending.close()
    assert not sending.repeats


def test_a_repetition_replaces_the_one_before(network: Network) -> None:
    waiting: list[Any] = []

    class Turns:
        """A worker whose items wait until the test runs them."""

        def submit(self, task: Any) -> None:
            waiting.append(task)

        def later(self, _seconds: float, task: Any) -> None:
            waiting.append(task)

        def close(self) -> None:
            waiting.clear()

    def run() -> None:
        due = waiting.copy()
        waiting.clear()
        for task in due:
            task()

    sending = Sending(network.node("page"), PagePolicy(), "/cmd_vel", "geometry_msgs/Twist")
    sending._worker.close()
    sending._worker = Turns()  # type: ignore[assignment]
    sending.repeat("linear: {x: 1}", 1)
    run()
    sending.stop()
    sending.repeat("linear: {x: 2}", 1)
    sending.repeat("linear: {x: 3}", 1)
    run()
    assert sending.sent == 2
    run()
    assert sending.sent == 3
    assert len(waiting) == 1
    sending.close()


def test_driving_ends_when_the_browser_is_silent(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    got: list[float] = []
    stopped = threading.Event()

    def receive(message: Twist) -> None:
        got.append(message.linear.x)
        if message.linear.x == 0 and 0.5 in got:
            stopped.set()

    robot.subscription("cmd_vel", Twist, receive, queue_size=100)
    page.context.graph.wait_for_subscribers("/cmd_vel", 1, TIMEOUT)
    driver = VelocityPublisher(page, PagePolicy(), "/cmd_vel")
    driver.drive(0.5, 0.0)
    assert stopped.wait(TIMEOUT)
    assert not driver._driving
    with pytest.raises(UsageError, match="read-only"):
        VelocityPublisher(page, PagePolicy(read_only=True), "/cmd_vel")
    driver.close()


@pytest.mark.parametrize(
    ("encoding", "size", "value"),
    [
        ("mono8", 1, "(1, 0): 7"),
        ("bgr8", 3, "(1, 0): 7, 7, 7"),
        ("rgba8", 4, "(1, 0): 7, 7, 7, 7"),
        ("mono16", 2, "(1, 0): 1799"),
        ("16UC1", 2, "(1, 0): 1799"),
        ("32FC1", 4, "(1, 0): "),
        ("bayer_rggb8", 1, "(1, 0): 7"),
        ("yuv422", 2, "(1, 0): "),
    ],
)
def test_images_are_pictures(network: Network, encoding: str, size: int, value: str) -> None:
    robot, page = network.node("robot"), network.node("page")
    image = Image(height=2, width=4, encoding=encoding, step=4 * size, data=bytes([7] * 8 * size))
    robot.publisher("camera", Image, latch=True).publish(image)
    graph = System(page, PagePolicy()).graph.use().value
    eventually(lambda: graph.survey().view.publishers("/camera"), "the publisher")
    watch = ImageWatch(page, graph.survey(), "/camera")
    eventually(lambda: watch.received, "the image")
    assert watch.encoded()[0].startswith(b"\xff\xd8")
    assert watch.encoded(".png")[0].startswith(b"\x89PNG")
    assert watch.description() == f"4 x 2 {encoding}"
    assert watch.value_at(1, 0).startswith(value)
    assert watch.value_at(9, 0) == ""
    watch.close()


def test_a_page_calls_a_service(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    robot.service("enable", SetBool, lambda request: SetBool.Response(True, f"is {request.data}"))
    page.context.graph.wait_for_service("/enable", TIMEOUT)
    view = page.context.graph.refresh()
    answer = call_service(page, PagePolicy(), view, "/enable", "data: true")
    assert 'message: "is True"' in answer
    with pytest.raises(UsageError, match="read-only"):
        call_service(page, PagePolicy(read_only=True), view, "/enable", "")


def test_parameters_keep_their_types(network: Network) -> None:
    page = network.node("page")
    parameters = ParameterModel(page, PagePolicy())
    page.params.set("/rate", 2.5)
    page.params.set("/name", "arm")
    parameters.set_text("/rate", "3")
    assert page.params.get("/rate") == 3.0
    assert isinstance(page.params.get("/rate"), float)
    parameters.set_text("/name", "12")
    assert page.params.get("/name") == "12"
    with pytest.raises(UsageError, match=r"'/rate' is of type float, and fast of type str"):
        parameters.set_text("/rate", "fast")
    parameters.set_text("/rate", "fast", other_type=True)
    assert parameters.values() == {"/rate": "fast", "/name": "12"} | {
        name: value for name, value in parameters.values().items() if name not in {"/rate", "/name"}
    }
    eventually(lambda: len(parameters.changes()) >= 5, "the changes")
    newest = parameters.changes()[0]
    assert (newest.name, newest.old, newest.new) == ("/rate", 3.0, "fast")
    parameters.close()


def test_parameters_are_saved_and_loaded(network: Network) -> None:
    page = network.node("page")
    parameters = ParameterModel(page, PagePolicy())
    assert parameters.load("/", "arm: {speed: 1, joints: [a, b]}\nname: robot\n", "file.yaml") == 3
    text = parameters.save("/arm")
    page.params.delete("/arm")
    assert parameters.load("/arm", text, "file.yaml") == 2
    assert page.params.get("/arm") == {"speed": 1, "joints": ["a", "b"]}
    with pytest.raises(YamlError, match=r"file\.yaml"):
        parameters.load("/", "a: [", "file.yaml")
    with pytest.raises(UsageError, match="read-only"):
        ParameterModel(page, PagePolicy(read_only=True)).load("/", "a: 1", "file.yaml")


def test_fields_are_plotted_while_a_page_wants_them(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    publisher = robot.publisher("twist", Twist)
    arrays = robot.publisher("array", Float64MultiArray)
    graph = System(page, PagePolicy()).graph.use().value
    eventually(lambda: len(graph.survey().view.publishers("/array")) == 1, "the publishers")
    eventually(lambda: len(graph.survey().view.publishers("/twist")) == 1, "the publishers")
    plot = Plot(page)
    for name in split_fields("/twist/linear/x:y,/array/data"):
        plot.add(graph.survey(), name)
    assert plot.fields == ["/twist/linear/x", "/twist/linear/y", "/array/data"]
    with pytest.raises(UsageError, match="only numbers are plotted"):
        plot.add(graph.survey(), "/twist/linear")
    with pytest.raises(NotFoundError, match="has no field 'w'"):
        plot.add(graph.survey(), "/twist/linear/w")

    def arrived() -> bool:
        publisher.publish(Twist(linear=Vector3(x=1.0, y=2.0)))
        arrays.publish(Float64MultiArray(data=[5.0, 6.0]))
        return len(plot.series()) == 4

    eventually(arrived, "all series")
    newest = {one.name: one.points()[1][-1] for one in plot.series()}
    assert newest == {
        "/twist/linear/x": 1.0,
        "/twist/linear/y": 2.0,
        "/array/data[0]": 5.0,
        "/array/data[1]": 6.0,
    }
    plot.remove("/array/data")
    assert {one.name for one in plot.series()} == {"/twist/linear/x", "/twist/linear/y"}
    assert ",/twist/linear/x,1.0" in plot.table()
    plot.close()
    assert plot.series() == []


def test_many_points_keep_their_extremes() -> None:
    series = Series("/a")
    for number in range(10_000):
        series.add(float(number), 9.0 if number == 7777 else 0.0)
    points = series.within(100.0, 9_000.0, 600)
    assert len(points) <= 620
    assert (7777.0, 9.0) in points
    assert all(100.0 <= time <= 9_000.0 for time, _ in points)
    assert points == sorted(points)
    series.add(5.0, 1.0)
    assert series.points() == ([5.0], [1.0])


def test_points_are_bounded() -> None:
    series = Series("/a")
    for number in range(200_000):
        series.add(float(number), 0.0)
    times, _ = series.points()
    assert 60_000 <= len(times) <= 66_000
    assert times[-1] == series.newest == 199_999.0


def test_fields_of_numbers_are_offered() -> None:
    assert list(plottable_fields(Twist))[:2] == ["linear/x", "linear/y"]
    assert list(plottable_fields(Float64MultiArray)) == [
        "layout/dim[0]/size",
        "layout/dim[0]/stride",
        "layout/data_offset",
        "data",
    ]
    assert list(plottable_fields(String)) == []
    assert "header/stamp" in plottable_fields(PoseStamped)


def test_the_stamp_in_the_header_is_the_time_where_that_is_chosen(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    publisher = robot.publisher("pose", PoseStamped)
    graph = System(page, PagePolicy()).graph.use().value
    eventually(lambda: graph.survey().view.publishers("/pose"), "the publisher")
    plot = Plot(page, stamped=True)
    assert "pose/position/x" in plot.offered(graph.survey())["/pose"]
    plot.add(graph.survey(), "/pose/header/stamp")
    message = PoseStamped(header=Header(stamp=Time(12, 500_000_000)))

    def arrived() -> bool:
        publisher.publish(message)
        return bool(plot.series())

    eventually(arrived, "the series")
    assert plot.series()[0].points()[0][0] == 12.5
    assert plot.series()[0].points()[1][0] == 12.5
    plot.close()


def test_colons_and_commas_part_fields() -> None:
    assert split_fields("/pose/x:y") == ["/pose/x", "/pose/y"]
    assert split_fields("/a/data[0:3], /b/c") == ["/a/data[0:3]", "/b/c"]
    assert split_fields("") == []


def test_the_log_is_bounded_and_filtered(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    book = LogBook(page)

    def heard(text: str) -> bool:
        robot.log.warning(text)
        return bool(book.received)

    eventually(lambda: heard("the first"), "a line of the log")
    robot.log.info("it moves")
    robot.log.error("it %s", "burns")

    def texts(level: str = "DEBUG", pattern: str = "", until: int | None = None) -> list[str]:
        lines = book.newest(LogFilter((), level, pattern), [robot.name], 100, until)
        return [line.text for _, line in lines if line.text != "the first"]

    eventually(lambda: texts() == ["it burns", "it moves"], "all lines")
    assert texts("ERROR") == ["it burns"]
    assert texts(pattern="mov") == ["it moves"]
    assert texts(until=book.received - 1) == ["it moves"]
    assert len(book.newest(LogFilter(), [robot.name], 1)) == 1
    lines = {line.text: line.stamp for _, line in book.newest(LogFilter(), [robot.name], 9)}
    only = book.newest(LogFilter(), [robot.name], 9, None, (lines["it burns"], math.inf))
    assert [line.text for _, line in only] == ["it burns"]
    book.clear()
    assert texts() == []
    book.close()


def test_a_robot_is_drawn_from_above() -> None:
    seen = Surroundings()
    assert draw_floor(seen) == ""
    seen.see(0.0, 0.1, [1.0], 3.5)
    assert seen.beams == []
    seen.move(1.0, 2.0, math.pi / 2)
    seen.move(math.nan, 0.0, 0.0)
    seen.see(0.0, math.pi / 2, [1.0, 2.0, math.inf, math.nan, 0.0], 3.5)
    assert [(round(x, 9), round(y, 9)) for x, y in seen.beams] == [(1.0, 3.0), (-1.0, 2.0)]
    picture = draw_floor(seen)
    assert '<circle cx="1.000" cy="-2.000"' in picture
    assert "M1.00 -3.00h0" in picture
    for number in range(400):
        seen.move(number * 10.0, 0.0, 0.0)
        seen.see(0.0, 0.3, [1.0] * 20, 3.5)
    assert len(seen.cells) == 3000


def test_a_robot_is_found_beside_its_velocities(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    odometry = robot.publisher("tb3/odom", Odometry)
    robot.publisher("tb3/scan", String)
    graph = System(page, PagePolicy()).graph.use().value
    eventually(lambda: graph.survey().view.publishers("/tb3/scan"), "the publishers")
    eventually(lambda: graph.survey().view.publishers("/tb3/odom"), "the publishers")
    assert find_floor(graph.survey(), "/cmd_vel") == {}
    topics = find_floor(graph.survey(), "/tb3/cmd_vel")
    assert topics == {"odom": "/tb3/odom"}
    floor = FloorPlan(page, PagePolicy(), topics)

    def is_drawn() -> bool:
        odometry.publish(Odometry())
        return "circle" in floor.picture()

    eventually(is_drawn, "the robot")
    floor.close()


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("linear/x > 0.5", True),
        ("linear.x<=0.5", False),
        ("linear/x == 1", True),
        ("linear/w == 1", False),
        ("linear/x contains 1.", True),
        ("linear/x > much", False),
    ],
)
def test_conditions_compare_a_field_with_a_value(text: str, holds: bool) -> None:
    assert FieldCondition(text).accepts(Twist(linear=Vector3(x=1.0))) is holds


def test_conditions_are_no_programs() -> None:
    assert FieldCondition("data contains 'go'").accepts(String(data="let it go"))
    assert FieldCondition("data != go").accepts(String(data="stay"))
    for text in ("__import__('os').getcwd()", "m.data", "data >", ""):
        with pytest.raises(UsageError, match="expected a field"):
            FieldCondition(text)


def test_only_messages_that_fulfil_a_condition_are_kept(network: Network) -> None:
    robot, page = network.node("robot"), network.node("page")
    publisher = robot.publisher("cmd_vel", Twist)
    graph = System(page, PagePolicy()).graph.use().value
    eventually(lambda: graph.survey().view.publishers("/cmd_vel"), "the publisher")
    watch = TopicWatch(page, graph.survey(), "/cmd_vel", FieldCondition("linear/x > 1"))
    number = 0

    def arrived() -> bool:
        nonlocal number
        number += 1
        publisher.publish(Twist(linear=Vector3(x=float(number % 3))))
        return watch.received > 6

    eventually(arrived, "messages")
    assert watch.message().linear.x == 2.0
    watch.close()
