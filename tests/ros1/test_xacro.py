"""xacro as launch files, shells and programs of ROS 1 name it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from network import Network

ROBOT = """\
<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="$(find arm)/urdf/wheel.xacro"/>
  <xacro:arg name="side" default="left"/>
  <xacro:property name="radius" value="0.25"/>
  <xacro:wheel name="$(arg side)" r="${radius * 2}"/>
</robot>
"""
WHEEL = """\
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="wheel" params="name r">
    <link name="${name}_wheel"><sphere radius="${r}"/></link>
  </xacro:macro>
</robot>
"""


@pytest.fixture
def arm(network: Network) -> Path:
    """A package with xacro files."""
    folder = network.folder / "src" / "arm"
    (folder / "urdf").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>arm</name></package>")
    (folder / "urdf" / "arm.urdf.xacro").write_text(ROBOT)
    (folder / "urdf" / "wheel.xacro").write_text(WHEEL)
    return folder


def run(network: Network, *words: str) -> subprocess.CompletedProcess[str]:
    # Another interpreter stands first on the PATH, as where rosz's venv is not activated.
    variables = network.variables(PATH="/usr/bin:/bin", ROSZ_PACKAGE_PATH=f"{network.folder}/src")
    del variables["PYTHONWARNINGS"]
    return subprocess.run(
        [sys.executable, "-P", *words],
        env=variables,
        cwd=network.folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.mark.parametrize("program", ["xacro", "xacro.py", "xacro --inorder"])
def test_launch_files_run_it(network: Network, arm: Path, program: str) -> None:
    file = arm / "a.launch"
    command = f"$(find xacro)/{program} '$(find arm)/urdf/arm.urdf.xacro' side:=right"
    file.write_text(f'<launch><param name="robot_description" command="{command}"/></launch>')
    done = run(network, "-m", "rosz", "launch", "--dump-params", str(file))
    assert done.returncode == 0, done.stderr
    robot = yaml.safe_load(done.stdout)["/robot_description"]
    assert '<link name="right_wheel">' in robot
    assert '<sphere radius="0.5"/>' in robot


def test_shells_and_programs_use_it(network: Network, arm: Path) -> None:
    source = str(arm / "urdf" / "arm.urdf.xacro")
    done = run(network, "-m", "rosz", "run", "xacro", "xacro", source)
    assert '<link name="left_wheel">' in done.stdout, done.stderr
    script = "import rosz.ros1, xacro; print(xacro.process_file({!r}).toxml())"
    assert run(network, "-c", script.format(source)).stdout.count("left_wheel") == 1


def test_a_package_that_is_not_there(network: Network, arm: Path) -> None:
    (arm / "urdf" / "arm.urdf.xacro").write_text(ROBOT.replace("find arm", "find nope"))
    done = run(network, "-m", "rosz", "run", "xacro", "xacro", str(arm / "urdf/arm.urdf.xacro"))
    assert (done.returncode, done.stdout) == (2, "")
    assert "package 'nope' not found" in done.stderr


def test_where_it_is_not_installed(network: Network) -> None:
    script = "import sys; sys.modules['xacro'] = None; import rosz.ros1.tools.xacro as x; x.main()"
    done = run(network, "-c", script)
    assert done.stderr == "xacro: it is not installed here; run: pip install 'rosz[xacro]'\n"
    assert done.returncode == 1


@pytest.mark.parametrize(
    ("expression", "reason"),
    [
        ("9**9**9", "stopped after 2 s of processor time: an expression or a macro computes too"),
        ("len([0] * 10**9)", "when evaluating expression 'len([0] * 10**9)'"),
    ],
)
def test_expressions_that_take_too_much(
    network: Network, arm: Path, expression: str, reason: str
) -> None:
    bomb = arm / "urdf" / "bomb.xacro"
    bomb.write_text(ROBOT.replace("radius * 2", expression))
    script = "import rosz.ros1.tools.xacro as program; program._SECONDS = 2; program.main()"
    done = run(network, "-c", script, str(bomb))
    assert done.returncode != 0
    assert reason in done.stderr
    assert done.stdout == ""
