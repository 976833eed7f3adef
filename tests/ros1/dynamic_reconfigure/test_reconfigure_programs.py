"""Programs of ROS 1 as processes of their own: what they import, serve, ask, and are told."""

from __future__ import annotations

import signal
from pathlib import Path
from textwrap import dedent

import pytest
from network import Network, Program, eventually

from rosz.reconfigure import Client, Config, Description, Server, Setting

from .cfg_samples import write_package

PROGRAMS = Path(__file__).with_name("programs")
HEAD = """
    import rosz.ros1, rospy, sys
    from dynamic_reconfigure.client import Client
    from dynamic_reconfigure.server import Server
"""


@pytest.fixture
def source(network: Network) -> Path:
    """The folder of a package with ``.cfg`` files and programs."""
    folder = network.folder / "src" / "sample"
    write_package(folder)
    (folder / "scripts").mkdir()
    for program in PROGRAMS.glob("*.py"):
        target = folder / "scripts" / program.name
        target.write_bytes(program.read_bytes())
        target.chmod(0o755)
    return folder


def start(network: Network, source: Path, script: str, *argv: str) -> Program:
    """Start a program that knows the package."""
    text = dedent(HEAD) + dedent(script)
    return network.program(text, *argv, ROSZ_PACKAGE_PATH=str(source.parent))


def say(network: Network, source: Path, script: str, *argv: str) -> list[str]:
    """Run a program to its end, and return what it says."""
    program = start(network, source, script, *argv)
    assert program.exit_code() == 0, program.output
    return program.lines


@pytest.fixture
def settings(network: Network) -> Server:
    """A server of another process, as far as a program can tell."""
    description = Description([Setting("int_param", 1, min=0, max=9), Setting("text", "x")])
    return Server(network.node("other"), description)


def test_imports(network: Network, source: Path) -> None:
    (source / "src" / "sample").mkdir(parents=True)
    (source / "src" / "sample" / "__init__.py").write_text("WHO = 'the code of the package'\n")
    script = """
        import sample, sample.cfg
        assert sample.WHO == "the code of the package"
        from sample.cfg import TutorialsConfig, LoopsConfig as loops
        import sample.cfg.TutorialsConfig
        assert sample.cfg.TutorialsConfig is TutorialsConfig
        print(TutorialsConfig.__name__, TutorialsConfig.Tutorials_Large, loops.all_level)
        for absent in ("sample.cfg.NothingConfig", "sample.cfg.x", "std_msgs.cfg", "json.cfg"):
            try:
                __import__(absent)
            except ModuleNotFoundError as error:
                print(error.name)
        import dynamic_reconfigure.msg, dynamic_reconfigure.encoding as encoding
        from dynamic_reconfigure import find_reconfigure_services, DynamicReconfigureException
        from dynamic_reconfigure.parameter_generator import double_t
        print(encoding.Config(a=1).a, double_t, dynamic_reconfigure.msg.Config().bools)
    """
    said = say(network, source, script)
    assert [line for line in said if line != "described"] == [
        "sample.cfg.TutorialsConfig 2 15",
        "sample.cfg.NothingConfig",
        "sample.cfg.x",
        "std_msgs.cfg",
        "json.cfg",
        "1 double []",
    ]


def test_a_module_that_catkin_has_generated_counts_where_there_is_no_file(
    network: Network, source: Path
) -> None:
    generated = source / "src" / "sample" / "cfg"
    generated.mkdir(parents=True)
    (generated.parent / "__init__.py").touch()
    (generated / "__init__.py").touch()
    (generated / "Built.py").write_text("WHO = 'built'\n")
    script = """
        from sample.cfg import Built, TutorialsConfig
        print(Built.WHO, TutorialsConfig.defaults["int_param"])
    """
    assert say(network, source, script) == ["built 50"]


