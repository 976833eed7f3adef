"""Each fault of a package is named where it is, and nothing is wrong with a new one."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosz.environment import Environment
from rosz.errors import NotFoundError, UsageError
from rosz.packages import PackageIndex
from rosz.workspace import check, create, find_packages, write_setup

ROOT = str(Path(__file__).parents[2])


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A workspace with one package as it is made."""
    (tmp_path / "src").mkdir()
    create(tmp_path / "src", "demo", ["std_msgs"], maintainer="Me", license_name="MIT")
    return tmp_path


def problems(workspace: Path, *words: str) -> list[str]:
    """Return what is wrong, as lines with places below the first package."""
    environment = Environment.read({"HOME": str(workspace)}, workspace)
    folders = find_packages(words, workspace, PackageIndex(environment.package_roots))
    environ = {"HOME": str(workspace), "PATH": "/usr/bin:/bin", "PYTHONPATH": ROOT}
    return [
        f"{one.place.removeprefix(f'{workspace}/src/')}: {one.level}: {one.text}"
        for each in check(folders, environment, environ)
        for one in each.problems
    ]


def put(workspace: Path, name: str, text: str, *, executable: bool = False) -> None:
    file = workspace / "src" / "demo" / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    if executable:
        file.chmod(0o755)


def test_a_new_package_is_well(workspace: Path) -> None:
    assert problems(workspace) == []


