"""``colcon`` of PyPI with rosz's plug-ins: what it installs, and that shells find it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from network import TIMEOUT, Network

import rosz.cli.env

from .conftest import Done, Ros2

MANIFEST = (
    '<package format="3"><name>{}</name><version>0.1.0</version><description>d</description>'
    '<maintainer email="me@example.org">me</maintainer><license>MIT</license>{}'
    "<export><build_type>{}</build_type></export></package>"
)
TALKER = """\
import rclpy
from iface.msg import Num

def main():
    rclpy.init()
    node = rclpy.create_node("talker")
    print(node.get_fully_qualified_name(), Num(num=3), flush=True)
    rclpy.shutdown()
"""
DATA = """\
        (f"share/{package_name}/config", ["config/params.yaml"]),
    ],
    install_requires"""
CMAKE = """\
cmake_minimum_required(VERSION 3.8)
project(iface)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces(${PROJECT_NAME} "msg/Num.msg")  # add_library(nothing)
install(DIRECTORY
  launch config/
  DESTINATION share/${PROJECT_NAME})
install(PROGRAMS scripts/hello.py DESTINATION lib/${PROJECT_NAME})
ament_python_install_package(${PROJECT_NAME}_py)
ament_package()
"""


class Colcon:
    """Runs ``colcon`` in a workspace."""

    def __init__(self, network: Network) -> None:
        self.ros2 = Ros2(network)
        self.folder = network.folder
        self.environ = {
            **network.variables(ROSZ_PYTHON=sys.executable),
            "ROS_HOME": str(network.folder / "home"),
            "COLCON_HOME": str(network.folder / "colcon"),
        }
        self.environ.pop("PYTHONWARNINGS", None)  # setuptools warns of what colcon writes
        (self.folder / "src").mkdir()

    def __call__(self, *words: str) -> Done:
        done = subprocess.run(
            [Path(rosz.cli.env.__file__).parent / "absent/colcon", *words],
            env=self.environ,
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=4 * TIMEOUT,
            check=False,
        )
        return Done(done.returncode, re.sub(r"\[\d+\.\d+s", "[Ts", done.stdout), done.stderr)

    def shell(self, shell: str, line: str) -> str:
        """Return what a line prints in a shell without any settings that has sourced the file."""
        keep = {"HOME", "ROS_HOME", "ROS_DOMAIN_ID", "ROSZ_RENDEZVOUS"}
        environ = {name: value for name, value in self.environ.items() if name in keep}
        done = subprocess.run(
            [shell, "-c", f". {self.folder}/install/setup.{shell}; {line}"],
            env={**environ, "PATH": "/usr/bin:/bin"},
            cwd="/",
            capture_output=True,
            text=True,
            timeout=4 * TIMEOUT,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout

    def write(self, name: str, text: str) -> Path:
        file = self.folder / "src" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file


@pytest.fixture
def colcon(network: Network) -> Colcon:
    return Colcon(network)


def interfaces(colcon: Colcon, name: str = "iface") -> None:
    colcon.write(f"{name}/package.xml", MANIFEST.format(name, "", "ament_cmake"))
    colcon.write(f"{name}/CMakeLists.txt", CMAKE)
    colcon.write(f"{name}/msg/Num.msg", "int64 num\n")
    colcon.write(f"{name}/launch/a.launch.py", "")
    colcon.write(f"{name}/config/b.yaml", "")
    script = colcon.write(f"{name}/scripts/hello.py", "#!/usr/bin/env python3\nprint('hello')\n")
    script.chmod(0o755)
    colcon.write(f"{name}/{name}_py/__init__.py", "word = 'said'\n")


def course(colcon: Colcon) -> Path:
    """Create the packages of a course, and return the folder of the one in Python."""
    interfaces(colcon)
    words = "pkg create --build-type ament_python --node-name talker --license MIT my_pkg"
    assert colcon.ros2(*words.split(), "--destination-directory", "src").code == 0
    package = colcon.folder / "src" / "my_pkg"
    setup = package / "setup.py"
    setup.write_text(setup.read_text().replace("    ],\n    install_requires", DATA))
    manifest = package / "package.xml"
    manifest.write_text(manifest.read_text().replace("<export>", "<depend>iface</depend><export>"))
    (package / "my_pkg" / "talker.py").write_text(TALKER)
    colcon.write("my_pkg/config/params.yaml", "")
    return package


def test_a_workspace_of_a_course_as_it_is_typed(colcon: Colcon) -> None:
    package = course(colcon)
    built = colcon("build", "--symlink-install", "--cmake-args", "-DCMAKE_BUILD_TYPE=Release")
    assert built.code == 0
    assert built.out.splitlines()[:4] == [
        "Starting >>> iface",
        "Finished <<< iface [Ts]",
        "Starting >>> my_pkg",
        "Finished <<< my_pkg [Ts]",
    ]
    # Links follow the sources.
    talker = package / "my_pkg" / "talker.py"
    assert colcon.shell("bash", "ros2 run my_pkg talker") == "/talker num: 3\n"
    talker.write_text("def main():\n    print('changed')\n")
    prefix = colcon.folder / "install" / "my_pkg"
    line = f"ros2 pkg prefix my_pkg; ros2 pkg executables my_pkg; {prefix}/lib/my_pkg/talker"
    shells = [shell for shell in ("bash", "zsh") if shutil.which(shell)]
    for shell in shells:
        assert colcon.shell(shell, line) == f"{prefix}\nmy_pkg talker\nchanged\n"
    assert colcon.shell("bash", "ros2 interface show iface/msg/Num") == "int64 num\n"
    complete = "ROSZ_COMPLETION_TIMEOUT=60 $ROSZ_PYTHON -m rosz complete bash"
    assert colcon.shell("bash", f"{complete} 'ros2 run my_p'") == "my_pkg\n"


def test_what_cmake_installs_without_a_compiler(colcon: Colcon) -> None:
    interfaces(colcon)
    assert colcon("build", "--merge-install").code == 0
    share = colcon.folder / "install/share/iface"
    assert {"package.xml", "msg", "launch", "b.yaml"} <= {path.name for path in share.iterdir()}
    line = f"{sys.executable} -c 'import iface_py; print(iface_py.word)'"
    assert colcon.shell("bash", f"ros2 run iface hello.py; {line}") == "hello\nsaid\n"


def test_cpp_and_wrong_definitions_fail(colcon: Colcon) -> None:
    interfaces(colcon, "broken")
    colcon.write("broken/msg/Num.msg", "int63 num\n")
    interfaces(colcon, "lacking")
    (colcon.folder / "src/lacking/scripts/hello.py").unlink()
    interfaces(colcon, "outside")
    colcon.write("outside/CMakeLists.txt", "install(FILES package.xml DESTINATION share/../../x)")
    words = "pkg create --build-type ament_cmake --node-name mover cpp"
    assert colcon.ros2(*words.split(), "--destination-directory", "src").code == 0
    done = colcon("build", "--continue-on-error")
    assert done.code == 1
    assert "msg/Num.msg:1:1: " in done.err
    assert "hello.py' is to be installed, and does not exist" in done.err
    assert "'package.xml' is to be installed outside of the prefix: 'share/../../x'" in done.err
    assert "its C++ (mover) is not compiled" in done.err
    assert "--packages-skip cpp" in done.err
    assert "4 packages failed: broken cpp lacking outside\n" in done.out
    skipped = colcon("build", "--packages-skip", "cpp", "broken", "lacking", "outside")
    assert (skipped.code, skipped.out) == (0, "\nSummary: 0 packages finished [Ts]\n")


def test_a_real_ros_2_builds_its_packages_itself(colcon: Colcon) -> None:
    interfaces(colcon)
    share = colcon.folder / "ros/share"
    (share / "ament_cmake").mkdir(parents=True)
    colcon.environ["AMENT_PREFIX_PATH"] = str(share.parent)
    assert colcon("list").out == "iface\tsrc/iface\t(ros.ament_cmake)\n"
    del colcon.environ["AMENT_PREFIX_PATH"]
    assert colcon("list").out == "iface\tsrc/iface\t(ros.rosz)\n"


def test_tests_run_and_their_results_are_counted(colcon: Colcon) -> None:
    package = course(colcon)
    tests = (
        "import rclpy\nfrom iface.msg import Num\n\ndef test_num(): assert Num(num=1).num == {}\n"
    )
    file = package / "test" / "test_it.py"
    file.write_text(tests.format(2))
    assert colcon("build").code == 0
    done = colcon("test")
    assert "Finished <<< iface [Ts]\n" in done.out
    assert "  1 package had test failures: my_pkg\n" in done.out
    counted = colcon("test-result")
    assert counted.code == 1
    assert "1 failure" in counted.out
    file.write_text(tests.format(1))
    assert colcon("test", "--packages-select", "my_pkg").code == 0
    assert colcon("test-result").code == 0