def test_a_file_that_fails_is_one_line(network: Network, source: Path) -> None:
    file = source / "cfg" / "Tutorials.cfg"
    file.write_text(file.read_text().replace("50, 0, 100", "'50', 0, 100"))
    (source / "node.py").write_text("import rospy\nfrom sample.cfg import TutorialsConfig\n")
    program = network.run(
        "-m", "rosz.ros1", str(source / "node.py"), ROSZ_PACKAGE_PATH=str(source.parent)
    )
    assert program.exit_code() == 1
    assert program.lines == [
        f"ERROR: {source}/node.py:2: {file}:8: 'int_param' has type int, but default is '50'"
    ]


def test_a_server_in_a_namespace(network: Network, source: Path) -> None:
    script = """
        from sample.cfg import TutorialsConfig
        rospy.init_node("tuned")
        levels = []
        def decide(config, level):
            levels.append(level)
            return config
        left = Server(TutorialsConfig, decide, namespace="left")
        other = Server(TutorialsConfig, decide, "/elsewhere/deep")
        print(left.ns, other.ns, left.type is TutorialsConfig, left.description.groups[0].name)
        print(left.update_configuration({"int_param": 300, "bool_param": False}).int_param)
        print(rospy.get_param("~left/int_param"), rospy.get_param("/elsewhere/deep/int_param"))
        left.config.str_param = "changed in place"
        print(left.update_configuration(left.config)["str_param"], left.config.size, levels)
        left.callback = lambda config, level: None
        for changes in ({"nope": 1}, {"int_param": "x"}, {}):
            try:
                left.update_configuration(changes)
            except Exception as error:
                print(type(error).__name__, error)
    """
    assert [line for line in say(network, source, script) if "[ERROR]" not in line] == [
        "/tuned/left/ /elsewhere/deep/ True Default",
        "100",
        "100 50",
        "changed in place 1 [-1, -1, 4, 2]",
        "DynamicReconfigureParameterException there is no setting 'nope'; there are int_param,"
        " double_param, str_param, bool_param, size",
        "DynamicReconfigureParameterException 'int_param' cannot be 'x': expected a whole number",
        "DynamicReconfigureCallbackException Reconfigure callback should return a possibly updated"
        " configuration.",
    ]


def test_without_a_node(network: Network, source: Path) -> None:
    script = """
        from sample.cfg import TutorialsConfig
        import dynamic_reconfigure
        print(dynamic_reconfigure.find_reconfigure_services())
        for make in (lambda: Server(TutorialsConfig, max), lambda: Client("other")):
            try:
                make()
            except rospy.exceptions.ROSInitException as error:
                print("no node")
    """
    assert say(network, source, script) == ["[]", "no node", "no node"]


def test_values_survive_a_restart(network: Network, source: Path) -> None:
    network.node("keeper").params.names()
    script = """
        from sample.cfg import TutorialsConfig
        rospy.init_node("tuned")
        server = Server(TutorialsConfig, lambda config, level: config)
        print(server.config.int_param)
        server.update_configuration({"int_param": server.config.int_param + 1})
    """
    assert say(network, source, script) == ["50"]
    assert say(network, source, script) == ["51"]


@pytest.mark.usefixtures("settings")
def test_a_client(network: Network, source: Path) -> None:
    script = """
        rospy.init_node("asking")
        told = []
        client = Client("other", timeout=60)
        print(client.get_configuration(timeout=60)["int_param"], client.config.int_param)
        client.config_callback = told.append
        client.description_callback = lambda found: told.append([one["name"] for one in found])
        print(len(told), told[1], client.get_config_callback() == told.append)
        print(client.update_configuration({"int_param": 77})["int_param"])
        print(client.get_configuration().int_param, client.param_description[0]["max"])
        print(client.update_groups({"Default": False})["name"], client.config.groups.state)
        for changes in ({"nope": 1}, {"int_param": "x"}, {"groups": {"nope": True}}):
            try:
                client.update_configuration(changes)
            except Exception as error:
                print(type(error).__name__, error)
        client.close()
        client.close()
    """
    assert say(network, source, script) == [
        "1 1",
        "2 ['int_param', 'text'] True",
        "9",
        "9 9",
        "Default False",
        "DynamicReconfigureParameterException don't know parameter: nope",
        "DynamicReconfigureParameterException can't set parameter 'int_param' of <class 'int'>:"
        " 'int_param' cannot be 'x': expected a whole number",
        "DynamicReconfigureParameterException there is no group 'nope'; there are Default",
    ]


