"""The lecture on the parameter server, line by line.

What a line of it prints here in another way:

- ``rosparam list`` after ``roscore``: no ``/roslaunch/uris/…``, because roscore is no launch; while
  one runs, its entry is there, of the form ``host_<name>__<pid>``.
- the core of a launch: ``auto-starting new master``, ``process[master]``, ``process[rosout-1]`` and
  ``started core service [/rosout]`` do not come, because nothing of the kind is started, and nodes
  are numbered from 1.
- ``rosparam get /`` after a launch has ended: the parameters ended with the last process that had
  them; so it is asked while the launch runs.
- ``rosparam load config.yaml /my_settings``, where keys begin with a slash, sets nothing that one
  can get, in ROS 1 as here; without the slashes it does what the lecture expects;
- ``source …/setup.bash``, ``gedit``: nothing to source but what ``catkin_make`` left; no editor.
"""

from __future__ import annotations

import re
import shutil
from textwrap import dedent
from typing import NamedTuple

import pytest

from .terminal import COURSE, Desk, Terminal, without_times

OWN_PARAMETERS = "/rosdistro\n/rosversion\n/run_id\n"
"""What roscore sets."""


@pytest.fixture
def core(desk: Desk) -> Terminal:
    """Terminal 1 of the lecture: ``roscore``."""
    terminal = desk.terminal(desk.home)
    terminal.start("roscore")
    terminal.wait_for("started core")
    return terminal


def tree(text: str) -> str:
    """Return a tree as ``rosparam get`` prints it, without what stands for ROS itself."""
    plain = re.sub(r"(?m)^(rosdistro|rosversion): '.*\n\n  '\n|^run_id: .*\n", "", text)
    return re.sub(r"(?m)^roslaunch:\n  uris:\n.*\n", "", plain).strip("\n") + "\n"


@pytest.mark.usefixtures("core")
def test_list_get_and_set(desk: Desk) -> None:
    """Sections 1.4 and 1.5."""
    two, three = desk.terminal(desk.home), desk.terminal(desk.home)
    assert two.type("rosparam list") == OWN_PARAMETERS
    two.start("roslaunch turtlesim turtlesim_node")
    two.wait_for("Spawning turtle")
    background = "/turtlesim/background_b\n/turtlesim/background_g\n/turtlesim/background_r\n"
    names = three.type("rosparam list").splitlines(keepends=True)
    uri = names.pop(1)
    assert re.fullmatch(r"/roslaunch/uris/host_\w+__\d+\n", uri)
    assert "".join(names) == OWN_PARAMETERS + background
    assert three.type("rosparam list /turtlesim") == background
    assert three.type("rosparam get /turtlesim/background_b") == "255\n"
    assert three.type("rosparam get /turtlesim/background_r") == "69\n"
    assert three.type("rosparam get /turtlesim/background_g") == "86\n"
    assert three.type("rosparam set /turtlesim/background_g 255") == ""
    assert three.type("rosparam get /turtlesim/background_g") == "255\n"
    assert three.type("rosservice call /clear").strip() == ""
    whole = three.type("rosparam get /")
    assert re.fullmatch(
        r"rosdistro: 'noetic\n\n  '\nroslaunch:\n  uris:\n    host_\w+__\d+: \S+\n"
        r"rosversion: '1\.17\.\d+\n\n  '\nrun_id: [\da-f-]{36}\n"
        r"turtlesim:\n  background_b: 255\n  background_g: 255\n  background_r: 69\n\n",
        whole,
    )


@pytest.mark.usefixtures("core")
def test_delete(desk: Desk) -> None:
    """Section 1.6."""
    terminal = desk.terminal(desk.home)
    for name in ("my_global_param", "my_node/param_a", "my_node/param_b"):
        assert terminal.type(f"rosparam set /{name} 1") == ""
    assert terminal.type("rosparam set /sensors/camera '{rate: 30, size: [640, 480]}'") == ""
    assert terminal.type("rosparam delete /my_global_param") == ""
    assert terminal.type("rosparam delete /my_node/param_a") == ""
    assert terminal.type("rosparam list /my_node") == "/my_node/param_b\n"
    assert terminal.type("rosparam delete /my_node") == ""
    assert terminal.type("rosparam delete /sensors/camera") == ""
    assert terminal.type("rosparam list") == OWN_PARAMETERS
    assert terminal.type("rosparam delete /") == ""
    assert terminal.type("rosparam get /") == "{}\n\n"