MANIFEST = (
    '<package format="2"><name>demo</name><version>1.0.0</version><description>d</description>'
    '<maintainer email="a@b">m</maintainer><license>MIT</license>{}</package>'
)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("<package>\n<name>demo</nam></package>", "2:13: error: not well-formed XML"),
        ("<pack/>", "1:1: error: expected <package>, got <pack>"),
        ("<package/>", "1:1: error: <name> is missing"),
        ("<package><name>demo</name></package>", "1:1: warning: <license> is missing"),
        (MANIFEST.replace("1.0.0", "1"), "warning: version is '1'; expected three numbers"),
        (MANIFEST.replace("a@b", "a"), "warning: <maintainer> has no email"),
        (MANIFEST.replace("MIT", " "), "error: <license> is empty"),
        (MANIFEST.replace("demo", "Demo"), "warning: 'Demo' is not a good name"),
        (MANIFEST.replace("demo", "other"), "warning: the package is called 'other', its folder"),
        (MANIFEST.replace('"2"', '"9"'), "1:1: error: format is '9'; expected one of 1, 2, 3"),
        (MANIFEST.format("<name>demo</name>"), "error: <name> is there 2 times"),
        (MANIFEST.format("<run_depend>x</run_depend>"), "<run_depend> does not exist in format 2"),
        (
            MANIFEST.replace(' format="2"', "").format("<depend>x</depend>"),
            'warning: <depend> does not exist in format 1: write <package format="2">',
        ),
    ],
)
def test_manifests(workspace: Path, text: str, expected: str) -> None:
    put(workspace, "package.xml", text.replace("{}", ""))
    found = problems(workspace)
    assert any(line.startswith("demo/package.xml:") and expected in line for line in found), found


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("msg/A.msg", "int8 a\nint3 x\n", "demo/msg/A.msg:2:1: error: type 'int3' of field 'x'"),
        (
            "srv/A.srv",
            "---\nfloat64[ y\n",
            "demo/srv/A.srv:2:9: error: type 'float64[' of 'y': expected a number",
        ),
        ("action/A.action", "int8 a\n", "demo/action/A.action:"),
        (
            "action/A.action",
            "---\n---\nfoo/Bar x\n",
            "demo/action/A.action:3:1: error: type 'foo/Bar' of field 'x'",
        ),
        ("launch/a.launch", "<launch>\n<nod", "demo/launch/a.launch:2:1: error: not well-formed"),
        (
            "launch/a.launch",
            '<launch><include file="$(find nowhere)/a.launch"/></launch>',
            "demo/launch/a.launch:1:24: warning: package 'nowhere' not found",
        ),
        (
            "launch/a.launch",
            '<launch><include file="$(find dem)/a.launch"/></launch>',
            "demo/launch/a.launch:1:24: error: package 'dem' not found",
        ),
        (
            "launch/a.launch",
            '<launch><node pkg="demo" type="nope.py" name="n"/></launch>',
            "demo/launch/a.launch:1:9: error: node 'n': package 'demo'",
        ),
        (
            "launch/a.launch",
            '<launch><node pkg="rviz2" type="rviz2" name="n"/></launch>',
            "demo/launch/a.launch:1:9: warning: node 'n': package 'rviz2' not found",
        ),
        (
            "scripts/a.py",
            "#!/usr/bin/env python3\n",
            "demo/scripts/a.py: error: not executable; run: chmod +x ",
        ),
        (
            "scripts/a.py!",
            '#!/usr/bin/env python3\nprint "x"\n',
            "demo/scripts/a.py:2:1: error: this is Python 2 (print without parentheses)",
        ),
        ("scripts/a.py!", "#!/bin/sh\nx = (\n", "demo/scripts/a.py:2:5: error: not valid Python"),
        ("scripts/a.py!", "x = 1\n", "demo/scripts/a.py:1:1: warning: its first line names no"),
        ("scripts/a!", "x = 1\n", "demo/scripts/a:1:1: error: executable, but neither"),
        ("scripts/a!", "#!/nowhere/sh\n", "demo/scripts/a:1:1: error: its interpreter '/nowhere/s"),
        ("scripts/a!", "#!\n", "demo/scripts/a:1:1: error: '#!' names no interpreter"),
        (
            "scripts/a.py!",
            "#!/usr/bin/env -S A=1 python9\n",
            "demo/scripts/a.py:1:1: warning: 'python9' is not on this machine",
        ),
        (
            "scripts/a.py!",
            "#!/usr/bin/env python3\r\nx = 1\r\n",
            "demo/scripts/a.py:1: warning: lines end as on Windows",
        ),
        ("src/lib.py", "x = \0\n", "demo/src/lib.py: error: not valid Python"),
        (
            "CMakeLists.txt",
            "project(demo)\nadd_executable(talker src/talker.cpp)\n",
            "demo/CMakeLists.txt:2: warning: C++ programs, which only 'catkin_make' builds (rosz"
            " help cpp): talker",
        ),
        ("cfg/A.cfg!", "ParameterGenerator(\n", "demo/cfg/A.cfg:1:19: error: not valid Python"),
    ],
)
def test_faults(workspace: Path, name: str, text: str, expected: str) -> None:
    put(workspace, name.removesuffix("!"), text, executable=name.endswith("!"))
    (line,) = [line for line in problems(workspace) if "A.cfg: warning" not in line]
    assert line.startswith(expected)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "launch/a.launch",
            '<launch><arg name="x"/><node pkg="$(arg x)" type="x" name="n"/></launch>',
        ),
        ("launch/a.launch", '<launch><param name="a" command="touch {}/ran"/></launch>'),
        ("src/demo/lib.py", "#!/usr/bin/env python3\n"),
        ("config/a.cfg", "[some]\nother = format\n"),
        ("msg/.Hidden.py", "x = ("),
    ],
)
def test_what_is_well(workspace: Path, name: str, text: str) -> None:
    put(workspace, name, text.replace("{}", str(workspace)))
    (workspace / "src/demo/config").mkdir(exist_ok=True)
    assert problems(workspace) == []
    assert not (workspace / "ran").exists()


def test_a_cfg_is_run(workspace: Path) -> None:
    pytest.importorskip("rosz.ros1.client.dynamic_reconfigure")
    head = (
        "#!/usr/bin/env python3\n"
        "from dynamic_reconfigure.parameter_generator_catkin import *\n"
        "gen = ParameterGenerator()\n"
    )
    tail = 'exit(gen.generate("demo", "demo", "Demo"))\n'
    put(workspace, "cfg/Demo.cfg", f'{head}gen.add("a", int_t, 0, "x", 1)\n{tail}', executable=True)
    assert problems(workspace) == []
    put(workspace, "cfg/Demo.cfg", f"{head}gen.add(nope)\n{tail}", executable=True)
    (line,) = problems(workspace)
    assert line.startswith("demo/cfg/Demo.cfg:4: error: NameError: name 'nope' is not defined")


