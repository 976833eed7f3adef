"""roslaunch's API, compared with ROS 1's, and launches that scripts start."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from network import Network
from oracle import same

pytestmark = pytest.mark.ros1
PACKAGE = "python3-roslaunch"

NODES = """
from roslaunch.core import Executable, Machine, Master, Node, Param, Test
bad = [dict(cwd="foo"), dict(output="foo"), dict(name="a/b"), dict(respawn=True, required=True)]
node = Node("p", "t.py", "n", "/ns", "m", "a b", True, 2.0, [["x", "y"]], [("E", "v")], "screen")
test = Test("name", "p", "t", time_limit=2.5, retry=3)
first = Machine("a", "host", user="u", ssh_port=23)
result = [
    Node("p", "t").xmlattrs(), node.xmlattrs(), test.xmlattrs(), node.namespace, node.remap_args,
    [tried(lambda: Node("p", "t", **options)) for options in bad],
    [tried(Node, *words) for words in (("", "t"), ("p", " "))],
    [tried(lambda: Test("n", "p", "t", time_limit=limit)) for limit in (-1, True, "x")],
    Param("a//b/", 1).key, str(Param("/a", [1])), Param("/a", 1) == Param("/a", 1),
    str(Executable("ls", ["-l"])), Master(uri="http://h:7/").get_port(),
    first.config_equals(Machine("b", "host", user="u", ssh_port=23)),
    first == Machine("b", "host", user="u", ssh_port=23), first.config_key(),
]
"""

FILE = """<launch>
  <arg name="who" default="bob"/><arg name="count"/>
  <param name="n" value="$(arg count)"/><param name="text" type="str" value="1"/>
  <rosparam>{a: {b: [1, 2.5, x]}}</rosparam>
  <rosparam command="delete" param="old"/>
  <group ns="g" clear_params="true">
    <remap from="in" to="out"/>
    <node pkg="p" type="t" name="$(arg who)" args="-x 1" required="true" output="screen">
      <env name="E" value="v"/><param name="own" value="true"/>
    </node>
  </group>
  <machine name="m" address="far" user="u"/>
  <test test-name="check" pkg="p" type="test.py" time-limit="9" retry="2"/>
</launch>"""

CONFIG = f"""
import roslaunch.config, roslaunch.xmlloader
config = roslaunch.config.ROSLaunchConfig()
text = {FILE!r}
import tempfile
with tempfile.NamedTemporaryFile("w", suffix=".launch") as file:
    file.write(text)
    file.flush()
    roslaunch.xmlloader.XmlLoader().load(file.name, config, argv=["count:=3"], verbose=False)
    twice = tried(roslaunch.xmlloader.XmlLoader().load, file.name, config, False, ["count:=3"])
    unset = tried(roslaunch.xmlloader.XmlLoader().load, file.name, config, False, [])
node, test = config.nodes[0], config.tests[0]
result = [
    {{name: param.value for name, param in config.params.items()}}, config.clear_params,
    node.xmlattrs(), node.remap_args, node.env_args, [str(one) for one in config.executables],
    test.xmlattrs(), sorted(config.machines), config.machines["m"].user,
    config.resolved_node_names, twice, unset[0],
]
"""

REST = """
import os, roslaunch.config, roslaunch.rlutil
from roslaunch.core import setup_env, Machine, Node
from roslaunch.loader import convert_value
from roslaunch.substitution_args import resolve_args
context = {"arg": {"a": "1"}}
texts = ["$(arg a)/x", "$(optenv NO_SUCH b c)", "$(eval 1 + arg('a'))", "$(arg b)", "$(find)", "x",
         "$(eval ''.join(map(str, [4,2])))", "$(eval sorted(['bb', arg('a')], key=str))",
         "$(dirname)", "$(env NO_SUCH)", ""]
pairs = [("1", "auto"), ("1.5", "auto"), ("true", "auto"), ("1", "bool"), ("x", "int"),
         ("1", "double"), ("[1, a]", "yaml"), ("2", "str"), ("maybe", "bool"), ("1", "odd")]
