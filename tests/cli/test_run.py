"""``rosz run`` becomes the program, or says in one line why not."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from .command import package, rosz

SHOW = "#!/bin/sh\necho $$ $PPID; printf '[%s]' \"$@\"; echo; pwd; env | grep ROS\nexit 7\n"
PYTHON = "import sys, os\nprint(sys.argv[1:], sys.executable, os.getpid())\n"


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    package(tmp_path / "src", "demo", show=SHOW, node__py=PYTHON, odd="no first line\n")
    (tmp_path / "src/demo/scripts/plain").write_text("")
    (tmp_path / "src/demo/a.launch").write_text("<launch/>")
    return tmp_path


SETUP = """
from setuptools import setup
package_name = 'py_demo'
setup(
    name=package_name,
    packages=[package_name],
    entry_points={
        'console_scripts': [
            'talker = py_demo.sub.talker:main', 'gone=py_demo.gone:main', 'top=py_demo:main'
        ],
    },
)
"""
TALKER = """
import sys
from ..words import WORD
def main(args=None):
    print(WORD, sys.argv[1:], __name__, sys.argv[0])
    if "fail" in sys.argv:
        raise ValueError("failed")
    return 3
"""


@pytest.fixture
def ament(tmp_path: Path) -> Path:
    """A package in Python of ROS 2, as it is before colcon has built it."""
    folder = tmp_path / "src" / "py_demo"
    (folder / "py_demo" / "sub").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>py_demo</name></package>")
    (folder / "setup.py").write_text(SETUP)
    top = "def main():\n    print('top', __name__)\n"
    for name, text in (("__init__", top), ("words", "WORD = 'hi'\n"), ("sub/__init__", "")):
        (folder / "py_demo" / f"{name}.py").write_text(text)
    (folder / "py_demo" / "sub" / "talker.py").write_text(TALKER)
    return tmp_path


def test_an_entry_point_is_a_program(ament: Path) -> None:
    file = ament / "src/py_demo/py_demo/sub/talker.py"
    done = rosz(ament, "run", "py_demo", "talker", "a")
    assert done.stdout == f"hi ['a'] py_demo.sub.talker {file}:main\n"
    assert (done.returncode, done.stderr) == (3, "")
    assert rosz(ament, "run", "py_demo", "top").stdout == "top py_demo\n"
    done = rosz(ament, "run", "py_demo", "talker", "fail")
    assert done.returncode == 1
    assert done.stderr.startswith("Traceback (most recent call last):\n")
    assert "rosz" not in done.stderr.replace(str(ament), "")
    assert done.stderr.endswith("ValueError: failed\n")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["gone"], "says that 'gone' is 'py_demo.gone:main', but there is no "),
        (["tolker"], "did you mean 'talker'?"),
        ([], "no executable of package 'py_demo' is given: gone, talker, top\n"),
    ],
)
def test_errors_name_entry_points(ament: Path, words: list[str], text: str) -> None:
    done = rosz(ament, "run", "py_demo", *words)
    assert text in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_launch_file_starts_an_entry_point(ament: Path) -> None:
    (ament / "a.launch").write_text(
        '<launch><node pkg="py_demo" type="talker" name="t" output="screen" required="true"/>'
        "</launch>"
    )
    rendezvous = {"ROSZ_RENDEZVOUS": f"unixsock-stream/{ament}/z"}
    done = rosz(ament, "launch", "a.launch", variables=rendezvous)
    assert "hi ['__name:=t'" in done.stdout


def test_arguments_folder_and_exit_code_are_the_programs(workspace: Path) -> None:
    words = ("-h", "--help", "a b", "x:=y", "_p:=1", "__name:=n", "--", "-x")
    done = rosz(workspace, "run", "demo", "show", *words, variables={"ROS_NAMESPACE": "/ns"})
    lines = done.stdout.splitlines()
    assert lines[1] == "".join(f"[{word}]" for word in words)
    assert lines[2] == str(workspace)
    assert sorted(lines[3:]) == [
        f"ROSZ_PACKAGE_PATH={workspace}/src",
        f"ROSZ_PYTHON={sys.executable}",
        "ROS_NAMESPACE=/ns",
    ]
    assert (done.returncode, done.stderr) == (7, "")


def test_it_becomes_the_program(workspace: Path) -> None:
    done = rosz(workspace, "run", "--debug", "demo", "node.py", "a")
    assert done.stdout.startswith(f"['a'] {sys.executable} ")
    script = workspace / "src/demo/scripts/node.py"
    assert done.stderr == f"[rosz run] {sys.executable} -P -m rosz.script {script} a\n"


def test_a_prefix_stands_before_it(workspace: Path) -> None:
    done = rosz(workspace, "run", "--prefix", "env X=1 sh", "demo", "show", "a")
    assert done.returncode == 7
    assert "[a]\n" in done.stdout


ERRORS = {
    ("demo", "shaw"): (1, "has no executable 'shaw'; did you mean 'show'?\n"),
    ("demos", "show"): (1, "did you mean 'demo'?\n"),
    ("demo", "plain"): (1, "is not executable; run: chmod +x {0}/src/demo/scripts/plain\n"),
    ("demo", "odd"): (1, "Exec format error; if it is a script, its first line must name what"),
    ("-p", "nogdb", "demo", "show"): (1, "cannot run 'nogdb': No such file or directory; is it in"),
    ("demo",): (2, "ERROR: no executable of package 'demo' is given: node.py, odd, show\n"),
    (): (2, "ERROR: no package is given: rosz run PACKAGE EXECUTABLE [ARGS]\n"),
    ("--nope",): (2, "ERROR: no such option: --nope"),
    ("demo", "a.launch"): (
        1,
        "a launch file, not a program; use roslaunch, or: rosz launch demo a",
    ),
    ("demo", "scripts/shaw"): (1, "package 'demo' has no file '{0}/src/demo/scripts/shaw'"),
}


@pytest.mark.parametrize("words", ERRORS, ids=" ".join)
def test_errors_are_one_line(workspace: Path, words: tuple[str, ...]) -> None:
    done = rosz(workspace, "run", *words)
    code, text = ERRORS[words]
    assert text.format(workspace) in done.stderr
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (code, "", 1)


def test_help(workspace: Path) -> None:
    done = rosz(workspace, "run", "--help")
    assert done.returncode == 0
    assert "[PACKAGE] [EXECUTABLE] [ARGS]..." in done.stdout
