"""A program sees the same under ``rosz launch`` and ``rosz run``."""

from __future__ import annotations

import json
from pathlib import Path

from network import Network, free_port

from .command import package, rosz

SHOW = """#!/usr/bin/env python3
import json, os, sys
import rospy, std_msgs.msg
print("SEEN" + json.dumps({"environ": dict(os.environ), "path": sys.path, "argv": sys.argv}))
"""
SHELL = "#!/bin/sh\nexec env -0 | tr '\\0' '\\n' | sed 's/^/SEEN/'\n"
LAUNCHED = {"ROSZ_LAUNCH", "PYTHONUNBUFFERED", "PWD", "OLDPWD"}
"""What a launch adds: how it finds its processes again, and lines at once; folders differ."""
MASTER = {"ROS_MASTER_URI", "ROS_IP"}
"""What it adds for a program that may start one of ROS 1."""


def seen(output: str) -> list[str]:
    return [line.removeprefix("SEEN") for line in output.splitlines() if line.startswith("SEEN")]


def run(network: Network, *words: str) -> str:
    variables = {**network.variables(), "MINE": "kept"}
    del variables["PYTHONUNBUFFERED"]
    done = rosz(network.folder, *words, variables=variables)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_python_node(network: Network) -> None:
    demo = package(network.folder / "src", "demo", show__py=SHOW)
    file = demo / "show.launch"
    file.write_text(
        '<launch><node pkg="demo" type="show.py" name="show" output="screen"/></launch>'
    )
    (launched,) = map(json.loads, seen(run(network, "launch", str(file))))
    (alone,) = map(json.loads, seen(run(network, "run", "demo", "show.py")))
    assert different(launched["environ"], alone["environ"]) <= LAUNCHED
    assert launched["environ"]["MINE"] == "kept"
    assert launched["path"] == alone["path"]
    assert launched["argv"][0] == alone["argv"][0] == str(demo / "scripts/show.py")
    assert launched["argv"][1] == "__name:=show"


def test_another_program(network: Network) -> None:
    demo = package(network.folder / "src", "demo", show=SHELL)
    file = demo / "show.launch"
    file.write_text('<launch><node pkg="demo" type="show" name="show" output="screen"/></launch>')
    launched, alone = (
        dict(line.partition("=")[::2] for line in seen(output))
        for output in (run(network, "launch", str(file)), run(network, "run", "demo", "show"))
    )
    assert different(launched, alone) <= LAUNCHED | MASTER


def test_a_master_at_the_port_of_the_environment(network: Network) -> None:
    demo = package(network.folder / "src", "demo", show=SHELL)
    file = demo / "show.launch"
    file.write_text('<launch><node pkg="demo" type="show" name="show" output="screen"/></launch>')
    port = free_port()
    for host in ("localhost", "127.0.0.1", "[::1]"):
        variables = {**network.variables(), "ROS_MASTER_URI": f"http://{host}:{port}/"}
        output = rosz(network.folder, "launch", str(file), variables=variables).stdout
        assert f"ROS_MASTER_URI=http://127.0.0.1:{port}" in seen(output), output
    variables["ROS_MASTER_URI"] = f"http://192.0.2.1:{port}"
    output = rosz(network.folder, "launch", str(file), variables=variables).stdout
    assert f"ROS_MASTER_URI=http://127.0.0.1:{port}" not in seen(output), output


def different(one: dict[str, str], other: dict[str, str]) -> set[str]:
    """Return the names of what is not the same in both."""
    return {name for name in {*one, *other} if one.get(name) != other.get(name)}


def test_a_namespace_of_the_shell_counts_for_both(network: Network, tmp_path: Path) -> None:
    demo = package(tmp_path / "src", "demo", show='#!/bin/sh\necho "SEEN$ROS_NAMESPACE"\n')
    (demo / "x.launch").write_text(
        '<launch><node pkg="demo" type="show" name="show" output="screen"/></launch>'
    )
    variables = {**network.variables(), "ROS_NAMESPACE": "/robot"}
    for words in (("launch", "demo", "x.launch"), ("run", "demo", "show")):
        assert seen(rosz(tmp_path, *words, variables=variables).stdout) == ["/robot"]
