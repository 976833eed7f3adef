"""Building C++ programs: by catkin where it is, else an error with what to install."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

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


def test_without_catkin_there_is_the_line_to_type(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=r"(?s)rosz help cpp.*\nsudo apt install g\+\+ catkin"):
        build(tmp_path, (), {"PATH": str(tmp_path)})


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
