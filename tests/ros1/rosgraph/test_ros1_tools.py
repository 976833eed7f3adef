"""rosgraph.Master, rosparam, rosservice, rosnode, rosmsg and rostopic over live nodes."""

from __future__ import annotations

import json
import signal
from textwrap import dedent
from typing import Any

import pytest
from cli.shell import with_log
from network import Network, eventually

from rosz.msgs.std_msgs.msg import String
from rosz.msgs.std_srvs.srv import SetBool
from rosz.node import Node
from rosz.ros1.tools.rosmsg import MODE_SRV, ROSMsgException, get_msg_text, get_srv_text, list_types

_BEGIN = """
import json
import rosz.ros1
def tried(function, *arguments):
    try:
        return function(*arguments)
    except Exception as error:
        return [type(error).__name__, str(error)]
"""


@pytest.fixture
def robot(network: Network) -> Node:
    """A node that publishes, subscribes, serves and has parameters."""
    node = network.node("robot")
    node.publisher("chatter", String, latch=True).publish(String(data="hello"))
    node.subscription("orders", String, lambda _: None)
    node.service("switch", SetBool, lambda request: [request.data, "done"])
    node.params.set("/speed", 1.5)
    return with_log(node)


def ask(network: Network, snippet: str, *argv: str, **variables: str) -> Any:
    """Return the ``result`` of a snippet in another process."""
    code = _BEGIN + dedent(snippet) + "\nprint('RESULT', json.dumps(result, default=str))\n"
    program = network.program(code, *argv, **variables)
    assert program.exit_code() == 0, program.output
    return json.loads(program.wait_for("RESULT").removeprefix("RESULT"))


@pytest.mark.usefixtures("robot")
def test_master(network: Network) -> None:
    found = ask(
        network,
        """
        import rosgraph
        master = rosgraph.Master("/script")
        state = master.getSystemState()
        result = [
            rosgraph.is_master_online(), master.is_online(), master.getPid() > 0, master.getUri(),
            [[name, nodes] for kind in state for name, nodes in kind if name != "/rosout"],
            master.getPublishedTopics(""),
            master.getPublishedTopics("/ns"),
            [pair for pair in master.getTopicTypes() if pair[0] != "/chatter"],
            master.lookupNode("/robot").startswith("rosz://"),
            master.lookupService("/switch").startswith("rosz://"),
            tried(master.lookupNode, "/nobody"), tried(master.lookupService, "/nothing"),
            tried(lambda: master.registerPublisher)[0],
        ]
        """,
    )
    assert found[:3] == [True, True, True]
    assert found[3] == "http://localhost:11311/"
    assert ["/chatter", ["/robot"]] in found[4]
    assert ["/orders", ["/robot"]] in found[4]
    assert ["/switch", ["/robot"]] in found[4]
    assert found[5] == [["/chatter", "std_msgs/String"], ["/rosout", "rosgraph_msgs/Log"]]
    assert found[6] == []
    assert found[7] == [["/orders", "std_msgs/String"], ["/rosout", "rosgraph_msgs/Log"]]
    assert found[8:10] == [True, True]
    assert found[10] == ["MasterError", "unknown node [/nobody]"]
    assert found[11] == ["MasterError", "no provider"]
    assert found[12] == "AttributeError"


def test_parameters_through_the_master(network: Network, robot: Node) -> None:
    found = ask(
        network,
        """
        import rosgraph
        master = rosgraph.Master("/ns/script")
        result = [
            master.getParam("/speed"), master.hasParam("/speed"), master.hasParam("/nothing"),
            master.setParam("gain", 3), master.getParam("/ns/gain"), master.searchParam("speed"),
            tried(master.getParam, "/nothing"), tried(master.searchParam, "nothing"),
            tried(master.deleteParam, "/nothing"), tried(master.setParam, "/x", None)[0],
            master.deleteParam("/ns/gain"), "/ns/gain" in master.getParamNames(),
            master.setParam("/a", {"b": 1}),
        ]
        """,
    )
    assert found[:6] == [1.5, True, False, 0, 3, "/speed"]
    assert found[6] == ["MasterError", "Parameter [/nothing] is not set"]
    assert [kind for kind, _ in found[7:9]] == ["MasterError", "MasterError"]
    assert found[9:12] == ["MasterError", 0, False]
    assert robot.params["/a/b"] == 1


