"""The intended differences from roslaunch, tested on both sides."""

from __future__ import annotations

from pathlib import Path

import pytest

from .roslaunch_oracle import Roslaunch, Rosz

# What could harm, or cannot mean anything, is refused although roslaunch takes it.
STRICTER = {
    "nested entities": '<!DOCTYPE launch [<!ENTITY a "x"><!ENTITY b "&a;y">]><launch/>',
    "external entities": '<!DOCTYPE launch [<!ENTITY a SYSTEM "/etc/hostname">]><launch/>',
    "files from expressions": """<launch>
      <param name="a" value="$(eval open('/dev/null').read())"/></launch>""",
    "attributes of values": """<launch><param name="a" value="$(eval (1).real)"/></launch>""",
    "huge numbers": """<launch><param name="a" value="$(eval 2 ** 20000 % 7)"/></launch>""",
    "functions as results": """<launch><param name="a" value="$(eval str)"/></launch>""",
    "comprehensions": """<launch><param name="a" value="$(eval [i for i in [1]])"/></launch>""",
    "lambdas": """<launch><param name="a" value="$(eval (lambda: 1)())"/></launch>""",
    "starred elements": """<launch><param name="a" value="$(eval [*[1], 2])"/></launch>""",
    "letters beyond ASCII in names": '<launch><remap from="größe" to="b"/></launch>',
    "delays that are no number": """<launch>
      <node pkg="demo_nodes" type="talker.py" name="n" respawn_delay="nan"/></launch>""",
    "ports that are none": '<launch><machine name="a" address="h" ssh-port="0"/></launch>',
}

# What roslaunch refuses for want of a feature, rosz has.
RICHER = {
    "dates as parameters": "<launch><rosparam>a: 2020-01-02</rosparam></launch>",
    "var": '<launch><arg name="n" value="2"/><param name="a" value="$(var n)"/></launch>',
    "find-pkg-share": '<launch><param name="a" value="$(find-pkg-share demo_robot)"/></launch>',
    "exec": '<launch><node pkg="demo_nodes" exec="talker.py"/></launch>',
    "let": '<launch><let name="a" value="1"/><param name="a" value="$(arg a)"/></launch>',
}


@pytest.mark.parametrize("text", STRICTER.values(), ids=STRICTER)
def test_rosz_refuses_more(text: str, tmp_path: Path, roslaunch: Roslaunch, rosz: Rosz) -> None:
    (tmp_path / "f.launch").write_text(text)
    assert roslaunch.ask(["f.launch"], tmp_path)["error"] is None
    assert rosz.ask(["f.launch"], tmp_path)["error"] is not None


@pytest.mark.parametrize("text", RICHER.values(), ids=RICHER)
def test_rosz_reads_more(text: str, tmp_path: Path, roslaunch: Roslaunch, rosz: Rosz) -> None:
    (tmp_path / "f.launch").write_text(text)
    assert roslaunch.ask(["f.launch"], tmp_path)["error"] is not None
    assert rosz.ask(["f.launch"], tmp_path)["error"] is None


def test_roslaunch_cannot_dump_binary_values(
    tmp_path: Path, roslaunch: Roslaunch, rosz: Rosz
) -> None:
    (tmp_path / "f.launch").write_text("<launch><rosparam>a: !!binary aGVsbG8=</rosparam></launch>")
    assert roslaunch.ask(["f.launch"], tmp_path)["dump"] is None
    assert rosz.ask(["f.launch"], tmp_path)["dump"] == "/a: !!binary |\n  aGVsbG8=\n\n"


def test_shared_values_are_written_out(tmp_path: Path, roslaunch: Roslaunch, rosz: Rosz) -> None:
    (tmp_path / "f.launch").write_text(
        "<launch><rosparam>{a: &amp;x [1], b: *x}</rosparam></launch>"
    )
    assert roslaunch.ask(["f.launch"], tmp_path)["dump"] == "/a: &id001\n- 1\n/b: *id001\n\n"
    assert rosz.ask(["f.launch"], tmp_path)["dump"] == "/a:\n- 1\n/b:\n- 1\n\n"
