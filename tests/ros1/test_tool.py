"""Commands of ROS 1's tools from their Python modules."""

from __future__ import annotations

import io

import pytest
from network import Network

from rosz.ros1.tools import rosmsg, rosnode, rosparam, rosservice, rostopic


def test_output_goes_to_the_stdout_of_the_caller(capsys: pytest.CaptureFixture[str]) -> None:
    rosmsg.rosmsg_cmd_packages(rosmsg.MODE_MSG, "", ["packages"])
    lines = capsys.readouterr().out.splitlines()
    rosmsg.rosmsg_cmd_packages(rosmsg.MODE_MSG, "", ["packages", "-s"])
    assert capsys.readouterr().out.split() == lines
    assert "std_msgs" in lines


def test_help_has_the_names_of_ros1(capfd: pytest.CaptureFixture[str]) -> None:
    for mode, name in ((rosmsg.MODE_MSG, "rosmsg"), (rosmsg.MODE_SRV, "rossrv")):
        text = rosmsg.fullusage(mode)
        assert "Commands:" in text
        for command in ("show", "info", "list", "md5", "package", "packages"):
            assert f"\n  {name} {command} " in text
    with pytest.raises(SystemExit) as ended:
        rostopic.rostopicmain(["rostopic", "hz"])
    assert ended.value.code == 2
    text = capfd.readouterr().err
    assert text.startswith("ERROR: missing argument 'TOPIC'; see 'rostopic hz --help'\n")
    assert "Usage: rostopic hz " in text


@pytest.mark.parametrize("module", [rosnode, rosparam, rosservice, rostopic])
def test_help_exits_as_in_ros1(module: object, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        module._fullusage()  # type: ignore[attr-defined]
    assert ended.value.code == 64
    name = module.NAME  # type: ignore[attr-defined]
    assert f"\n  {name} list " in capsys.readouterr().out


def test_input_comes_from_the_stdin_of_the_caller(
    network: Network, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    node = network.node("store")
    for name, value in network.variables().items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr("sys.stdin", io.StringIO("speed: 1.5"))
    rosparam.yamlmain(["rosparam", "load", "-", "/wheels"])
    assert node.params.get("/wheels/speed") == 1.5
    monkeypatch.undo()
    assert capsys.readouterr().out == ""