def test_rosparam(network: Network, robot: Node) -> None:
    file = network.folder / "p.yaml"
    file.write_text("arm:\n  turn: deg(180)\n---\n_ns: hand\ngrip: 2\n")
    found = ask(
        network,
        f"""
        import rosparam, yaml
        for values, space in rosparam.load_file("{file}", default_namespace="/ns"):
            rosparam.upload_params(space, values)
        rosparam.set_param("/speed", "2.5")
        rosparam.set_param("/ns/arm", "{{x: 1}}")
        result = [
            rosparam.list_params("/ns"), rosparam.get_param("/ns"), rosparam.get_param("/speed"),
            rosparam.load_str("a: 1", "text"),
            tried(rosparam.get_param, "/nothing"),
            tried(rosparam.load_file, "/nowhere"),
            tried(rosparam.set_param, "/x", "[")[0],
            tried(rosparam.set_param, "/x", "null")[0],
            tried(rosparam.set_param_raw, "/x", {{1: 2}})[0],
            tried(rosparam.upload_params, "/", 3),
            tried(rosparam.load_str, "[", "text")[0],
        ]
        rosparam.dump_params("{file}", "/ns")
        rosparam.delete_param("/speed", verbose=True)
        rosparam.set_param("/v", "1", verbose=True)
        rosparam.dump_params(None, "/v")
        result.append(rosparam.get_param_server().hasParam("/speed"))
        """,
    )
    assert found[0] == ["/ns/arm/turn", "/ns/arm/x", "/ns/hand/grip"]
    assert found[1] == {"arm": {"turn": pytest.approx(3.14159265), "x": 1}, "hand": {"grip": 2}}
    assert found[2:4] == [2.5, [[{"a": 1}, "/"]]]
    assert found[4] == ["MasterError", "Parameter [/nothing] is not set"]
    assert found[5] == ["RosParamException", "file [/nowhere] does not exist"]
    assert found[6:9] == ["RosParamException"] * 3
    assert found[9] == ["RosParamException", "global / can only be set to a dictionary"]
    assert found[10:] == ["YAMLError", False]
    assert "grip: 2" in file.read_text()
    assert not robot.params.has("/speed")


def test_rosparam_takes_absolute_keys(network: Network) -> None:
    network.node("robot")
    program = network.program("""
        import rosz.ros1, rosparam
        rosparam.upload_params("/ns", {"/abs/x": 1, "own": {"/deep": 2}}, verbose=True)
        rosparam.print_params(7, "/ns")
        print(rosparam.list_params("/"))
        """)
    assert program.exit_code() == 0, program.output
    expected = ["/abs/x=1", "/deep=2", "7", "['/abs/x', '/deep']"]
    assert program.lines == expected  # as real rosparam's


@pytest.mark.usefixtures("robot")
def test_rosservice(network: Network) -> None:
    found = ask(
        network,
        """
        import rosservice
        request, response = rosservice.call_service("/switch", [True])
        result = [
            "/switch" in rosservice.get_service_list(),
            [one for one in rosservice.get_service_list(include_nodes=True) if one[0] == "/switch"],
            rosservice.get_service_list(node="/nobody"),
            rosservice.get_service_list(namespace="/a"),
            rosservice.get_service_type("/switch"), rosservice.get_service_type("/nothing"),
            rosservice.get_service_node("/switch"), rosservice.get_service_node("/nothing"),
            rosservice.get_service_class_by_name("/switch")._type,
            rosservice.get_service_args("/switch"), rosservice.has_service_args("switch"),
            rosservice.rosservice_find("std_srvs/SetBool"),
            "switch" in rosservice.get_service_uri("/switch"),
            [request.data, response.success, response.message],
            tried(rosservice.call_service, "/switch", ["text"])[1].partition(chr(10))[0],
            tried(rosservice.call_service, "/nothing", []),
        ]
        """,
    )
    assert found[:4] == [True, [["/switch", ["/robot"]]], [], []]
    assert found[4:9] == ["std_srvs/SetBool", None, "/robot", None, "std_srvs/SetBool"]
    assert found[9:13] == ["data", True, ["/switch"], True]
    assert found[13] == [True, True, "done"]
    assert found[14] == "Incompatible arguments to call service:"
    assert found[15] == ["ROSServiceException", "Service [/nothing] is not available."]


def test_rosnode(network: Network, robot: Node) -> None:
    victim = network.program(
        """
        import rosz
        node = rosz.Node("victim")
        node.spin()
        """
    )
    eventually(lambda: "/victim" in robot.context.graph.view().nodes(), "the victim")
    found = ask(
        network,
        """
        import rosgraph, rosnode, socket, time
        master = rosgraph.Master(rosnode.ID)
        address = rosnode.get_api_uri(master, "/robot")
        result = [
            rosnode.get_node_names(), rosnode.get_node_names("/ns"),
            rosnode.get_machines_by_nodes() == [socket.gethostname()],
            rosnode.get_nodes_by_machine(socket.gethostname()),
            tried(rosnode.get_nodes_by_machine, "nowhere")[0],
            address.startswith("rosz://"), rosnode.get_api_uri(master, "/nobody"),
            rosnode.rosnode_ping("robot", max_count=1, verbose=True),
            rosnode.rosnode_ping("/nobody", max_count=1),
            rosnode.get_node_info_description("/robot").splitlines()[0],
            rosnode.get_node_connection_info_description(address, master).splitlines()[0],
            tried(rosnode.get_node_connection_info_description, "x", master)[0],
            rosnode.kill_nodes(["/victim", "/nobody"]),
        ]
        while "/victim" in rosnode.get_node_names():
            time.sleep(0.01)
        result.append(rosnode.rosnode_ping_all())
        rosnode.rosnode_info("/robot")
        rosnode.rosnode_listnodes(list_all=True)
        rosnode.rosnode_cleanup()
        """,
    )
    assert found[:4] == [["/robot", "/victim"], [], True, ["/robot", "/victim"]]
    assert found[4:9] == ["ROSNodeException", True, None, True, False]
    assert found[9] == "Node [/robot]"
    assert found[10].startswith("Pid: ")
    assert found[11] == "ROSNodeIOException"
    assert found[12:] == [[["/victim"], ["/nobody"]], [["/robot"], []]]
    assert victim.exit_code() == 0