@pytest.mark.usefixtures("core")
def test_dump_and_load(desk: Desk) -> None:
    """Sections 1.7 and 2.1.1: a snapshot, and its way back under another name."""
    two, three = desk.terminal(desk.home), desk.terminal(desk.home)
    two.start("roslaunch turtlesim turtlesim_node")
    two.wait_for("Spawning turtle")
    assert three.type("rosparam set /turtlesim/background_g 255") == ""
    assert three.type("rosparam dump 1122.yaml") == ""
    assert three.type("rosparam dump 2233.yaml /turtlesim") == ""
    colours = "background_b: 255\nbackground_g: 255\nbackground_r: 69\n"
    assert three.type("cat 2233.yaml") == colours
    snapshot = three.type("cat 1122.yaml")
    below = "".join(f"  {line}\n" for line in colours.splitlines())
    assert tree(snapshot) == f"turtlesim:\n{below}"
    two.interrupt()
    assert three.type("rosparam delete /turtlesim") == ""

    assert three.type("rosparam load 1122.yaml copy") == ""
    whole = three.type("rosparam get /")
    assert "".join(f"  {line}".rstrip() + "\n" for line in snapshot.splitlines()) in whole
    assert three.type("rosparam get /copy/turtlesim/background_b") == "255\n"
    assert three.type("MY_VARIABLE=$(rosparam get /copy/turtlesim/background_r)") == ""
    assert three.type("echo $MY_VARIABLE") == "69\n"
    assert three.type("MY_VARIABLE=$(rosparam get /copy/turtlesim/)") == ""
    assert three.type("echo $MY_VARIABLE") == (
        "background_b: 255 background_g: 255 background_r: 69\n"
    )


@pytest.mark.usefixtures("core")
def test_load_a_file(desk: Desk) -> None:
    """Section 2: files written by hand."""
    desk.add("example_param_pkg")
    terminal = desk.terminal(desk.home)
    file = "~/catkin_ws/src/example_param_pkg/params/config.yaml"
    names = "/parameter_name_1\n/parameter_name_2\n"
    assert terminal.type(f"rosparam load {file}") == ""
    assert terminal.type("rosparam list") == names + OWN_PARAMETERS
    relative = desk.home / "relative.yaml"
    relative.write_text("parameter_name_1: 10\nparameter_name_2: 'D'\n")
    assert terminal.type("rosparam load relative.yaml /my_settings") == ""
    assert terminal.type("rosparam list /my_settings") == "".join(
        f"/my_settings{name}\n" for name in names.splitlines()
    )
    assert terminal.type("rosparam get /my_settings/parameter_name_1") == "10\n"
    (desk.home / "all_params.yaml").write_text(
        dedent(
            """\
            /publisher_node:
              message_text: "Hello from param file!"
              publish_rate: 2.0
            /rosdistro: "noetic"
            /roslaunch:
              uris:
                host_example_param_pkg_publisher_node__63768: "http://the_machine_ip:the_port/"
            /rosversion: "1.15.14" # ROS version
            /run_id: "run_id_string"
            """
        )
    )
    assert terminal.type("rosparam load all_params.yaml") == ""
    assert terminal.type("rosparam get /publisher_node") == (
        "message_text: Hello from param file!\npublish_rate: 2.0\n\n"
    )
    assert terminal.type("rosparam get /rosversion") == "1.15.14\n"


class Shown(NamedTuple):
    """What the lecture shows of a launch.

    Attributes:
        publisher: Name of the publishing node.
        rate: The rate that it says it has.
        text: The text that it publishes.
        parameters: All parameters but those of ROS itself.
    """

    publisher: str
    rate: str
    text: str
    parameters: str


def private(publisher: str, rate: str, text: str, rest: str = "") -> Shown:
    """What is shown where the publisher finds its parameters in its own namespace."""
    head, _, tail = rest.partition("|")
    own = f"{publisher}:\n  message_text: {text}\n  publish_rate: {rate}\n"
    return Shown(publisher, rate, text, head + own + tail)


def common(rate: str, text: str) -> Shown:
    """What is shown where the parameters are everybody's, and so not the publisher's."""
    parameters = f"message_text: {text}\npublish_rate: {rate}\n"
    return Shown("param_publisher_node", "1.0", "Hello Default", parameters)


NODE = "param_publisher_node"
FILE = "Hello from param file!"
DEFAULT, GIVEN = "hhhhhhhhhh", "888888888888hh"
SET = f'publish_rate:=1 message_text:="{GIVEN}"'
ABOVE = f"message_text: {FILE}\n|publish_rate: 2.0\n"
LAUNCHES = {
    "example.launch": private(NODE, "2.0", FILE),
    f"example.launch {SET}": private(NODE, "2.0", FILE),
    "example4.launch": common("55", DEFAULT),
    f"example4.launch {SET}": common("1", GIVEN),
    "example3.launch": private(NODE, "55", DEFAULT),
    f"example3.launch {SET}": private(NODE, "1", GIVEN),
    "example2.launch": private("param_publisher", "55", DEFAULT, ABOVE),
    f"example2.launch {SET}": private("param_publisher", "1", GIVEN, ABOVE),
    "example1.launch": private(NODE, "55", DEFAULT),
    f"example1.launch {SET}": private(NODE, "1", GIVEN),
}