def test_a_client_of_nobody(network: Network, source: Path) -> None:
    network.node("keeper")
    script = """
        rospy.init_node("asking")
        try:
            Client("nobody", timeout=0.1)
        except rospy.exceptions.ROSException as error:
            print(error)
    """
    assert say(network, source, script) == [
        "timeout exceeded while waiting for service /nobody/set_parameters"
    ]


def test_a_client_waits_for_its_server(network: Network, source: Path) -> None:
    script = """
        rospy.init_node("asking")
        print(Client("late").get_configuration()["n"])
    """
    program = start(network, source, script)
    program.wait_for("Waiting for service /late/set_parameters...")
    Server(network.node("late"), Description([Setting("n", 5)]))
    assert program.exit_code() == 0
    assert program.lines[-1] == "5"


def test_a_waiting_client_is_interrupted(network: Network, source: Path) -> None:
    program = start(network, source, "rospy.init_node('asking')\nClient('never')")
    program.wait_for("Waiting for service /never/set_parameters...")
    program.send(signal.SIGINT)
    program.exit_code()
    assert "Interrupt" in program.lines[-1]


def test_a_stopped_server_ends_no_client(network: Network, source: Path) -> None:
    network.node("keeper")
    server = start(
        network,
        source,
        """
        from sample.cfg import TutorialsConfig
        rospy.init_node("tuned")
        Server(TutorialsConfig, lambda config, level: config)
        print("ready")
        rospy.spin()
        """,
    )
    server.wait_for("ready")
    script = """
        import dynamic_reconfigure.client
        dynamic_reconfigure.client._REPLY_TIMEOUT = 1.0
        rospy.init_node("asking")
        client = Client("tuned", timeout=60)
        print(client.get_configuration().int_param)
        sys.stdin.readline()
        print(client.get_configuration(timeout=0.2).int_param)
        try:
            client.update_configuration({"int_param": 1})
        except dynamic_reconfigure.DynamicReconfigureCallbackException as error:
            print(error)
    """
    client = start(network, source, script)
    client.wait_for("50")
    server.send(signal.SIGSTOP)
    try:
        client.say("")
        assert client.exit_code() == 0
    finally:
        server.send(signal.SIGCONT)
    assert client.lines[1:] == [
        "50",
        "service call failed: no answer of service '/tuned/set_parameters' within 1 s; the"
        " node is busy, stopped or out of reach",
    ]


def test_a_launch_file(network: Network, source: Path) -> None:
    (source / "tuned.launch").write_text(
        """\
<launch>
  <node pkg="sample" type="server.py" name="dynamic_tutorials" args="Tutorials" output="screen">
    <param name="int_param" value="12"/>
    <param name="size" value="Large"/>
  </node>
  <node pkg="dynamic_reconfigure" type="dynparam" name="adjust" output="screen"
        args="set_from_parameters dynamic_tutorials">
    <param name="double_param" value="0.25"/>
    <param name="str_param" value="adjusted"/>
  </node>
</launch>
"""
    )
    program = network.run(
        "-m", "rosz", "launch", str(source / "tuned.launch"), ROSZ_PACKAGE_PATH=str(source.parent)
    )
    program.wait_for("('int_param', 12), ('size', 2), ('str_param', 'Hello World')] -1")
    program.wait_for("('double_param', 0.25), ('int_param', 12), ('size', 2), ('str_param', 'adju")
    told: list[Config] = []
    client = Client(network.node("asking"), "dynamic_tutorials", config_callback=told.append)
    assert client.update({"int_param": 66}).str_param == "decided"
    eventually(lambda: told and told[-1].str_param == "decided", "the decision is announced")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0


def test_the_interpreter_runs_a_file_by_itself(network: Network, source: Path) -> None:
    program = network.run(
        "-m",
        "rosz.ros1",
        str(source / "cfg" / "Tutorials.cfg"),
        ROSZ_PACKAGE_PATH=str(source.parent),
    )
    assert (program.exit_code(), program.lines) == (0, [])
