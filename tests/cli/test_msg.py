from __future__ import annotations

import json
from pathlib import Path

import pytest

from rosz.msgs.std_msgs.msg import String

from .shell import Shell

NUM = """\
# how many
int64 num   # since the start
int32 BIG=0x10
string NAME=some text # not a comment
Header header
Pair[] pairs
float64[3] row
time when
"""
NUM_SHOWN = """\
int32 BIG=0x10
string NAME=some text # not a comment
int64 num
std_msgs/Header header
  uint32 seq
  time stamp
  string frame_id
counting/Pair[] pairs
  int8 a
  duration b
float64[3] row
time when

"""
ADD_SHOWN = """\
int64 a
---
counting/Pair sum
  int8 a
  duration b

"""


@pytest.fixture
def package(shell: Shell) -> Path:
    """A package of a workspace, which the shell stands in."""
    folder = shell.network.folder / "src" / "counting"
    for kind, name, text in (
        ("msg", "Num.msg", NUM),
        ("msg", "Pair.msg", "int8 a\nduration b\n"),
        ("srv", "Add.srv", "int64 a\n---\nPair sum\n"),
    ):
        (folder / kind).mkdir(parents=True, exist_ok=True)
        (folder / kind / name).write_text(text)
    (folder / "package.xml").write_text("<package><name>counting</name></package>")
    return folder


@pytest.mark.usefixtures("package")
@pytest.mark.parametrize("name", ["counting/Num", "counting/msg/Num", "counting/Num.msg"])
def test_show(shell: Shell, name: str) -> None:
    assert shell("msg", "show", name).out == NUM_SHOWN
    assert shell("msg", "info", name).out == NUM_SHOWN


@pytest.mark.usefixtures("package")
def test_show_raw(shell: Shell) -> None:
    assert shell("msg", "show", "-r", "counting/Num").out == f"{NUM}\n"


@pytest.mark.usefixtures("package")
def test_show_a_service(shell: Shell) -> None:
    assert shell("srv", "show", "counting/Add").out == ADD_SHOWN


@pytest.mark.usefixtures("package")
def test_show_by_the_name_alone(shell: Shell) -> None:
    assert shell("msg", "show", "Pair").out == "[counting/Pair]:\nint8 a\nduration b\n\n"
    found = shell("msg", "show", "Pose").out
    assert "[geometry_msgs/Pose]:\n" in found
    assert "[turtlesim/Pose]:\n" in found


@pytest.mark.usefixtures("package")
def test_show_reads_a_missing_type_from_standard_input(shell: Shell) -> None:
    assert shell("msg", "show", stdin="\ncounting/Pair\n").out == "int8 a\nduration b\n\n"
    assert shell("msg", "show").code == 2


@pytest.mark.usefixtures("package")
def test_show_as_json(shell: Shell) -> None:
    (found,) = shell("msg", "show", "--json", "counting/Num").json
    assert found["type_name"] == "counting/msg/Num"
    assert found["parts"][0]["pairs"] == "counting/Pair[]"
    assert found["constants"] == [{"BIG": 16, "NAME": "some text # not a comment"}]
    assert found["text"] == NUM
    (found,) = shell("srv", "show", "--json", "Add").json
    assert len(found["parts"]) == 2


def test_hashes(shell: Shell) -> None:
    assert shell("msg", "md5", "std_msgs/String").out == "992ce8a1687cec8c8bd883ec73ca41d1\n"
    assert shell("msg", "hash", "std_msgs/String").out == f"{String._type_hash}\n"
    assert shell("srv", "md5", "SetBool").lines == [
        "[example_interfaces/SetBool]: 09fb03525b03e7ea1fd3992bafd87e16",
        "[std_srvs/SetBool]: 09fb03525b03e7ea1fd3992bafd87e16",
    ]
    assert shell("srv", "hash", "std_srvs/SetBool").out.startswith("RIHS01_")


@pytest.mark.usefixtures("package")
def test_lists(shell: Shell) -> None:
    found = shell("msg", "list").lines
    assert found == sorted(found)
    assert {"counting/Num", "std_msgs/String"} <= set(found)
    assert "counting/Add" in shell("srv", "list", "--json").json
    assert shell("msg", "package", "counting").lines == ["counting/Num", "counting/Pair"]
    assert shell("msg", "package", "-s", "counting").lines == ["counting/Num counting/Pair"]
    assert "counting" in shell("srv", "packages").lines
    assert " std_msgs " in shell("msg", "packages", "-s").out
    assert json.loads(shell("msg", "packages", "--json").out)


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["msg", "show", "std_msgs/Strin"], 1, "did you mean 'String'?"),
        (["msg", "show", "Strin"], 1, "no package has it; did you mean 'String'?"),
        (["msg", "show", "std_msg/String"], 1, "did you mean 'std_msgs'?"),
        (["msg", "show", "std_srvs/SetBool"], 1, "package 'std_srvs' has no msg at all"),
        (["msg", "show", "std_msgs::String"], 2, "expected a form such as 'std_msgs/String'"),
        (["msg", "md5", "std_msgs/Nope"], 1, "has no such msg"),
        (["msg", "package", "std_msg"], 1, "package 'std_msg' not found"),
        (["srv", "show", "std_msgs/String"], 1, "package 'std_msgs' has no srv at all"),
    ],
)
def test_errors(shell: Shell, words: list[str], code: int, text: str) -> None:
    result = shell(*words)
    assert result.code == code
    assert text in result.err
    assert result.err.count("\n") == 1


def test_a_wrong_definition_is_reported_with_its_place(shell: Shell, package: Path) -> None:
    file = package / "msg" / "Bad.msg"
    file.write_text("int8 a\nPear b\n")
    result = shell("msg", "show", "counting/Bad")
    assert result.code == 1
    assert result.err.startswith(f"ERROR: {file}:2:1: type 'Pear' of field 'b'")