@pytest.mark.parametrize("line", LAUNCHES)
def test_launch(desk: Desk, line: str) -> None:
    """Section 4: what the terminal shows, and what ``rosparam get /`` does beside it."""
    shown = LAUNCHES[line]
    desk.add("example_param_pkg")
    one, two = desk.terminal(), desk.terminal()
    one.start(f"roslaunch example_param_pkg {line}")
    one.wait_for("Received", 2)
    assert tree(two.type("rosparam get /")) == shown.parameters
    output = without_times(one.interrupt()).replace("^C", "").splitlines()
    nodes = output.index("NODES")
    assert output[nodes + 1 : nodes + 4] == [
        "  /",
        f"    {shown.publisher} (example_param_pkg/publisher_node.py)",
        "    param_subscriber (example_param_pkg/subscriber_node.py)",
    ]
    first = output.index("setting /run_id to RUN")
    last = output.index("[param_subscriber-2] killing on exit")
    assert output[first + 1 : first + 3] == [
        f"process[{shown.publisher}-1]: started with pid [PID]",
        "process[param_subscriber-2]: started with pid [PID]",
    ]
    said = output[first + 3 : last]
    assert f"[INFO] [TIME]: [Publisher] Publishing at {shown.rate} Hz: '{shown.text}'" in said
    assert {one for one in said if "[Publisher]" not in one} == {
        f"[INFO] [TIME]: [Subscriber] Received: {shown.text}"
    }
    ending = [one for one in output[last + 1 :] if "Received" not in one]  # on their way still
    assert ending == [
        f"[{shown.publisher}-1] killing on exit",
        "shutting down processing monitor...",
        "... shutting down processing monitor complete",
        "done",
    ]


@pytest.mark.parametrize("file", ["global_params.launch", "node_private_params.launch"])
def test_where_a_file_is_loaded(desk: Desk, file: str) -> None:
    """Section 2.1.2: the same element at the top and inside a node."""
    desk.add("example_param_pkg")
    one, two = desk.terminal(), desk.terminal()
    one.start(f"roslaunch example_param_pkg {file}")
    one.wait_for("Received", 1)
    names = two.type("rosparam list")
    loaded = {
        "global_params.launch": "/parameter_name_1\n/parameter_name_2\n",
        "node_private_params.launch": (
            "/publisher_node/message_text\n/publisher_node/publish_rate\n"
        ),
    }
    assert names.startswith(loaded[file])
    one.interrupt()


def test_reading_in_a_node(desk: Desk) -> None:
    """Section 2.1.2.3: global, private, with a default, and only if there."""
    desk.add("example_param_pkg")
    terminal = desk.terminal()
    terminal.start("roslaunch example_param_pkg reader.launch")
    terminal.wait_for("finished cleanly")
    output = without_times(terminal.interrupt())
    said = [line for line in output.splitlines() if "[TIME]" in line]
    assert sorted(said) == sorted(
        [
            "[INFO] [TIME]: Global publish rate: 4.0",
            "[INFO] [TIME]: Private publish rate: 2.0",
            "[INFO] [TIME]: Parameter with default: 5.0",
            "[WARN] [TIME]: Global param does not exist.",
            "[WARN] [TIME]: Private param does not exist.",
        ]
    )


def test_the_package_is_made_from_nothing(desk: Desk) -> None:
    """Section 4.1: folders, ``catkin_create_pkg``, files by an editor, ``catkin_make``."""
    terminal = desk.terminal(desk.home)
    for line in ("mkdir -p ~/mycatkin_ws/src", "cd ~/mycatkin_ws/src"):
        assert terminal.type(line) == ""
    terminal.type("catkin_create_pkg example_param_pkg rospy roscpp std_msgs")
    made = desk.home / "mycatkin_ws" / "src" / "example_param_pkg"
    assert (made / "package.xml").is_file()
    manifest = (made / "package.xml").read_text()
    for dependency in ("rospy", "roscpp", "std_msgs"):
        assert dependency in manifest
    assert terminal.type("cd ..") == ""
    assert "0 errors" in terminal.type("catkin_make")
    for part in ("launch", "params", "src"):
        shutil.copytree(COURSE / "src/example_param_pkg" / part, made / part, dirs_exist_ok=True)
    (made / "src" / "publisher_node.py").chmod(0o644)
    terminal.type("cd ~/mycatkin_ws/src/example_param_pkg")
    assert terminal.type("chmod +x src/publisher_node.py") == ""
    terminal.type("cd ~/mycatkin_ws")
    assert "0 errors" in terminal.type("catkin_make")
    assert terminal.type("source ~/mycatkin_ws/devel/setup.bash") == ""
    assert terminal.type("cd /") == ""
    terminal.start("roslaunch example_param_pkg example.launch")
    terminal.wait_for(f"Received: {FILE}", 2)
    terminal.interrupt()


def test_a_change_after_the_start_has_no_effect(desk: Desk) -> None:
    """Section 5: a node that reads its parameters once."""
    desk.add("example_param_pkg")
    one, two = desk.terminal(), desk.terminal()
    one.start("roslaunch example_param_pkg example3.launch")
    one.wait_for("Received", 2)
    assert two.type("rosparam set /param_publisher_node/message_text changed") == ""
    assert two.type("rosparam get /param_publisher_node/message_text") == "changed\n"
    so_far = one.wait_for("Received").count("Received")
    assert "changed" not in one.wait_for("Received", so_far + 5)
    one.interrupt()