@pytest.mark.usefixtures("robot")
def test_rostopic(network: Network) -> None:
    found = ask(
        network,
        """
        import rostopic
        cls, name, read = rostopic.get_topic_class("/chatter/data")
        publishers, subscribers = rostopic.get_topic_list()
        result = [
            rostopic.get_topic_type("/chatter")[:2], rostopic.get_topic_type("/nothing"),
            cls._type, name, read(cls(data="x")),
            rostopic.find_by_type("std_msgs/String"),
            ["/chatter", "std_msgs/String", ["/robot"]] in publishers,
            ["/orders", "std_msgs/String", ["/robot"]] in subscribers,
            rostopic.get_info_text("/chatter").splitlines()[0],
            tried(rostopic.get_info_text, "/nothing"),
            rostopic.get_topic_class("/rosout")[0]._type,
            rostopic.msgevalgen("/a/b")(cls()), rostopic.msgevalgen(""),
            tried(rostopic.create_publisher, "x", "std_msgs/Nothing", False)[0],
            tried(rostopic.create_publisher, "x", "Nothing", False)[0],
        ]
        """,
    )
    assert found[:2] == [["std_msgs/String", "/chatter"], [None, None, None]]
    assert found[2:6] == ["std_msgs/String", "/chatter", "x", ["/chatter", "/orders"]]
    assert found[6:9] == [True, True, "Type: std_msgs/String"]
    assert found[9] == ["ROSTopicException", "Unknown topic /nothing"]
    assert found[10:] == ["rosgraph_msgs/Log", None, None, "ROSTopicException", "ROSTopicException"]


def test_publish_by_type_name(network: Network, robot: Node) -> None:
    heard = robot.subscription("news", String, queue_size=1000)  # twenty a second, until it is read
    program = network.program(
        """
        import rosz.ros1
        import rospy, rostopic
        publisher, cls = rostopic.create_publisher("news", "std_msgs/String", latch=True)
        while not publisher.get_num_connections():  # who comes later hears the last one only
            rospy.sleep(0.01)
        try:
            rostopic.publish_message(publisher, cls, [{"date": 1}])
        except rostopic.ROSTopicException as error:
            print(error)
        rostopic.publish_message(publisher, cls, ["one"], once=True)
        rostopic.publish_message(publisher, cls, ["two"], rate=20)
        """
    )
    program.wait_for("publishing and latching message for 3.0 seconds")
    assert heard.get().data == "one"
    assert heard.get().data == "two"
    assert "no field 'date'" in program.output
    assert "Args are: [data]" in program.output
    program.send(signal.SIGINT)
    program.exit_code()


def test_rates() -> None:
    from rosz.ros1.tools.rostopic import ROSTopicHz

    meter = ROSTopicHz(-1, filter_expr=lambda m: m != "no", use_wtime=True)
    assert meter.get_hz() is None
    for message in ("a", "no", "b", "c"):
        meter.callback_hz(message)
    stats = meter.get_hz()
    assert stats is not None
    assert stats[4] == 3
    assert stats[0] > 0
    assert stats[1] <= stats[2]
    assert meter.get_hz() is None
    meter.callback_hz("x", topic="/t")
    meter.print_hz(["/t"])


def test_rosmsg() -> None:
    assert get_msg_text("std_msgs/String") == "string data\n"
    assert get_msg_text("geometry_msgs/Twist").splitlines()[1] == "  float64 x"
    assert get_srv_text("std_srvs/SetBool").splitlines() == [
        "bool data",
        "---",
        "bool success",
        "string message",
    ]
    assert "# " in get_msg_text("sensor_msgs/LaserScan", raw=True)
    assert "std_srvs/SetBool" in list_types("std_srvs", MODE_SRV)
    assert list_types("std_srvs") == []
    with pytest.raises(ROSMsgException, match="Unable to load msg"):
        get_msg_text("std_msgs/Nothing")
    with pytest.raises(ValueError, match="Unknown mode"):
        list_types("std_srvs", ".action")


def test_packages_with_messages() -> None:
    from rosz.ros1.tools import rosmsg
    from rosz.ros1.tools.rospkg import RosPack

    packs = RosPack()
    assert "std_msgs" in dict(rosmsg.iterate_packages(packs, rosmsg.MODE_MSG))
    assert "std_srvs/SetBool" in rosmsg.rosmsg_search(packs, rosmsg.MODE_SRV, "SetBool")
    assert rosmsg.rosmsg_md5(rosmsg.MODE_MSG, "std_msgs/String") == String._md5sum
