"""``rosz msg`` and ``rosz srv`` read as rosmsg and rossrv do."""

from __future__ import annotations

import io
import shutil
import subprocess

import pytest

from rosz.cli.main import run

TWIST = """\
geometry_msgs/Vector3 linear
  float64 x
  float64 y
  float64 z
geometry_msgs/Vector3 angular
  float64 x
  float64 y
  float64 z

"""
SET_BOOL = """\
bool data
---
bool success
string message

"""


@pytest.mark.parametrize(
    ("argv", "text"),
    [
        (["msg", "show", "geometry_msgs/Twist"], TWIST),
        (["msg", "info", "geometry_msgs/Twist"], TWIST),
        (["msg", "show", "Twist"], f"[geometry_msgs/Twist]:\n{TWIST}"),
        (["srv", "show", "std_srvs/SetBool"], SET_BOOL),
        (["msg", "md5", "std_msgs/String"], "992ce8a1687cec8c8bd883ec73ca41d1\n"),
        (["srv", "package", "std_srvs"], "std_srvs/Empty\nstd_srvs/SetBool\nstd_srvs/Trigger\n"),
        (
            ["msg", "hash", "std_msgs/String"],
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18\n",
        ),
    ],
)
def test_outputs(argv: list[str], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(argv) == 0
    written = capsys.readouterr()
    assert written.out == text
    assert not written.err


@pytest.mark.parametrize(
    ("argv", "text"),
    [
        (["msg", "show", "std_msgs/Strin"], "did you mean 'String'?"),
        (["msg", "show", "nope/X"], "there is no package 'nope'"),
        (["srv", "md5", "std_srvs/Nothing"], "'std_srvs/Nothing'"),
    ],
)
def test_missing_things(argv: list[str], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(argv) == 1
    written = capsys.readouterr()
    assert text in written.err
    assert written.err.count("\n") == 1


@pytest.mark.parametrize(
    ("verb", "what"), [("show", "type"), ("md5", "type"), ("package", "package")]
)
def test_no_type_is_given(
    verb: str, what: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("\n"))
    assert run(["msg", verb]) == 2
    assert capsys.readouterr().err == f"ERROR: no {what} is given\n"


@pytest.mark.ros1
@pytest.mark.parametrize("kind", ["Bool", "String", "Float64", "ColorRGBA", "Empty"])
@pytest.mark.parametrize("verb", ["show", "md5"])
def test_as_rosmsg(verb: str, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    rosmsg = shutil.which("rosmsg")
    if rosmsg is None:
        pytest.skip("ROS 1's rosmsg is not installed")
    done = subprocess.run(
        [rosmsg, verb, f"std_msgs/{kind}"],
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": "/usr/bin:/bin", "ROS_PACKAGE_PATH": "/usr/share"},
    )
    if done.returncode:
        pytest.skip("ROS 1's std_msgs are not installed")
    assert run(["msg", verb, f"std_msgs/{kind}"]) == 0
    assert capsys.readouterr().out == done.stdout
