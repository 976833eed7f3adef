"""Launch files in Python become plans."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosz.errors import LaunchFileError

from .conftest import Folder

pytestmark = pytest.mark.pure

CONFIGURATION = "LaunchConfiguration('x')"


def test_a_node_has_what_the_file_says(folder: Folder) -> None:
    node = folder.node(
        """
        Node(
            package='robot', executable='driver.py', name='left', namespace='arm',
            arguments=['--fast', ['a', 'b']], remappings=[('scan', '/laser')], output='screen',
            respawn=True, respawn_delay=2.5, respawn_max_retries=3, prefix='nice -n 5',
            additional_env={'MODE': 'test'}, ros_arguments=['--log-level', 'debug'],
        ),
        """
    )
    assert (node.package, node.type, node.full_name) == ("robot", "driver.py", "/arm/left")
    assert node.args == ("--fast", "ab", "--ros-args", "--log-level", "debug")
    assert node.remaps == (("scan", "/laser"),)
    assert (node.output, node.respawn, node.respawn_delay, node.respawn_max) == (
        "screen",
        True,
        2.5,
        3,
    )
    assert node.launch_prefix == ("nice", "-n", "5")
    assert node.env == (("MODE", "test"),)
    assert node.cwd == str(folder.path)
    assert node.named
    assert node.ros2
    assert (node.place.line, node.place.column) == (13, 9)


def test_a_node_without_a_name_keeps_that_of_its_program(folder: Folder) -> None:
    plan = folder.plan("*[Node(package='robot', executable='a.b') for _ in range(2)]")
    assert [(node.full_name, node.named) for node in plan.nodes] == [("/a", False), ("/a_2", False)]


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("5", 5),
        ("'5'", "5"),
        ("[1, 2.5]", [1.0, 2.5]),
        ("['a', 'b']", ["a", "b"]),
        (CONFIGURATION, 7),
        (f"[{CONFIGURATION}, '0']", 70),
        (f"[['a', {CONFIGURATION}], ['b']]", ["a7", "b"]),
        (f"[1, {CONFIGURATION}]", [1, 7]),
        (f"ParameterValue({CONFIGURATION}, value_type=str)", "7"),
        (f"ParameterValue({CONFIGURATION}, value_type=float)", 7.0),
        ("ParameterValue('[1, 2]', value_type=__import__('typing').List[int])", [1, 2]),
        ("TextSubstitution(text='')", ""),
        ("True", True),
    ],
)
def test_values_of_parameters(folder: Folder, value: str, expected: object) -> None:
    plan = folder.plan(
        f"Node(package='robot', executable='a', name='n', parameters=[{{'p': {value}}}])", x="7"
    )
    assert plan.nodes[0].ros_params == ({"p": expected},)
    (param,) = plan.params
    assert (param.name, param.value) == ("/n/p", expected)
    assert type(param.value) is type(expected)


def test_parameters_come_from_all_sources_in_order(folder: Folder) -> None:
    file = folder.write(
        "p.yaml", "/**: {ros__parameters: {a: 1}}\nn: {ros__parameters: {b: {c: 2}}}\n"
    )
    plan = folder.plan(
        """
        SetParameter('use_sim_time', True),
        Node(package='robot', executable='a', name='n', parameters=[
            PathJoinSubstitution([FindPackageShare('robot'), 'p.yaml']),
            {'a': 3, 'deep': {'er': 'x'}},
            ParameterFile('absent.yaml', allow_substs=True),
        ]),
        """
    )
    assert plan.nodes[0].ros_params == (
        {"use_sim_time": True},
        file,
        {"a": 3, "deep.er": "x"},
    )
    assert {param.name: param.value for param in plan.params} == {
        "/n/use_sim_time": True,
        "/n/a": 3,
        "/n/b/c": 2,
        "/n/deep/er": "x",
    }
    assert "absent.yaml' is left out: [Errno 2] No such file" in plan.warnings[0].text


def test_files_of_parameters_may_have_substitutions(folder: Folder) -> None:
    folder.write("p.yaml", "/**: {ros__parameters: {a: $(find-pkg-share robot), b.c: $(var x)}}\n")
    parameters = "[ParameterFile('p.yaml', allow_substs=True), Parameter('d', 'e')]"
    node = folder.node(
        f"Node(package='robot', executable='a', name='n', parameters={parameters})", x="7"
    )
    assert node.ros_params == ({"a": str(folder.path), "b.c": 7}, {"d": "e"})


def test_arguments_have_defaults_values_and_choices(folder: Folder) -> None:
    text = """
        DeclareLaunchArgument('name', default_value='left', choices=['left', 'right']),
        DeclareLaunchArgument('program', default_value=[LaunchConfiguration('name'), '_arm']),
        Node(
            package='robot', executable=LaunchConfiguration('program'),
            name=LaunchConfiguration('name'),
        ),
    """
    assert folder.node(text).type == "left_arm"
    assert folder.node(text, name="right").type == "right_arm"
    assert folder.error(text, name="up") == "2: argument 'name' is 'up'; expected left, right"
    plan = folder.plan(text, nam="x")
    assert plan.unused_args == ("nam",)
    assert "did you mean 'name'" in plan.warnings[0].text


def test_arguments_are_described_without_values(folder: Folder) -> None:
    docs = folder.args(
        """
        DeclareLaunchArgument('a', description='how many'),
        Node(package='robot', executable=LaunchConfiguration('a')),
        DeclareLaunchArgument('b', default_value='5'),
        """
    )
    assert [(doc.name, doc.doc, doc.default) for doc in docs] == [
        ("a", "how many", None),
        ("b", None, "5"),
    ]


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("IfCondition('true')", True),
        ("IfCondition('0')", False),
        ("UnlessCondition(LaunchConfiguration('x'))", False),
        ("IfCondition(PythonExpression([LaunchConfiguration('x'), ' == 1 and pi > 3']))", True),
        ("LaunchConfigurationEquals('x', '1')", True),
        ("LaunchConfigurationNotEquals('x', '1')", False),
        ("LaunchConfigurationEquals('y', None)", True),
        ("IfCondition(EqualsSubstitution(LaunchConfiguration('x'), '1.0'))", True),
        ("IfCondition(AndSubstitution('true', NotSubstitution('false')))", True),
        ("IfCondition(OrSubstitution('false', NotEqualsSubstitution('a', 'a')))", False),
    ],
)
def test_conditions(folder: Folder, condition: str, holds: bool) -> None:
    plan = folder.plan(f"Node(package='robot', executable='a', condition={condition})", x="1")
    assert bool(plan.nodes) is holds


@pytest.mark.parametrize(
    ("substitution", "text"),
    [
        ("EnvironmentVariable('HOME')", "/home/me"),
        ("EnvironmentVariable('NONE', default_value='none')", "none"),
        ("LaunchConfiguration('none', default=2)", "2"),
        ("ThisLaunchFileDir()", "FOLDER"),
        ("ThisLaunchFile()", "FOLDER/x.launch.py"),
        ("[FindPackageShare('robot'), '/launch']", "FOLDER/launch"),
        ("FindPackagePrefix('robot')", "FOLDER"),
        ("PathSubstitution('a') / 'b'", "a/b"),
        ("Command(['echo ', 'hi'])", "hi\n"),
        ("FindExecutable(name='sh')", "/bin/sh"),
    ],
)
def test_substitutions(folder: Folder, substitution: str, text: str) -> None:
    environ = {"HOME": "/home/me", "PATH": "/bin"}
    (step,) = folder.plan(f"LogInfo(msg={substitution})", environ=environ).steps
    assert step.text == text.replace("FOLDER", str(folder.path))


def test_groups_hold_namespaces_settings_and_variables(folder: Folder) -> None:
    plan = folder.plan(
        """
        GroupAction([
            PushRosNamespace('fleet'), PushROSNamespace('one'), SetRemap('a', 'b'),
            SetEnvironmentVariable('MODE', 'test'), AppendEnvironmentVariable('MODE', 'x'),
            SetLaunchConfiguration('x', '2'),
            Node(package='robot', executable='a', name=['n', LaunchConfiguration('x')]),
            Node(package='robot', executable='a', name='m', namespace='/other'),
        ]),
        Node(package='robot', executable='a', name=['n', LaunchConfiguration('x')]),
        GroupAction([SetUseSimTime(True)], scoped=False),
        GroupAction([LogInfo(msg=LaunchConfiguration('x', default='none'))], forwarding=False),
        Node(package='robot', executable='a', name='last'),
        """,
        ns="lab",
        x="1",
    )
    names = ["/lab/fleet/one/n2", "/other/m", "/lab/n1", "/lab/last"]
    assert [node.full_name for node in plan.nodes] == names
    assert plan.nodes[0].env == (("MODE", "test:x"),)
    assert plan.nodes[0].remaps == (("a", "b"),)
    assert plan.nodes[2].env == plan.nodes[2].remaps == ()
    assert plan.nodes[3].ros_params == ({"use_sim_time": True},)
    assert plan.steps[0].text == "none"


def test_programs(folder: Folder) -> None:
    plan = folder.plan(
        """
        ExecuteProcess(cmd=['ros2', 'topic', ['/', LaunchConfiguration('x')]], output='screen'),
        ExecuteProcess(cmd=['echo a', '| cat'], shell=True, name='shown', cwd='/tmp'),
        Node(executable='/opt/driver', name='n'),
        """,
        x="scan",
    )
    first, second, third = plan.nodes
    assert (first.command, first.name, first.output) == (
        ("ros2", "topic", "/scan"),
        "ros2",
        "screen",
    )
    assert (second.command, second.name, second.cwd) == (
        ("/bin/sh", "-c", "echo a | cat"),
        "shown",
        "/tmp",
    )
    assert (third.command, third.type, third.package) == (("/opt/driver",), "/opt/driver", "")


def test_functions_of_the_file_return_actions(folder: Folder) -> None:
    file = folder.write(
        "x.launch.py",
        """
        from dataclasses import dataclass

        import launch
        import launch_ros.actions
        from launch.substitutions import LaunchConfiguration

        @dataclass
        class Robot:
            name: str

        class Half(launch.Substitution):
            def __init__(self, whole):
                super().__init__()
                self.whole = whole
            def perform(self, context):
                return str(int(context.perform_substitution(self.whole)) // 2)

        def start(context, prefix):
            count = int(LaunchConfiguration("count").perform(context))
            return [
                launch_ros.actions.Node(
                    package="robot", executable="a", name=Robot(prefix + str(i)).name
                )
                for i in range(count)
            ]

        def generate_launch_description():
            ld = launch.LaunchDescription()
            ld.add_action(launch.actions.DeclareLaunchArgument("count", default_value="2"))
            ld.add_action(launch.actions.OpaqueFunction(function=start, args=["r"]))
            ld.add_action(launch.actions.LogInfo(msg=["half ", Half(LaunchConfiguration("count"))]))
            return ld
        """,
    )
    plan = folder.read(file, count="3")
    assert [node.name for node in plan.nodes] == ["r0", "r1", "r2"]
    assert plan.steps[0].text == "half 1"


def test_includes_take_arguments_and_tell_their_chain(folder: Folder) -> None:
    inner = folder.write(
        "launch/inner.launch.py",
        """
        from launch import LaunchDescription
        from launch.actions import DeclareLaunchArgument
        from launch.substitutions import LaunchConfiguration, ThisLaunchFileDir
        from launch_ros.actions import Node

        def generate_launch_description():
            return LaunchDescription([
                DeclareLaunchArgument("name"),
                Node(package="robot", executable="a", name=LaunchConfiguration("name"),
                     arguments=[ThisLaunchFileDir()]),
            ])
        """,
    )
    text = """
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource([FindPackageShare('robot'), '/launch/inner.launch.py']),
            launch_arguments={}.items(),
        ),
        LogInfo(msg=ThisLaunchFileDir()),
    """
    plan = folder.plan(text.replace("{}", "{'name': ['le', 'ft']}"))
    assert [(node.name, node.args) for node in plan.nodes] == [("left", (str(Path(inner).parent),))]
    assert plan.steps[0].text == str(folder.path)
    assert plan.files == (str(folder.path / "x.launch.py"), inner)
    with pytest.raises(LaunchFileError) as caught:
        folder.plan(text)
    assert str(caught.value) == (
        f"{inner}:9:9: argument 'name' has no value; give name:=VALUE\n"
        f"  included from {folder.path}/x.launch.py:13:9"
    )


def test_a_file_that_includes_itself_is_refused(folder: Folder) -> None:
    with pytest.raises(LaunchFileError, match="includes nest deeper than 50"):
        folder.plan("IncludeLaunchDescription(ThisLaunchFile())")


@pytest.mark.parametrize(
    ("entities", "error"),
    [
        (
            "Node(package='robot', node_executable='a')",
            "1: Node takes no 'node_executable' in rosz; did you mean 'executable'?",
        ),
        ("Node(package='robot')", "1: Node needs 'executable'"),
        ("ExecuteProcess(cmd=[])", "1: ExecuteProcess needs 'cmd'"),
        ("LogInfo()", "1: TypeError: missing a required argument: 'msg'"),
        (
            "LogInfo(msg=LaunchConfiguration('y'))",
            "1: there is no launch configuration 'y'; there are: x",
        ),
        ("LogInfo(msg=5)", "1: 5 is neither a text nor a substitution; write '5'"),
        ("LogInfo(msg=EnvironmentVariable('NO'))", "1: environment variable 'NO' is not set"),
        ("LogInfo(msg=FindExecutable('nothing'))", "1: there is no program 'nothing' on the PATH"),
        ("LogInfo(msg=Command('false'))", "1: command '/bin/false' ended with code 1"),
        (
            "LogInfo(msg='', condition=IfCondition('maybe'))",
            "1: ValueError: 'maybe' is not a bool; expected true, false, 1 or 0",
        ),
        ("1 / 0", "1: ZeroDivisionError: division by zero"),
        ("OpaqueFunction(function=lambda context:\n{}['a'])", "2: KeyError: 'a'"),
        ("LogInfo(msg=PythonExpression('1 +'))", "1: invalid syntax: 1 +"),
        (
            "Node(package='robot', executable='a', name='a/b')",
            "1: 'a/b' is not a valid name: it contains '/'; expected a base name without a"
            " namespace",
        ),
        (
            "Node(package='robot', executable='a', parameters=[{'p': LaunchConfiguration('x')}])",
            "1: parameter 'p': \"{'a': 1}\" is not a bool, a number, a text or a list of"
            " those; for a text, write ParameterValue(…, value_type=str)",
        ),
        (
            "Node(package='robot', executable='a', parameters={'p': 1})",
            "1: Node takes a list of parameters",
        ),
        (
            "ComposableNodeContainer(name='c')",
            "1: rosz does not load components, which are compiled; start nodes",
        ),
        ("*2 * [Node(package='robot', executable='a', name='n')]", None),
    ],
)
def test_errors_name_the_place(folder: Folder, entities: str, error: str | None) -> None:
    options = {"x": "{a: 1}"} if "'p'" in entities else {"x": "1"}
    text = folder.error(entities, environ={"PATH": "/bin"}, **options)
    if error is None:
        assert text.startswith("1: two nodes are named '/n'")
    else:
        assert text == error


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("import launch\nx = = 1\n", "x.launch.py:2:5: invalid syntax: x = = 1"),
        (
            "x = 1\n",
            "x.launch.py: expected generate_launch_description() to return a LaunchDescription",
        ),
        (
            "from launch.actions import Nothing\n",
            "x.launch.py:1: ImportError: cannot import name 'Nothing' from 'launch.actions',"
            " which rosz does not have",
        ),
        (
            "import launch.nothing\n",
            "x.launch.py:1: ModuleNotFoundError: No module named 'launch.nothing', which"
            " rosz does not have",
        ),
        (
            "import launch\nlaunch.actions.LogInf\n",
            "x.launch.py:2: AttributeError: module 'launch.actions' of rosz has no attribute"
            " 'LogInf'; did you mean 'LogInfo'?",
        ),
        ("raise SystemExit(3)\n", "x.launch.py:1: SystemExit: 3"),
    ],
)
def test_errors_of_whole_files(folder: Folder, text: str, error: str) -> None:
    folder.write("x.launch.py", text)
    with pytest.raises(LaunchFileError) as caught:
        folder.read("x.launch.py")
    assert str(caught.value) == error


def test_what_is_not_an_action(folder: Folder) -> None:
    with pytest.raises(LaunchFileError, match=r"x.launch.py: 'text' is not an action"):
        folder.plan("'text'")


def test_a_file_that_is_not_there(folder: Folder) -> None:
    with pytest.raises(
        LaunchFileError, match=r"no.py: the launch file cannot be read: No such file"
    ):
        folder.read("no.py")
