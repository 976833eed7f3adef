"""What of a workspace runs here, and what is needed for the rest."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli.command import rosz

FILES = {
    "good": "import rospy, json, own\nfrom demo.msg import Number\nfrom demo.tools import help\n",
    "late": "import not_there_at_all, tf2_ros\n",
    "maybe": "try:\n    import not_there_at_all\nexcept ImportError:\n    pass\n",
    "pypi": "import keras\nfrom keras.layers import Dense\n",
    "old": "import urllib2\nif True:\n    print 'a'\nexcept_ = 1\nprint 'b'\n",
    "through": "from demo import deep\n",
}


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    (tmp_path / "src").mkdir()
    rosz(tmp_path / "src", "pkg", "create", "demo")
    folder = tmp_path / "src" / "demo"
    (folder / "src" / "demo").mkdir(parents=True)
    (folder / "src" / "demo" / "__init__.py").touch()
    (folder / "src" / "demo" / "tools.py").write_text("help = 1\n")
    (folder / "src" / "demo" / "deep.py").write_text("from .tools import help\nimport absent_one\n")
    (folder / "scripts" / "own.py").write_text("")
    return tmp_path


def put(workspace: Path, *names: str) -> None:
    for name in names:
        file = workspace / "src" / "demo" / "scripts" / f"{name}.py"
        file.write_text(f"#!/usr/bin/env python3\n{FILES[name]}")
        file.chmod(0o755)


def test_a_workspace_that_runs(workspace: Path) -> None:
    put(workspace, "good", "maybe")
    done = rosz(workspace, "pkg", "check", "--migrate")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [
        "1 package, 3 Python programs",
        "runs here as it is: 3 of 3",
        "needs pip install: 0",
        "needs a module that is not there: 0",
        "is Python 2: 0",
        "is C++: 0",
        "other mistakes: 0",
    ]


def test_what_does_not_run(workspace: Path) -> None:
    put(workspace, *FILES)
    cmake = "project(demo)\nadd_executable(${PROJECT_NAME}_node a.cpp)\n"
    (workspace / "src" / "demo" / "CMakeLists.txt").write_text(cmake)
    launch = '<launch><node pkg="nowhere_pkg" type="n" name="n"/></launch>'
    (workspace / "src" / "demo" / "launch" / "a.launch").write_text(launch)
    (workspace / "src" / "demo" / "launch" / "b.launch").write_text(launch)
    done = rosz(workspace, "pkg", "check", "--migrate")
    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.splitlines() == [
        "1 package, 7 Python programs",
        "runs here as it is: 3 of 7",
        "needs pip install: 1",
        "    keras: demo/pypi.py",
        "needs a module that is not there: 2",
        "    absent_one: demo/through.py",
        "    not_there_at_all: demo/late.py",
        "is Python 2: 1; convert with: 2to3 -w FILE",
        "    src/demo/scripts/old.py: line 2, 4, 6: print without parentheses;"
        " module 'urllib2' is Python 2",
        "is C++: 1; catkin builds it (rosz help cpp), or it becomes a node of ROS 2 beside rosz",
        "    demo: demo_node",
        "other mistakes: 0",
        "package 'nowhere_pkg' is not there; needed by demo",
    ]
    as_json = rosz(workspace, "pkg", "check", "--migrate", "--json")
    assert as_json.returncode == 1
    page = json.loads(as_json.stdout)
    assert page["compiled"] == {"demo": ["demo_node"]}
    (old,) = [one for one in page["programs"] if one["path"].endswith("old.py")]
    assert len(old["python2"]) == 3


def test_a_text_of_many_places_is_one_line(workspace: Path) -> None:
    for name in "abc":
        launch = '<launch><include file="$(find nowhere_pkg)/x"/></launch>'
        (workspace / "src" / "demo" / "launch" / f"{name}.launch").write_text(launch)
        (workspace / "src" / "demo" / "msg" / f"{name.upper()}.msg").write_text(
            "Same x\nint8 y y\n"
        )
    done = rosz(workspace, "pkg", "check")
    first, *_, absent, summary = done.stdout.splitlines()
    assert first.startswith("src/demo/msg/A.msg:1:1: error: type 'Same' of field 'x'")
    assert first.endswith(" (3 places like this)")
    assert absent == "package 'nowhere_pkg' is not there; needed by demo"
    assert summary.endswith("0 warnings, 1 package not there")
    assert done.returncode == 1