def test_a_broken_package_keeps_no_other_from_being_checked(workspace: Path) -> None:
    create(workspace / "src", "good", ["demo"])
    put(workspace, "package.xml", "<package>")
    assert [line.split(":")[0] for line in problems(workspace)] == ["demo/package.xml"]
    assert problems(workspace, "src/good") == []


def test_two_packages_of_one_name(workspace: Path) -> None:
    folder = create(workspace / "src", "twin")[0].parent
    text = (folder / "package.xml").read_text().replace("<name>twin", "<name>demo")
    (folder / "package.xml").write_text(text)
    found = [
        line for line in problems(workspace) if "another package is also called 'demo'" in line
    ]
    assert len(found) == 2


def test_what_is_meant(workspace: Path) -> None:
    other = create(workspace / "src", "other")[0].parent
    demo = workspace / "src" / "demo"
    index = PackageIndex([workspace / "src"])
    assert find_packages([], workspace, index) == [demo, other]
    assert find_packages([], demo / "msg", index) == [demo, other]
    assert find_packages([str(workspace)], Path("/"), index) == [demo, other]
    assert find_packages(["src/other", "demo"], workspace, index) == [demo, other]
    with pytest.raises(NotFoundError, match="package 'dmo' not found"):
        find_packages(["dmo"], workspace, index)


def test_no_package_at_all(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="no package in the workspace around"):
        find_packages([], tmp_path, PackageIndex([]))


def test_files_of_catkin_stay(workspace: Path) -> None:
    (written,) = write_setup(workspace, {"bash": "true\n"})
    assert write_setup(workspace, {"bash": "true\n"}) == [written]
    written.write_text("# catkin's\n")
    with pytest.raises(UsageError, match="was written by catkin and is kept"):
        write_setup(workspace, {"bash": "true\n"})
    assert written.read_text() == "# catkin's\n"


def test_a_command_that_mends_is_told_once(workspace: Path) -> None:
    node = '<node pkg="demo" type="a.py" name="{}"/>'
    put(workspace, "scripts/a.py", "#!/usr/bin/env python3\n")
    put(workspace, "launch/a.launch", f"<launch>{node.format('x')}{node.format('y')}</launch>")
    put(workspace, "launch/b.launch", f"<launch>{node.format('z')}</launch>")
    script = workspace / "src/demo/scripts/a.py"
    assert problems(workspace) == [
        f"demo/scripts/a.py: error: not executable; run: chmod +x {script}"
    ]


def test_an_error_in_an_included_file_is_told_once(workspace: Path) -> None:
    include = '<launch><include file="$(find demo)/launch/wrong.launch"/></launch>'
    put(workspace, "launch/wrong.launch", "<launch><node/></launch>")
    put(workspace, "launch/a.launch", include)
    put(workspace, "launch/b.launch", include)
    (line,) = problems(workspace)
    assert line.startswith("demo/launch/wrong.launch:1:9: error: ")
    assert "included from" not in line


def test_compiled_programs_of_nodes_are_named_as_such(workspace: Path) -> None:
    node = '<node pkg="demo" type="talker" name="{}"/>'
    put(workspace, "CMakeLists.txt", "add_executable(talker a.cpp)\nadd_executable(b b.cpp)\n")
    put(workspace, "launch/a.launch", f"<launch>{node.format('x')}{node.format('y')}</launch>")
    text = "'talker' of package 'demo' is C++, and is not built"
    assert problems(workspace) == [
        "demo/CMakeLists.txt:1: warning: C++ programs, which only 'catkin_make' builds (rosz"
        " help cpp): talker, b",
        f"demo/launch/a.launch:1:9: error: {text}",
        f"demo/launch/a.launch:1:50: error: {text}",
    ]


