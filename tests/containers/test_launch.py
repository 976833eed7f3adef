"""Containers in launch files: nodes of one process that behave like nodes of several."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Iterator

import pytest
from network import Network, Program, eventually

from .site import Site

pytestmark = pytest.mark.system

BOX = """
    <group container="box">
      <node pkg="pk" type="talker.py" name="t1" ns="deep" args="-x one" output="screen">
        <param name="word" value="mine"/> <remap from="words" to="/words"/>
      </node>
      <node pkg="pk" type="listener.py" name="l1"/>
      <node pkg="pk" type="native.py" name="n1"/>
      <node pkg="pk" type="talker.py" name="t2"/>
      <node pkg="pk" type="crasher.py" name="c1" respawn="true" respawn_delay="1"/>
      <node pkg="pk" type="wrong.py" name="w1"/>
      <node pkg="pk" type="compiled" name="alone"/>
      <node pkg="pk" type="gone.py" name="gone"/>
    </group>
    <node pkg="nodelet" type="nodelet" name="manager" args="manager" output="screen"/>
    <node pkg="nodelet" type="nodelet" name="load1" args="load pk/listener.py manager"/>
    <node pkg="nodelet" type="nodelet" name="own1" args="standalone pk/listener.py"
          output="screen"/>
"""


@pytest.fixture(scope="module")
def network() -> Iterator[Network]:
    own = Network()
    yield own
    own.close()


@pytest.fixture(scope="module")
def site(network: Network) -> Site:
    return Site(network)


@pytest.fixture(scope="module")
def box(site: Site) -> Program:
    """What tests only look at: they run in any order, on several workers."""
    return site.launch(BOX)


@pytest.fixture
def own_site() -> Iterator[Site]:
    """A site of one test, which ends nodes."""
    own = Network()
    yield Site(own)
    own.close()


def _pid(program: Program, node: str, times: int = 1) -> int:
    line = program.wait_for(re.compile(rf"I am {node} "), times=times)
    return int(line.split()[3])


def test_each_node_has_its_own_name_arguments_and_parameters(box: Program) -> None:
    pid = _pid(box, "/deep/t1")
    assert {_pid(box, name) for name in ("/t2", "/l1", "/n1")} == {pid}
    box.wait_for(f"I am /deep/t1 {pid} ['-x', 'one'] mine")
    box.wait_for(f"I am /t2 {pid} [] -")
    box.wait_for("/l1 heard hello from /deep/t1 of /deep/t1")
    box.wait_for("/l1 heard hello from /t2 of /t2")


def test_what_is_no_python_runs_as_a_process_of_its_own(box: Program) -> None:
    box.wait_for(
        re.compile(r"WARNING: .*\d\.launch:.*node '/alone' .*'/box'.*not a Python script"), 60
    )
    box.wait_for(re.compile(r"process\[alone-\d+\]: started"))
    box.wait_for(re.compile("cannot launch node of type .pk/gone.py.: package 'pk'"))


def test_lines_for_nodelets_run_python_nodes(box: Program) -> None:
    pid = _pid(box, "/load1")
    assert pid not in {_pid(box, "/l1"), _pid(box, "/own1")}
    box.wait_for("/load1 heard hello from /t2 of /t2")


def test_a_crash_names_the_node_and_it_starts_again(box: Program) -> None:
    box.wait_for(re.compile(r"crasher.py\", line 5, in <module>"))
    box.wait_for(
        re.compile("ERROR: node '/c1' .*crasher.py.* of container '/box' has died, exit code 1:"
                   " ValueError: broken on purpose"), times=2,
    )  # fmt: skip
    box.wait_for("[/c1] restarting in container '/box'")
    box.wait_for(re.compile("node '/w1' .*wrong.py.* has died, exit code 1: SyntaxError"))
    assert "in _run_once" not in box.output


def test_the_status_shows_the_members(site: Site, box: Program) -> None:
    for name in ("/deep/t1", "/l1", "/n1", "/t2", "/load1"):
        _pid(box, name)
    status = site.rosz("launch", "--status")
    assert status.exit_code() == 0
    assert re.search(r"/box +running .*\n +/deep/t1 +in /box", status.output)
    stop = site.rosz("launch", "--stop", "/t2")
    assert stop.exit_code() == 1
    assert "it is in container '/box'" in stop.output
    listing = site.rosz("node", "list")
    assert listing.exit_code() == 0
    assert {"/deep/t1", "/l1", "/n1", "/t2", "/manager", "/load1"} <= set(listing.lines)


def test_one_node_is_killed_and_the_others_stay(own_site: Site) -> None:
    site, box = own_site, own_site.launch(BOX)
    _pid(box, "/n1")
    assert site.rosz("node", "kill", "/n1").exit_code() == 0
    box.wait_for("end of /n1")
    box.wait_for(re.compile("node '/n1' .* has finished cleanly"))
    late = site.rosz("run", "pk", "listener.py", "__name:=late")
    late.wait_for("/late heard hello from /t2 of /t2")


def test_a_container_that_is_killed_starts_again(own_site: Site) -> None:
    box = own_site.launch(BOX)
    _pid(box, "/deep/t1")
    os.kill(_pid(box, "/t2"), signal.SIGKILL)
    box.wait_for(re.compile(r"process of nodes /deep/t1, /l1, .* has died .*exit code -9"))
    box.wait_for(re.compile(r"\[box-1\] restarting process"))
    _pid(box, "/t2", times=2)
    _pid(box, "/deep/t1", times=2)
    _pid(box, "/load1")
    box.send(signal.SIGINT)
    assert box.exit_code() == 1  # a node could not be started
    assert "bye /deep/t1" in box.output
    assert "bye /load1" in box.output


def test_a_required_node_ends_the_launch(site: Site) -> None:
    launch = site.launch(
        """
        <group container="box">
          <node pkg="pk" type="crasher.py" name="c1" required="true" wait_for="node /d1"/>
          <node pkg="pk" type="listener.py" name="l1"/>
        </group>
        <node pkg="pk" type="deaf.py" name="d1"/>
        """
    )
    assert launch.exit_code() == 1
    assert "REQUIRED node '/c1' has ended: container '/box' ends" in launch.output
    assert "REQUIRED process [box-1] has died!" in launch.output


def test_programs_that_never_ask_for_the_shutdown_are_interrupted(site: Site) -> None:
    pair = site.rosz("run", "--with", "pk native.py", "pk", "deaf.py")
    pair.wait_for("deaf to all")
    pair.wait_for("I am /native")
    pair.send(signal.SIGINT)
    assert pair.exit_code() == 0
    assert "end of /native" in pair.output
    assert "Traceback" not in pair.output


def test_crashes_of_threads_and_in_c_name_the_program(site: Site) -> None:
    pair = site.rosz("run", "--with", "pk native.py", "pk", "fatal.py")
    assert pair.exit_code() == -signal.SIGSEGV
    assert "ERROR: a thread of node 'pk/fatal.py' of container" in pair.output
    assert "has died: ValueError: broken in a thread" in pair.output
    assert re.search(r'Segmentation fault(.*\n)+  File ".*fatal.py", line \d+', pair.output)


def test_lines_of_one_program_are_not_mixed_with_errors_of_another(site: Site) -> None:
    site.add("pk", "shouter.py", "import rosz\nfor i in range(2000): print('shout', i, 'end')\n")
    failing = """
        import threading, rosz
        def fail():
            raise ValueError("broken in a thread")
        for _ in range(200):
            thread = threading.Thread(target=fail)
            thread.start()
            thread.join()
    """
    site.add("pk", "failing.py", failing)
    launch = site.launch(
        """
        <group container="box">
          <node pkg="pk" type="shouter.py" name="s1" output="screen"/>
          <node pkg="pk" type="failing.py" name="f1" output="screen"/>
        </group>
        """
    )
    assert launch.exit_code() == 0
    lines = [line for line in launch.lines if "shout " in line or line.startswith("ValueError")]
    assert len(lines) == 2000 + 200
    whole = re.compile(r"shout \d+ end|ValueError: broken in a thread")
    assert [line for line in lines if not whole.fullmatch(line)] == []


def test_modules_of_one_name_beside_two_scripts_are_refused(site: Site) -> None:
    for package in ("one", "two"):
        site.add(package, "config.py", f"PLACE = '{package}'")
        site.add(package, "user.py", "import rosz, config\nprint('of', config.PLACE)\n")
    site.add("one", "user.py", "import rosz, config, threading\nprint('of', config.PLACE)\n"
             "rosz.Node('stays').spin()\n")  # fmt: skip
    pair = site.rosz("run", "--with", "two user.py", "one", "user.py")
    eventually(lambda: "ImportError: module 'config' is" in pair.output)
    assert re.search("which node '(one|two)/user.py' of this container has imported", pair.output)


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("--with", "pk", "pk", "talker.py"), "--with is 'pk'; expected 'PACKAGE EXECUTABLE"),
        (("--with", "pk none", "pk", "talker.py"), "has no executable 'none'"),
        (("--with", "pk compiled", "pk", "talker.py"), "is not a Python script"),
        (("--with", "pk 'x", "pk", "talker.py"), "cannot be split into words"),
        (("--by-reference", "pk", "talker.py"), "does nothing without --with"),
        (
            ("--with", "pk talker.py __name:=a", "pk", "listener.py", "__name:=a"),
            "two nodes of one process are named 'a'",
        ),
    ],
)
def test_wrong_command_lines(site: Site, words: tuple[str, ...], problem: str) -> None:
    command = site.rosz("run", *words)
    assert command.exit_code() in {1, 2}
    assert problem in command.output
