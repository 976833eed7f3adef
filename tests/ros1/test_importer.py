"""The importer of ROS 1's names; each test runs in its own process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

from rosz.idl.generate import write
from rosz.packages import PackageIndex
from rosz.typestore import TypeStore

TOP = Path(__file__).parents[2]


def package(root: Path, name: str, files: dict[str, str]) -> Path:
    folder = root / name
    for file, text in files.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    return folder


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    root = tmp_path / "ws" / "src"
    package(
        root, "gripper", {"msg/Grip.msg": "Header header\nparts/Part part\n", "srv/Do.srv": "---"}
    )
    package(
        root,
        "parts",
        {
            "msg/Part.msg": "uint8 BOLT=1\nuint8 kind\n",
            "src/parts/__init__.py": "WHO = 'the code of the package'\n",
            "src/parts/helper.py": (
                "from parts.msg import Part\n\n\ndef bolt():\n    return Part(Part.BOLT)\n"
            ),
        },
    )
    package(root, "plain", {"scripts/x.py": ""})
    return root


def run(code: str, tmp_path: Path, workspace: Path | None = None, **env: str) -> str:
    """Run a program in a process; return what it prints."""
    done = subprocess.run(
        [sys.executable, "-c", dedent(code)],
        cwd=tmp_path,
        env={
            "PATH": os.environ["PATH"],
            "HOME": str(tmp_path),
            "PYTHONPATH": str(TOP),
            "ROS_PACKAGE_PATH": str(workspace or ""),
            **env,
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_shipped_packages(tmp_path: Path) -> None:
    code = """
        import rosz.ros1
        import std_msgs.msg
        import geometry_msgs.msg as geometry
        from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse
        from sensor_msgs.msg import *
        from std_msgs.msg._String import String
        from rospy_tutorials.srv._AddTwoInts import AddTwoIntsRequest
        import rosz.msgs.std_msgs.msg
        assert std_msgs.msg is rosz.msgs.std_msgs.msg
        assert String is std_msgs.msg.String is rosz.msgs.std_msgs.msg.String
        assert geometry.Twist().linear.x == 0
        assert SetBool.Request is SetBoolRequest
        assert Image and LaserScan and AddTwoIntsRequest(1, 2)
        import sys
        assert not [name for name in sys.modules if name.startswith(("yaml", "zenoh", "rosz.node"))]
        for absent in ("std_msgs.srv", "std_msgs.msg._Strin", "std_msgs.nothing", "std_srvs.msg"):
            try:
                __import__(absent)
            except ModuleNotFoundError as error:
                print(error.name)
    """
    assert run(code, tmp_path).split() == [
        "std_msgs.srv",
        "std_msgs.msg._Strin",
        "std_msgs.nothing",
        "std_srvs.msg",
    ]


@pytest.mark.parametrize(("client", "expected"), [("rospy", "0.0 0"), ("rclpy", "1.0 -2")])
def test_defaults_are_those_of_the_ros_that_a_program_uses(
    client: str, expected: str, tmp_path: Path
) -> None:
    code = f"""
        import rosz.ros1
        from nav_msgs.msg import Odometry
        import {client}
        from sensor_msgs.msg import NavSatFix
        print(Odometry().pose.pose.orientation.w, NavSatFix().status.status)
    """
    assert run(code, tmp_path).strip() == expected


def test_all_names_of_a_package(tmp_path: Path, workspace: Path) -> None:
    code = """
        import rosz.ros1
        def names(module):
            bound = {}
            exec(f"from {module} import *", bound)
            return [name for name in sorted(bound) if not name.startswith("_")]
        print(*names("std_srvs.srv"))
        print(*names("sensor_msgs.srv"))
        print(*[name for name in names("trajectory_msgs.msg") if name.islower()])
        print(*names("gripper.srv"))
        from nav_msgs.msg import *
        assert geometry_msgs.msg.Point().x == 0.0
        assert genpy.Time(1.5).nsecs == 500000000
        assert sys.argv and struct.calcsize("<d") == 8
        """
    ours = "codecs genpy"
    assert run(code, tmp_path, ROSZ_PACKAGE_PATH=str(workspace)).splitlines() == [
        "Empty EmptyRequest EmptyResponse SetBool SetBoolRequest SetBoolResponse"
        f" Trigger TriggerRequest TriggerResponse {ours} python3 struct sys",
        "SetCameraInfo SetCameraInfoRequest SetCameraInfoResponse"
        f" {ours} python3 sensor_msgs std_msgs struct sys",
        f"{ours} geometry_msgs python3 std_msgs struct sys trajectory_msgs",
        f"Do DoRequest DoResponse {ours} python3 struct sys",
    ]


def test_all_names_of_a_module_are_its_own(tmp_path: Path) -> None:
    code = """
        from rosz.ros1.importer import install
        install()
        before = {*globals()}
        from rosnode import *
        bound = {*globals()} - before - {"before"}
        assert {"ID", "ROSNodeException", "get_node_names", "rosnodemain"} <= bound, bound
        assert not bound & {"Node", "Sequence", "Survey", "annotations", "sys", "threading"}, bound
        """
    assert run(code, tmp_path) == ""


def test_modules_by_all_their_names(tmp_path: Path) -> None:
    code = """
        from importlib import import_module
        from rosz.ros1.importer import install
        from rosz.ros1.modules import MODULES
        install()
        for name, module in MODULES.items():
            home = f"rosz.{module.home}" if module.home else name
            assert import_module(name) is import_module(home), name
            assert module.home or import_module(name).__name__ == name
        import roslib, rospkg.common
        assert roslib.message.Message is import_module("rosz.ros1.client.genpy").Message
        assert rospkg.rospack.RosPack is roslib.rospack.RosPack is rospkg.RosPack
        import tf.transformations, tf_transformations
        from tf_transformations import quaternion_from_euler
        assert tf_transformations is tf.transformations
        assert tf_transformations.__spec__.name == "rosz.ros1.client.tf.transformations"
        import tf2_msgs.msg, tf.msg
        from tf.msg import *
        assert tfMessage is tf.msg.tfMessage is tf2_msgs.msg.TFMessage
        """
    assert run(code, tmp_path) == ""


def test_packages_on_the_path(tmp_path: Path, workspace: Path) -> None:
    code = """
        import rosz.ros1
        from gripper.msg import Grip
        from gripper.srv import Do, DoRequest
        import gripper.msg._Grip
        from parts.msg import Part
        from std_msgs.msg import Header
        import parts.helper, pickle, sys
        grip = Grip(Header(frame_id="hand"), parts.helper.bolt())
        assert Grip.from_cdr(grip.to_cdr()) == grip
        assert gripper.msg._Grip.Grip is Grip
        assert type(grip.part) is Part and isinstance(grip.header, Header)
        assert parts.WHO == "the code of the package"
        data = pickle.dumps(grip)
        for name in [name for name in sys.modules if "gripper" in name or "parts" in name]:
            del sys.modules[name]
        again = pickle.loads(data)
        assert again.part.kind == 1 and type(again).__module__ == "rosz.msgs.gripper.msg"
        print(type(again).__name__)
    """
    assert run(code, tmp_path, workspace) == "Grip\n"
    kept = {file.name.rpartition("_")[0] for file in (tmp_path / ".ros" / "rosz").glob("*.py")}
    assert kept == {"gripper_msg", "gripper_srv", "parts_msg"}
    assert run(code, tmp_path, workspace) == "Grip\n"


def test_a_read_only_home(tmp_path: Path, workspace: Path) -> None:
    code = """
        import rosz.ros1
        from gripper.msg import Grip
        print(len(Grip().to_cdr()))
    """
    assert run(code, tmp_path, workspace, ROS_HOME="/proc/nothing") == "18\n"


def test_errors_in_definitions_have_a_place(tmp_path: Path, workspace: Path) -> None:
    (workspace / "parts" / "msg" / "Bad.msg").write_text("int32 x\nint32\n")
    code = """
        import rosz.ros1
        from rosz.errors import DefinitionError
        from gripper.msg import Grip
        print(Grip().part)
        try:
            from parts.msg import Bad
        except DefinitionError as error:
            print(error)
    """
    file = workspace / "parts" / "msg" / "Bad.msg"
    expected = f"kind: 0\n{file}:2:6: expected a name after type 'int32'\n"
    assert run(code, tmp_path, workspace) == expected


def test_types_of_a_shipped_package_need_no_import_of_their_own(tmp_path: Path) -> None:
    code = """
        import rosz.ros1
        import std_msgs, geometry_msgs, std_srvs
        print(std_msgs.msg.String("x").data, geometry_msgs.msg.Twist().linear.x)
        print(std_srvs.srv.Empty._type)
        try:
            std_msgs.srv
        except AttributeError as error:
            print(error)
    """
    printed = run(code, tmp_path).splitlines()
    missing = "module 'std_msgs' of rosz has no attribute 'srv'"
    assert printed == ["x 0.0", "std_srvs/Empty", missing]


def test_other_imports_are_unchanged(tmp_path: Path, workspace: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "__init__.py").write_text("WHO = 'another one'\n")
    (tmp_path / "mail").mkdir()
    (tmp_path / "mail" / "__init__.py").write_text("")
    (tmp_path / "mail" / "msg.py").write_text("SUBJECT = 'hello'\n")
    code = """
        import rosz.ros1, sys
        import json, email, xml.dom
        import mail.msg
        assert mail.msg.SUBJECT == "hello"
        import parts
        assert parts.WHO == "another one"
        from parts.msg import Part
        assert Part.BOLT == 1
        for absent in ("plain", "plain.msg", "gripper.nothing", "no_such_package", "gripper.msg.x"):
            try:
                __import__(absent)
            except ModuleNotFoundError as error:
                print(error.name)
    """
    printed = run(code, tmp_path, workspace).split()
    assert printed == ["plain", "plain", "gripper.nothing", "no_such_package", "gripper.msg.x"]


def test_a_broken_package_elsewhere_does_not_break_imports(tmp_path: Path, workspace: Path) -> None:
    (workspace / "broken").mkdir()
    (workspace / "broken" / "package.xml").write_text("<package><name>")
    code = """
        import rosz.ros1
        try:
            import no_such_package
        except ModuleNotFoundError as error:
            print(error)
        from std_msgs.msg import String
        try:
            from std_msgs.msg import Nothing
        except ImportError as error:
            print(error.msg.partition(" (")[0])
    """
    assert run(code, tmp_path, workspace).splitlines() == [
        "No module named 'no_such_package'",
        "cannot import name 'Nothing' from 'rosz.msgs.std_msgs.msg'",
    ]


def test_generated_modules_are_preferred(tmp_path: Path, workspace: Path) -> None:
    store = TypeStore(PackageIndex([workspace]))
    for name, files in store.sources(["gripper"]).items():
        write(files, tmp_path / "out" / name)
    code = """
        import rosz.ros1
        from gripper.msg import Grip
        import parts.msg
        print(Grip.__module__, parts.msg.Part.__module__, len(Grip().to_cdr()))
    """
    path = os.pathsep.join([str(TOP), str(tmp_path / "out")])
    assert run(code, tmp_path, workspace, PYTHONPATH=path) == "gripper.msg parts.msg 18\n"
    assert not (tmp_path / ".ros").exists()


def test_a_package_of_a_shipped_name_may_add_types(tmp_path: Path, workspace: Path) -> None:
    package(workspace, "std_msgs", {"msg/Mine.msg": "String text", "srv/Do.srv": "---"})
    code = """
        import rosz.ros1
        from std_msgs.msg import String, Mine
        from std_msgs.srv import Do
        assert Mine(String("x")).text.data == "x"
        try:
            from std_msgs.msg import Yours
        except ImportError as error:
            print(error.name)
    """
    assert run(code, tmp_path, workspace) == "rosz.msgs.std_msgs.msg\n"


def test_a_package_of_the_user_hides_a_shipped_one(tmp_path: Path, workspace: Path) -> None:
    """But not one that reaches the network."""
    for name in ("rosapi", "smach", "actionlib"):
        code = {f"src/{name}/__init__.py": "MINE = True\n", f"src/{name}/own.py": "DEEP = True\n"}
        package(workspace, name, code)
    assert (
        run(
            """
            import rosz.ros1; rosz.ros1.install()
            import actionlib, rosapi, rosapi.own, smach
            from rosapi.srv import Topics
            from smach.own import DEEP
            print(rosapi.MINE, rosapi.own.DEEP, Topics._type, smach.MINE, DEEP)
            print(actionlib.SimpleActionClient.__module__)
            """,
            tmp_path,
            workspace,
        )
        == "True True rosapi/Topics True True\nrosz.ros1.client.actionlib.action_client\n"
    )


def test_install_twice_and_uninstall(tmp_path: Path, workspace: Path) -> None:
    code = """
        import sys
        from rosz.ros1.importer import install, type_store, uninstall
        finders = list(sys.meta_path)
        install()
        install()
        assert sys.meta_path == finders
        assert type_store() is type_store()
        assert type_store().message("gripper/Grip").__name__ == "Grip"
        uninstall()
        assert len(sys.meta_path) == len(finders) - 2
        try:
            import std_msgs
        except ModuleNotFoundError:
            print("gone")
        install()
        import std_msgs
    """
    assert run(code, tmp_path, workspace) == "gone\n"


def test_threads_import_concurrently(tmp_path: Path, workspace: Path) -> None:
    code = """
        import rosz.ros1
        from concurrent.futures import ThreadPoolExecutor
        from importlib import import_module
        names = ["gripper.msg", "parts.msg", "gripper.srv", "std_msgs.msg", "nav_msgs.srv"] * 8
        with ThreadPoolExecutor(8) as pool:
            modules = list(pool.map(import_module, names))
        assert len(set(map(id, modules))) == 5
        from gripper.msg import Grip
        from parts.msg import Part
        assert type(Grip().part) is Part
        print("fine")
    """
    assert run(code, tmp_path, workspace) == "fine\n"


def test_actions(tmp_path: Path) -> None:
    """A package's own module wins over that of its actions, which catkin does not make."""
    for name in ("plain", "own"):
        package = tmp_path / "src" / name
        (package / "action").mkdir(parents=True)
        (package / "action" / "Do.action").write_text("int32 a\n---\n---\n")
        (package / "package.xml").write_text(f"<package><name>{name}</name></package>")
        (package / "setup.py").write_text(
            "from distutils.core import setup\n"
            f"setup(name='{name}', packages=['{name}'], package_dir={{'': 'src'}})\n"
        )
        (package / "src" / name).mkdir(parents=True)
        (package / "src" / name / "__init__.py").write_text("")
    (tmp_path / "src" / "own" / "src" / "own" / "action.py").write_text("Mine = 1\n")
    code = """
        from rosz.ros1.importer import install
        install()
        from example_interfaces.action import Fibonacci
        from plain.action import Do
        from plain.msg import DoGoal
        from own.action import Mine
        from own.msg import DoAction
        import rclpy.action.server
        import rosz.msgs.example_interfaces.action
        assert Fibonacci is rosz.msgs.example_interfaces.action.Fibonacci
        assert Do.Goal(a=1).a == DoGoal(a=1).a
    """
    run(code, tmp_path, tmp_path / "src")
