"""Files and names that try to reach forbidden files; each is refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli.command import package, rosz
from network import Network

from rosz.errors import NotFoundError
from rosz.packages import Package


@pytest.mark.parametrize("name", ["../other/run.py", "scripts/../../run.py", "/bin/ls"])
def test_paths_that_climb_out_of_a_package(tmp_path: Path, name: str) -> None:
    mine = Package("mine", package(tmp_path, "mine", run__py="#!/bin/sh\n"))
    with pytest.raises(NotFoundError, match="leads out of package 'mine'"):
        mine.within(name)
    with pytest.raises(NotFoundError, match="leads out of package 'mine'"):
        mine.file(name)
    assert mine.within("scripts/../scripts/run.py") == mine.path / "scripts" / "run.py"


@pytest.mark.parametrize(
    "command", [("run", "mine", "../../outside"), ("launch", "mine", "../../outside")]
)
def test_commands_that_climb(tmp_path: Path, command: tuple[str, ...]) -> None:
    package(tmp_path / "src", "mine")
    done = rosz(tmp_path, *command)
    assert done.returncode == 1
    assert "'../../outside' leads out of package 'mine'" in done.stderr


def test_a_launch_file_that_climbs(tmp_path: Path) -> None:
    package(tmp_path / "src", "mine")
    file = tmp_path / "a.launch"
    file.write_text('<launch><node name="x" pkg="mine" type="../../../bin/ls"/></launch>')
    rendezvous = {"ROSZ_RENDEZVOUS": f"unixsock-stream/{tmp_path}/z"}
    done = rosz(tmp_path, "launch", str(file), variables=rendezvous)
    assert "leads out of package 'mine'" in done.stdout + done.stderr


def test_dump_does_not_write_through_links(network: Network) -> None:
    precious = network.folder / "precious"
    precious.write_text("mine\n")
    (network.folder / "link.yaml").symlink_to(precious)
    node = network.node()
    node.params.set("/a", 1)
    dump = network.run("-m", "rosz", "param", "dump", str(network.folder / "link.yaml"))
    assert dump.exit_code() == 2
    assert f"is a link to '{precious}'; name the file itself" in dump.output
    assert precious.read_text() == "mine\n"


@pytest.mark.parametrize("file", ["/dev/zero", "/dev/stdin", "."])
def test_load_reads_files_alone(tmp_path: Path, file: str) -> None:
    done = rosz(tmp_path, "param", "load", file)
    assert done.returncode == 1
    assert done.stderr == f"ERROR: file '{file}' is not a regular file\n"


def test_links_that_lead_round(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").symlink_to("b.yaml")
    (tmp_path / "b.yaml").symlink_to("a.yaml")
    done = rosz(tmp_path, "param", "load", "a.yaml")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr


BOMB = "a: &a [1,1,1,1,1,1,1,1,1]\n" + "".join(
    f"{chr(98 + level)}: &{chr(98 + level)} [{','.join([f'*{chr(97 + level)}'] * 9)}]\n"
    for level in range(12)
)
LOAD = '<launch><rosparam command="load" file="$(dirname)/a.yaml"/></launch>'
ENTITIES = "".join(
    f'<!ENTITY {chr(98 + level)} "{f"&{chr(97 + level)};" * 9}">' for level in range(12)
)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.yaml", BOMB, "this looks like a YAML bomb"),
        ("a.yaml", "a: &a [*a]", "it contains itself"),
        ("a.yaml", "[" * 9999, "it is nested more than 100 deep"),
        (
            "a.launch",
            f'<!DOCTYPE x [<!ENTITY a "ha">{ENTITIES}]><launch><arg name="&m;"/></launch>',
            "that may explode",
        ),
        (
            "a.launch",
            '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><launch>&a;</launch>',
            "entity 'a' is external",
        ),
        (
            "a.launch",
            '<launch><param name="a" value="$(eval ().__class__)"/></launch>',
            "an expression may not contain '__'",
        ),
        (
            "a.launch",
            '<launch><param name="a" value="$(eval 9**9**9)"/></launch>',
            "a number of more than 4096 bits",
        ),
        (
            "a.launch",
            '<launch><include file="$(dirname)/a.launch"/></launch>',
            "includes nest deeper than 300",
        ),
        (
            "a.launch",
            '<launch><arg name="x" default="ab"/><include file="$(dirname)/a.launch">'
            '<arg name="x" value="$(arg x)$(arg x)"/></include></launch>',
            "all values have more than 67108864 characters",
        ),
    ],
)
def test_bombs(tmp_path: Path, name: str, text: str, message: str) -> None:
    (tmp_path / "load.launch").write_text(LOAD)
    (tmp_path / name).write_text(text)
    file = name if name.endswith(".launch") else "load.launch"
    done = rosz(tmp_path, "launch", "--dump-params", file)
    assert done.returncode == 1
    assert message in done.stderr
    assert "Traceback" not in done.stderr