env = setup_env(Node("p", "t", namespace="/a/b/", env_args=[("K", "v")]), None, "http://m", {})
result = [
    [tried(resolve_args, text, context) for text in texts],
    resolve_args("$(dirname)/y", {"filename": "/f/g.launch"}),
    [tried(convert_value, *pair) for pair in pairs],
    [env["ROS_NAMESPACE"], env["K"], env["ROS_MASTER_URI"]],
    tried(roslaunch.rlutil.resolve_launch_arguments, ["no_such_package", "x.launch"]),
    tried(roslaunch.rlutil.resolve_launch_arguments, ["no_such.launch"]),
    roslaunch.rlutil.resolve_launch_arguments([]),
]
"""


@pytest.mark.parametrize("snippet", [NODES, CONFIG, REST], ids=["nodes", "config", "rest"])
def test_it_is_as_in_ros_1(snippet: str) -> None:
    same(snippet, "roslaunch", PACKAGE)


SCRIPT = """
import sys, threading, roslaunch, rospy
uuid = roslaunch.rlutil.get_or_generate_uuid(None, False)
roslaunch.configure_logging(uuid)

def say(*words):
    # In one piece: lines of the nodes come between the parts of a print.
    sys.stdout.write(" ".join(map(str, words)) + chr(10))

died = threading.Event()

class Listener(roslaunch.pmon.ProcessListener):
    def process_died(self, name, code):
        say("died", name, code)
        parent.pm.has_process(name)
        died.set()

parent = roslaunch.parent.ROSLaunchParent(
    uuid,
    [(sys.argv[1], ["name:=bob", "go:=" + sys.argv[2]])],
    process_listeners=[Listener()],
    show_summary=False,
)
parent.start()
say("names", parent.pm.get_active_names())
open(sys.argv[2], "w").close()
died.wait(60)
script = roslaunch.scriptapi.ROSLaunch()
script.start()
node = roslaunch.core.Node("rosz_tutorials", "publisher.py", "extra", output="screen")
process = script.launch(node)
say("alive", process.is_alive(), process.name)
try:
    script.launch(roslaunch.core.Node("rosz_tutorials", "no_such.py", "lost"))
except roslaunch.RLException as error:
    say("refused", "no_such.py" in str(error))
rospy.init_node("user")
say("who", rospy.get_param("/who"))
rospy.wait_for_message("/numbers", rospy.AnyMsg, 60)
process.stop()
say("alive", process.is_alive())
script.stop()
parent.shutdown()
say("active", parent.pm.get_active_names())
"""
LAUNCH = """<launch>
  <arg name="name"/><param name="who" value="$(arg name)"/>
  <arg name="go" default="/" doc="What has to exist before the second node begins, and fails"/>
  <arg name="prefix" value="until [ -e $(arg go) ]; do sleep 0.05; done; exec $0 $@"/>
  <node pkg="rosz_tutorials" type="subscriber.py" name="$(arg name)"/>
  <node pkg="topic_tools" type="relay" name="wrong" launch-prefix="sh -c '$(arg prefix)'"/>
</launch>"""


def test_a_script_starts_and_ends_launches(network: Network, tmp_path: Path) -> None:
    script, launch = tmp_path / "script.py", tmp_path / "a.launch"
    script.write_text(SCRIPT)
    launch.write_text(LAUNCH)
    words = map(str, (script, launch, tmp_path / "go"))
    program = network.run("-m", "rosz.ros1", *words, PYTHONWARNINGS="")
    assert program.exit_code() == 0, program.output
    said = ("names", "died", "alive", "refused", "who", "active")
    assert [line for line in program.lines if line.startswith(said)] == [
        "names ['bob-1', 'wrong-2']",
        "died wrong-2 1",
        "alive True extra-1",
        "refused True",
        "who bob",
        "alive False",
        "active []",
    ]


def test_the_nodes_end_with_the_script(network: Network, tmp_path: Path) -> None:
    launch = tmp_path / "a.launch"
    launch.write_text(LAUNCH)
    program = network.program(
        """
        import sys
        import rosz.ros1, roslaunch
        parent = roslaunch.parent.ROSLaunchParent("x", [(sys.argv[1], ["name:=bob"])])
        parent.start()
        print("pid", next(one.pid for one in parent.pm.procs))
        """,
        str(launch),
        PYTHONWARNINGS="",
    )
    pid = int(program.wait_for(re.compile("^pid ")).rpartition(" ")[2])
    assert program.exit_code() == 0, program.output
    assert not Path(f"/proc/{pid}").exists()
