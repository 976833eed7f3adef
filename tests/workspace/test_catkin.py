"""Building C++ programs: by catkin where it is, else an error with what to install."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import pytest
from cli.command import rosz

from rosz.errors import NotFoundError
from rosz.workspace import build

_MANIFEST = """<package><name>abc_qa</name><version>0.1.0</version><description>d</description>
<maintainer email='a@b.org'>a</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend></package>
"""
_CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(abc_qa)
find_package(catkin REQUIRED COMPONENTS roscpp)
catkin_package()
include_directories(${catkin_INCLUDE_DIRS})
add_executable(abc_node src/abc_code.cpp)
target_link_libraries(abc_node ${catkin_LIBRARIES})
"""
_LAB = """cmake_minimum_required(VERSION 3.0.2)
project(lab)
find_package(catkin REQUIRED COMPONENTS roscpp std_msgs message_generation dynamic_reconfigure)
add_message_files(FILES Num.msg)
add_service_files(FILES Reset.srv)
generate_messages(DEPENDENCIES std_msgs)
generate_dynamic_reconfigure_options(cfg/parameters.cfg)
catkin_package(CATKIN_DEPENDS message_runtime)
include_directories(${catkin_INCLUDE_DIRS})
add_executable(reset_client src/client.cpp)
add_dependencies(reset_client ${catkin_EXPORTED_TARGETS} ${${PROJECT_NAME}_EXPORTED_TARGETS})
target_link_libraries(reset_client ${catkin_LIBRARIES})
"""
_SETTINGS = """#!/usr/bin/env python3
from dynamic_reconfigure.parameter_generator_catkin import *
gen = ParameterGenerator()
gen.add("rate", int_t, 0, "Rate", 5, 1, 20)
exit(gen.generate("lab", "lab", "parameters"))
"""
_CLIENT = """#include <iostream>
#include <lab/Num.h>
#include <lab/Reset.h>
#include <lab/parametersConfig.h>
int main() {
  lab::Num num;
  lab::Reset reset;
  num.num = reset.request.new_count = 8;
  std::cout << num.num << " " << lab::parametersConfig::__getDefault__().rate << std::endl;
}
"""
COMMANDS = Path(__file__).parents[2] / "rosz" / "cli" / "bin"


def test_without_catkin_there_is_the_line_to_type(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=r"(?s)rosz help cpp.*\nsudo apt install g\+\+ catkin"):
        build(tmp_path, (), {"PATH": str(tmp_path)})


@pytest.mark.system
def test_without_catkin_python_is_checked(tmp_path: Path) -> None:
    package = tmp_path / "src" / "abc_qa"
    package.mkdir(parents=True)
    (package / "package.xml").write_text(_MANIFEST)
    (package / "CMakeLists.txt").write_text(_CMAKE)
    done = rosz(tmp_path, "pkg", "check", "--setup", variables={"PATH": str(tmp_path)})
    assert done.returncode == 1
    assert done.stderr.startswith("ERROR: C++ programs are not built without catkin")
    assert "checked 1 package: 0 errors, 1 warning" in done.stdout
    assert (tmp_path / "devel" / "setup.bash").is_file()


@pytest.mark.system
@pytest.mark.skipif(not shutil.which("catkin_make", path="/usr/bin"), reason="no catkin")
def test_catkin_builds_what_the_course_prints(tmp_path: Path) -> None:
    """The broken program first, whose errors are the compiler's; then the mended one."""
    package = tmp_path / "src" / "abc_qa"
    (package / "src").mkdir(parents=True)
    (package / "package.xml").write_text(_MANIFEST)
    (package / "CMakeLists.txt").write_text(_CMAKE)
    code = package / "src" / "abc_code.cpp"
    code.write_text("int main() { ros::Publisher pub; }\n")
    environ = {**os.environ, "PATH": "/usr/bin:/bin"}
    assert build(tmp_path, (), environ) == 1
    shutil.copy(Path(__file__).parent.parent / "course" / "compiled" / "abc_code.cpp", code)
    assert build(tmp_path, (), environ) == 0
    assert os.access(tmp_path / "devel" / "lib" / "abc_qa" / "abc_node", os.X_OK)


@pytest.mark.system
@pytest.mark.skipif(not shutil.which("catkin_make", path="/usr/bin"), reason="no catkin")
def test_catkin_make_makes_headers_and_finds_programs(tmp_path: Path) -> None:
    """Headers of messages, services and settings; what is built is found, and no more named."""
    package = tmp_path / "src" / "cloned-lab"
    files = {
        "package.xml": _MANIFEST.replace("abc_qa", "lab").replace(
            "</package>", "<run_depend>message_runtime</run_depend></package>"
        ),
        "CMakeLists.txt": _LAB,
        "msg/Num.msg": "int64 num\n",
        "srv/Reset.srv": "int64 new_count\n---\nint64 old_count\n",
        "cfg/parameters.cfg": _SETTINGS,
        "src/client.cpp": _CLIENT,
    }
    for name, text in files.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(text)
    (package / "cfg" / "parameters.cfg").chmod(0o755)
    variables = {"PATH": f"{COMMANDS}:/usr/bin:/bin"}
    before = rosz(tmp_path, "pkg", "check", variables=variables)
    assert "only 'catkin_make' builds (rosz help cpp): reset_client" in before.stdout
    made = rosz(tmp_path, "pkg", "check", "--setup", variables=variables)
    assert made.returncode == 0, made.stdout + made.stderr
    assert "Built target reset_client" in made.stdout
    assert "only 'catkin_make' builds" not in made.stdout
    assert made.stdout.endswith("\nin a new shell: source devel/setup.bash\n")
    assert (tmp_path / "devel" / "setup.bash").read_text().count("rosz env bash") == 1
    packages = {**variables, "ROSZ_PACKAGE_PATH": str(tmp_path / "src")}
    assert rosz(tmp_path, "run", "lab", "reset_client", variables=packages).stdout == "8 5\n"
    (package / "src" / "client.cpp").write_text("int main() { return 0 }\n")
    broken = rosz(tmp_path, "pkg", "check", "--setup", variables=variables)
    assert broken.returncode == 1
    assert re.search(r"client\.cpp:1:\d+: error: expected", broken.stdout + broken.stderr)
    assert "in a new shell" not in broken.stdout