def test_a_misspelt_package_has_one_text(workspace: Path) -> None:
    node = '<node pkg="demoo" type="talker" name="{}"/>'
    put(workspace, "launch/a.launch", f"<launch>{node.format('x')}\n{node.format('y')}</launch>")
    text = "warning: package 'demoo' not found; did you mean 'demo'?"
    assert problems(workspace) == [
        f"demo/launch/a.launch:1:9: {text}",
        f"demo/launch/a.launch:2:1: {text}",
    ]


def test_a_misspelt_type_gets_one_hint(workspace: Path) -> None:
    put(workspace, "msg/Strings.msg", "string[] data\n")
    put(workspace, "msg/A.msg", "Strng x\nflot64 y\n")
    first, second = problems(workspace)
    assert first.endswith("has no 'Strng.msg'; did you mean 'Strings'?")
    assert second.endswith("has no 'flot64.msg'; did you mean 'float64'?")


def places(found: list[str]) -> list[str]:
    return [one.partition(": error: ")[0] for one in found]


def test_all_errors_of_definitions_are_named(workspace: Path) -> None:
    put(workspace, "msg/A.msg", "int8 9a\nfloat64 x\nint8 x\nint8 B=900\nNope c\n")
    put(workspace, "srv/A.srv", "int8 9a\n---\nbool ok\nNope c\n---\n")
    put(workspace, "action/A.action", "Nope a\n---\nNope b\n---\n")
    assert places(problems(workspace)) == [
        "demo/action/A.action:1:1",
        "demo/action/A.action:3:1",
        "demo/msg/A.msg:1:6",
        "demo/msg/A.msg:3:6",
        "demo/msg/A.msg:4:8",
        "demo/msg/A.msg:5:1",
        "demo/srv/A.srv:1:6",
        "demo/srv/A.srv:4:1",
        "demo/srv/A.srv:5:1",
    ]


def test_all_errors_of_launch_files_are_named(workspace: Path) -> None:
    put(
        workspace,
        "launch/a.launch",
        """<launch>
  <param name="a"/>
  <group if="maybe"/>
  <node pkg="demo" name="n" type="talker.py">
    <remap from="a"/>
    <param name="b" value="$(arg nope)"/>
    <rosparam>[</rosparam>
  </node>
  <include file="$(find demo)/nothing.launch"/>
  <include file="$(find demo)/package.xml"/>
  <rosparam command="lod"/>
</launch>
""",
    )
    found = [one for one in problems(workspace) if "error" in one]
    lines = [one.removeprefix("demo/launch/a.launch:").partition(":")[0] for one in found]
    assert lines[:8] == ["2", "3", "5", "6", "7", "9", "11", "demo/package.xml"]


def test_an_arg_that_is_wrong_ends_the_reading(workspace: Path) -> None:
    text = '<arg name="a" value="1" default="2"/><param name="p" value="$(arg a)"/>'
    put(workspace, "launch/a.launch", f"<launch>{text}</launch>")
    (found,) = problems(workspace)
    assert "<arg> has both 'value' and 'default'" in found


def test_errors_elsewhere_do_not_hide_those_of_configs(workspace: Path) -> None:
    put(workspace, "msg/A.msg", "Nope a\n")
    text = (
        "from dynamic_reconfigure.parameter_generator_catkin import *\nParameterGenerator().ad()\n"
    )
    put(workspace, "cfg/A.cfg", "#!/usr/bin/env python3\n" + text, executable=True)
    assert places(problems(workspace)) == ["demo/cfg/A.cfg:3", "demo/msg/A.msg:1:1"]


def test_an_entry_point_without_its_module(workspace: Path) -> None:
    listed = "['a = demo.gone:main', 'b = demo:main']"
    put(workspace, "demo/__init__.py", "")
    put(workspace, "setup.py", f"setup(entry_points={{'console_scripts': {listed}}})\n")
    (found,) = [one for one in problems(workspace) if "setup.py" in one]
    assert "error: setup.py of package 'demo' says that 'a' is 'demo.gone:main'" in found


def test_a_file_is_no_package(workspace: Path) -> None:
    with pytest.raises(NotFoundError, match=r"'src/demo/package\.xml' is a file; expected a pack"):
        problems(workspace, "src/demo/package.xml")
