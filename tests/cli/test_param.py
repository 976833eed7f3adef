"""``rosz param`` beside rosparam's own command code, and what rosparam has not."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from interop.ros2_node import Ros2Node, ros2_node
from network import eventually
from oracle import Worker, require
from params.network import Network

from rosz.cli.main import run
from rosz.cli.param import _format_scalar, _parse_scalar
from rosz.node import Node
from rosz.params.replica import Replica
from rosz.params.wire import Keys, ReplicaMember
from rosz.params.yaml import format_get, load, pretty

from .command import ROSZ, environ, read_all

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def ros1() -> Iterator[Worker]:
    require("rosmaster", "rosparam", package="python3-rosmaster, python3-rosparam")
    worker = Worker("rosparam_calls")
    yield worker
    worker.close()


@pytest.fixture
def network(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Network]:
    found = Network()
    for name in ("ROS_NAMESPACE", "ROS_DOMAIN_ID", "ROSZ_CONNECT", "ROSZ_LISTEN", "ROSZ_MODE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ROSZ_RENDEZVOUS", found.rendezvous)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    yield found
    found.close()


@pytest.fixture
def replica(network: Network) -> Replica:
    return network.replica()


@pytest.fixture
def param(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    def call(*words: str, stdin: str = "") -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin.encode()), "utf-8"))
        code = run(["param", *words])
        out, err = capsys.readouterr()
        return code, out, err

    return call


CONFIG = """\
wheel: {radius: 0.05, name: left}
limits: [1, 2.5, fast]
angle: deg(90)
half: rad(pi/2)
enabled: on
text: "two\\nlines"
"""

FILES = {
    "config.yaml": CONFIG,
    "global.yaml": "/parameter_name_1: 10\n/parameter_name_2: 'D'\n",
    "two.yaml": "a: 1\n---\n_ns: inner\nb: 2\n",
    "list.yaml": "[1, 2]",
    "broken.yaml": "a: 1\nb: [1, 2\n",
    "keys.yaml": "2: 3\na: 1\n",
    "text.txt": "some\ntext\n",
}

LINES = [
    "list",
    "get /",
    "set /x 1",
    "set /x ''",
    "get /x",
    "set /neg -1",
    "get /neg",
    "set /neg -1.5",
    "get -p /neg",
    "set -x /neg",
    "set /neg -x",
    "set /l [1, 2.5, a, {q: 1}]",
    "get /l",
    "get -p /l",
    "set /m {a: 1, b: {c: x}}",
    "get /m",
    "get -p /m",
    "set /m {a: 2}",
    "get /m",
    "set /m {1: 2}",
    "set /m {}",
    "get /m/b/c",
    "get m/b",
    "get //m//b/",
    "get /nope",
    "delete /nope",
    "get /m/a/deeper",
    "delete /m/b/c",
    "get /m",
    "delete /m",
    "get",
    "set",
    "set /a",
    "set /a 1 2",
    "delete",
    "delete a b",
    "load",
    "load a b c",
    "dump a b c",
    "get -z x",
    "load /nofile",
    "load broken.yaml",
    "load keys.yaml",
    "load config.yaml",
    "list",
    "get /",
    "get -p /",
    "load config.yaml /my_settings",
    "load config.yaml relative",
    "list /my_settings",
    "list my_settings",
    "list /my_set",
    "get /my_settings/wheel",
    "load global.yaml /my_settings",
    "get /parameter_name_1",
    "get /parameter_name_2",
    "load two.yaml /two",
    "get /two",
    "load list.yaml",
    "load list.yaml /numbers",
    "get /numbers",
    "load - /pre",
    "get /pre",
    "dump dumped.yaml",
    "dump part.yaml /two",
    "dump",
    "load dumped.yaml copy",
    "get /copy/wheel/radius",
    "set -t text.txt /t",
    "get /t",
    "get -p /t",
    "set /t2 --textfile text.txt",
    "set --textfile=text.txt /t3",
    "get /t3",
    "set -t /nofile /t",
    "set -t text.txt -b text.txt /t",
    "set /t -b",
    "set ~private 5",
    "get ~private",
    "list",
    "set /s yes",
    "get /s",
    "set /s 'yes'",
    "get /s",
    "set /s 0x10",
    "get /s",
    "set /s 1e3",
    "get /s",
    'set /s "a\\nb"',
    "get /s",
    "set /name*with?odd#parts 1",
    "get /name*with?odd#parts",
    "set / 5",
    "set / {}",
    "delete /two",
    "delete /",
    "list",
    "get /",
    "list /",
]


def words_of(line: str) -> list[str]:
    command, *rest = line.split(" ", 2)
    if command == "set" and len(rest) == 2:
        name, value = rest
        if value == "''":
            return [command, name, ""]
        if value[0] in "[{":
            return [command, name, value]
    return line.split()


def test_it_does_what_rosparam_does(
    ros1: Worker, replica: Replica, param: Command, tmp_path: Path
) -> None:
    assert replica.root == {}
    folders = {"theirs": tmp_path / "theirs", "ours": tmp_path}
    for folder in folders.values():
        folder.mkdir(exist_ok=True)
        for name, text in FILES.items():
            (folder / name).write_text(text)
    lines = [words_of(line) for line in LINES]
    theirs = ros1.call("commands", lines, "piped: [1, 2]\n", str(folders["theirs"]))
    wrong = []
    for words, (code, out, err) in zip(lines, theirs, strict=True):
        ours = param(*words, stdin="piped: [1, 2]\n")
        if (code, out) != ours[:2] or bool(err) != bool(ours[2]):
            wrong.append((words, (code, out, err), ours))
        if err.startswith("ERROR: ") and err.rstrip().endswith("is not set"):
            assert ours[2].startswith(err.rstrip())
    assert wrong == [], "\n".join(map(str, wrong))
    for name in ("dumped.yaml", "part.yaml"):
        assert (folders["ours"] / name).read_bytes() == (folders["theirs"] / name).read_bytes()


def test_listing_as_json(replica: Replica, param: Command) -> None:
    replica.set("/", {"a": {"b": [1, 2.5, "x", b"raw"], "c": True}, "d": {}})
    assert json.loads(param("list", "--json")[1]) == ["/a/b", "/a/c"]
    assert json.loads(param("list", "a", "--json")[1]) == ["/a/b", "/a/c"]
    assert json.loads(param("get", "/a", "--json")[1]) == {"b": [1, 2.5, "x", "cmF3"], "c": True}
    assert json.loads(param("dump", "--json")[1])["a"]["c"] is True
    assert json.loads(param("search", "c", "/a/x", "--json")[1]) == "/a/c"


def test_values_rosparam_cannot_take(replica: Replica, param: Command, tmp_path: Path) -> None:
    (tmp_path / "raw").write_bytes(b"\x00\xff")
    for words in (
        ("/big", "9223372036854775807"),
        ("/day", "2001-12-14"),
        ("/moment", "2001-12-14 21:59:43.5"),
        ("/bytes", "!!binary aGVsbG8="),
        ("/list", "[1, {a: !degrees 180}]"),
        ("-b", "raw", "/raw"),
    ):
        assert param("set", *words) == (0, "", ""), words
    assert param("get", "/big")[1] == "9223372036854775807\n"
    assert param("get", "/day")[1] == "2001-12-14\n"
    assert param("get", "/moment")[1] == "2001-12-14 21:59:43.500000\n"
    assert param("get", "/bytes")[1] == "!!binary |\n  aGVsbG8=\n\n"
    assert replica.get("/raw") == b"\x00\xff"
    code, text, _ = param("dump")
    before = replica.root
    replica.set("/", {})
    assert param("load", "-", stdin=text) == (code, "", "")
    assert replica.root == before


@pytest.mark.parametrize("value", ["from:=to", "__x", "a:=b", "--", "-1e3", "-0x10", "- a"])
def test_values_that_look_like_something_else(replica: Replica, param: Command, value: str) -> None:
    words = ("--", value) if value.startswith("--") or value == "- a" else (value,)
    assert param("set", "/v", *words) == (0, "", "")
    expected = {"-1e3": "-1e3", "-0x10": -16, "- a": ["a"]}
    assert replica.get("/v") == expected.get(value, value)


def test_a_value_from_stdin(replica: Replica, param: Command) -> None:
    assert param("set", "/v", "-", stdin="{a: [1, 2]}\n")[0] == 0
    assert replica.get("/v") == {"a": [1, 2]}


def test_names_are_those_of_the_namespace(
    replica: Replica, param: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_NAMESPACE", "/robot")
    param("set", "rate", "5")
    param("set", "~own", "6")
    param("set", "__ns:=/other", "rate", "7")
    assert replica.root == {"robot": {"rate": 5, "rosparam": {"own": 6}}, "other": {"rate": 7}}
    assert param("list")[1] == "/other/rate\n/robot/rate\n/robot/rosparam/own\n"
    assert param("list", "")[1] == "/robot/rate\n/robot/rosparam/own\n"
    assert param("get", "rate")[1] == "5\n"
    assert param("load", "-", stdin="x: 1") == (0, "", "")
    assert replica.get("/robot/x") == 1


def test_verbose_messages_go_to_stdout(replica: Replica, param: Command) -> None:
    assert replica.root == {}
    assert param("load", "-v", "-", "/n", stdin="a: {b: 1}")[1:] == (
        "reading parameters from stdin\n/n/a/b=1\n",
        "",
    )
    assert param("get", "-v", "/n/a/b")[1:] == ("getting parameter [/n/a/b]\n1\n", "")
    assert param("dump", "-v", "o.yaml", "/n/a/b")[1:] == (
        "dumping namespace [/n/a/b] to file [o.yaml]\n1\n",
        "",
    )
    assert param("delete", "-v", "/n")[1:] == ("deleted parameter [/n]\n", "")
    assert param("delete", "-v", "/")[1:] == ("deleted ENTIRE parameter server\n", "")


def test_a_text_that_looks_like_an_angle_stays_a_text(replica: Replica, param: Command) -> None:
    for text in "deg(90)", "rad(pi)":
        param("set", "/a", f"'{text}'")
        assert param("get", "/a")[1] == f"'{text}'\n\n"  # as rosparam
        param("dump", "a.yaml")
        param("load", "a.yaml", "/copy")
        assert replica.get("/copy/a") == text


@pytest.mark.parametrize("target", ["/dev/stdout", ">(cat)", "fifo"])
def test_dump_to_what_is_no_file(replica: Replica, tmp_path: Path, target: str) -> None:
    replica.set("/a", 1)
    os.mkfifo(tmp_path / "fifo")
    rendezvous = os.environ["ROSZ_RENDEZVOUS"]
    line = f"{' '.join(ROSZ)} param dump {target} | cat"
    done = subprocess.run(
        ["bash", "-c", f"{line} & cat fifo" if target == "fifo" else line],
        env=environ(tmp_path, ROSZ_RENDEZVOUS=rendezvous),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert (done.stdout, done.stderr) == ("a: 1\n", "")


@pytest.mark.parametrize("terminal", [True, False])
def test_a_terminal_shows_how_far_a_load_is(
    network: Network, replica: Replica, tmp_path: Path, *, terminal: bool
) -> None:
    """One that looks like a replica and never answers makes the load take its limit of 2 s."""
    silent = ReplicaMember(1, "0badc0de", "a silent program")
    network.keep(network.session().token(Keys(0).token(silent)))
    eventually(lambda: silent in replica.members())
    ours, theirs = os.openpty() if terminal else os.pipe()
    subprocess.run(
        [*ROSZ, "param", "load", "-"],
        input=b"a: 1",
        env=environ(tmp_path, ROSZ_RENDEZVOUS=os.environ["ROSZ_RENDEZVOUS"]),
        cwd=tmp_path,
        stderr=theirs,
        timeout=300,
        check=True,
    )
    os.close(theirs)
    text = read_all(ours).decode()
    line = "loading 1 parameter, known to 1 replica, waiting for a silent program ("
    assert (f"\r\033[K{line}" in text) == terminal
    warning = "WARNING: written, but not yet known to a silent program, which did not answer"
    assert text.endswith(f"\r\033[K{warning}\r\n" if terminal else f"{warning}\n")


def test_searching(replica: Replica, param: Command) -> None:
    replica.set("/robot/description", "urdf")
    assert param("search", "description", "/robot/arm/node") == (0, "/robot/description\n", "")
    assert param("search", "/robot/description")[1] == "/robot/description\n"
    assert param("search", "nothing") == (
        1,
        "",
        "ERROR: Cannot find parameter [nothing] in an upwards search\n",
    )


def test_loading_is_all_or_nothing(replica: Replica, param: Command, tmp_path: Path) -> None:
    replica.set("/a", 1)
    (tmp_path / "bad.yaml").write_text("a: 2\nb:\n  - 1\n  - ~\n")
    assert param("load", "bad.yaml") == (
        1,
        "",
        "ERROR: bad.yaml:4:5: null is not a parameter value; "
        "delete the parameter, or set '' or {} instead\n",
    )
    (tmp_path / "bad.yaml").write_bytes(b"a: 2\nb: \xff\n")
    assert param("load", "bad.yaml")[2] == (
        "ERROR: bad.yaml:2: byte 0xff is not UTF-8; save the file as UTF-8\n"
    )
    (tmp_path / "bad.yaml").write_text("a: 2\n~private: 3\n")
    assert "the key '~private' in '/' is private" in param("load", "bad.yaml")[2]
    assert param("set", "/a", "{b: [1}")[2].startswith("ERROR: <value>:1:7: while parsing")
    assert param("set", "/a", "null")[0] == 1
    assert replica.root == {"a": 1}


def test_a_dry_run_prints_what_it_would_replace(
    replica: Replica, param: Command, tmp_path: Path
) -> None:
    replica.set("/", {"same": 1, "a": {"b": 1}, "leaf": "x", "text": "old"})
    (tmp_path / "f.yaml").write_text("same: 1\na: {b: 2, c: [1, 2]}\nleaf: {now: {}, d: 1}\n")
    before = replica.digest()
    assert param("load", "f.yaml", "--dry-run") == (
        0,
        "~ /a/b: 1 -> 2\n+ /a/c: [1, 2]\n- /leaf: x\n+ /leaf/d: 1\n",
        "4 parameters would change; nothing is written\n",
    )
    found = json.loads(param("load", "f.yaml", "--dry-run", "--json")[1])
    assert found[0] == {"name": "/a/b", "old": 1, "new": 2}
    assert replica.digest() == before
    assert param("load", "f.yaml", "--json")[0] == 2


def test_an_empty_network_is_one_line_and_exit_code_1(network: Network, param: Command) -> None:
    code, out, err = param("list")
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "start 'rosz core'" in err
    network.session()
    code, out, err = param("set", "/a", "1")
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "no process on this network holds the parameter store" in err
    assert "'rosz core'" in err


def test_a_missing_name_suggests_a_near_miss(replica: Replica, param: Command) -> None:
    replica.set("/robot/speed", 1)
    assert param("get", "/robot/sped") == (
        1,
        "",
        "ERROR: Parameter [/robot/sped] is not set; did you mean '/robot/speed'?\n",
    )


def test_watching_in_a_process_of_its_own(
    network: Network, replica: Replica, tmp_path: Path
) -> None:
    replica.set("/ns/a", 1)
    watcher = subprocess.Popen(
        [*ROSZ, "param", "watch", "/ns", "-n", "4"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environ(tmp_path, ROSZ_RENDEZVOUS=network.rendezvous),
    )
    assert watcher.stderr is not None
    assert watcher.stderr.readline() == "watching [/ns]; press Ctrl-C to end\n"
    replica.set("/ns/a", 2)
    replica.set("/ns/b", "two\nlines")
    replica.set("/other", 1)
    replica.delete("/ns/a")
    replica.set("/ns/c", [1])
    out, err = watcher.communicate(timeout=300)
    assert out == '~ /ns/a: 1 -> 2\n+ /ns/b: "two\\nlines"\n- /ns/a: 2\n+ /ns/c: [1]\n'
    assert (watcher.returncode, err) == (0, "")


def test_watching_as_json_in_this_process(replica: Replica, param: Command) -> None:
    stop = threading.Event()

    def change() -> None:
        number = 0
        while not stop.wait(0.01):
            number += 1
            replica.set("/a", number)

    thread = threading.Thread(target=change)
    thread.start()
    code, out, _ = param("watch", "/a", "-n", "2", "--json")
    stop.set()
    thread.join()
    first, second = map(json.loads, out.splitlines())
    assert code == 0
    assert first["name"] == "/a"
    assert first["new"] == second["old"]
    assert second["origin"] == replica.label


def test_wrong_usage_is_exit_code_2(replica: Replica, param: Command) -> None:
    assert replica.root == {}
    for words in (["watch", "/a", "-n", "0"], ["frob"], ["list", "a", "b"], ["watch"], ["search"]):
        assert param(*words)[0] == 2, words


def test_the_command_is_light(tmp_path: Path) -> None:
    code = (
        "import sys, rosz.cli.param; heavy = {'yaml', 'numpy', 'rosz.params', 'rosz.node'}"
        "; print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=environ(tmp_path),
        check=True,
    )
    assert done.stdout == "[]\n"


def test_a_writer_is_warned_of_silent_replicas(
    network: Network, param: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    from params.test_replica import Mute

    monkeypatch.setattr("rosz.params.replica.replica.ACK_TIMEOUT", 0.3)
    replica = network.replica()
    Mute(network)
    eventually(lambda: len(replica.members()) == 1)
    text = "WARNING: written, but not yet known to mute program (pid 7 on elsewhere), "
    told = 0, "", f"{text}which did not answer\n"
    # On a busy machine the other replica does not answer in that time, either.
    eventually(lambda: param("set", "/a", "1") == told, "the warning")


@pytest.mark.parametrize(
    "value",
    [True, False, 0, -7, 1 << 62, "c3", "_x", "Hello", "yes", "No", "null", "y", "", "a b", "1",
     "é", "a: b", "1e5", "e1", "nan", "inf", "NaN", 1.5, [1], {}],
)  # fmt: skip
def test_scalars_are_printed_as_with_yaml(value: Any) -> None:
    assert _format_scalar(value) in {"", format_get(value)}
    assert _format_scalar(value) in {"", pretty(value)}


@pytest.mark.parametrize(
    ("word", "value"), [("3", 3), ("-12", -12), ("0.50", 0.5), ("true", True), ("c3_po", "c3_po")]
)
def test_scalars_are_read_without_yaml(word: str, value: Any) -> None:
    assert _parse_scalar(word) == value
    assert type(_parse_scalar(word)) is type(value)


@pytest.mark.parametrize(
    "word",
    ["", "010", "1_000", "1:30", "0x1f", "1e5", ".inf", ".5", "5.", "+1", "-0", "True", "null", "~",
     "y", "No", "9" * 30, "deg(3)", "a b", "a:", "[1]", "é", "1.0.0", "3\n"],
)  # fmt: skip
def test_other_words_are_left_to_yaml(word: str) -> None:
    assert _parse_scalar(word) is None


@given(st.from_regex(r"[-0-9a-zA-Z_.]{1,8}", fullmatch=True))
def test_no_word_means_something_else_in_yaml(word: str) -> None:
    found = _parse_scalar(word)
    if found is not None:
        assert (type(found), found) == (type(load(word)), load(word))


class Terminal(io.TextIOWrapper):
    """Standard input of a terminal."""

    def isatty(self) -> bool:
        return True


def test_parameters_of_nodes_that_are_gone(
    replica: Replica, param: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = Node("alive")
    try:
        for name in ("/root", "/alive/rate", "/alive/pid/p", "/alive2/rate", "/gone/pid/p"):
            replica.set(name, 1)
        replica.set("/robot/gone/rate", 2)
        replica.set("/emptied/pid/p", 3)
        replica.delete("/emptied/pid/p")
        left = ["/alive2/rate", "/emptied/pid/", "/gone/pid/p", "/robot/gone/rate"]

        def listed() -> list[str]:
            code, out, err = param("list", "--gone")
            assert (code, err) == (0, "")
            return out.split()

        eventually(lambda: listed() == left, "the node")
        assert param("list", "--gone", "/robot") == (0, "/robot/gone/rate\n", "")

        code, _, err = param("delete", "--gone")
        assert code == 2
        assert "4 parameters would be deleted" in err
        monkeypatch.setattr(io, "TextIOWrapper", Terminal)
        code, out, err = param("delete", "--gone", stdin="no\n")
        assert (code, out.split()) == (1, left)
        assert "Delete these 4 parameters? [y/N] nothing is deleted" in err
        assert listed() == left
        code, out, err = param("delete", "--gone", "/robot", stdin="y\n")
        assert (code, out.split()) == (0, left[3:])
        assert listed() == left[:3]
        code, out, err = param("delete", "--gone", "-y", "-v")
        assert (code, err) == (0, "")
        assert out.splitlines() == [f"deleted parameter [{name}]" for name in left[:3]]
        assert param("list", "--gone") == (0, "", "")
        tree = replica.get("/")
        assert isinstance(tree, dict)
        assert tree["alive"] == {"rate": 1, "pid": {"p": 1}}
        # No namespace stays, whose deletions would be remembered for good.
        assert tree.keys().isdisjoint({"alive2", "emptied", "gone", "robot"})
    finally:
        node.close()
        node.context.close()


def test_what_is_set_while_the_user_is_asked_is_not_deleted(
    replica: Replica, param: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Slow(Terminal):
        def readline(self, *_: object) -> str:  # type: ignore[override]  # of a text
            replica.set("/gone/new", 2)
            return "y\n"

    replica.set("/gone/rate", 1)
    replica.set("/gone/pid/p", 1)
    monkeypatch.setattr(io, "TextIOWrapper", Slow)
    code, out, _ = param("delete", "--gone")
    assert (code, out.split()) == (0, ["/gone/pid/p", "/gone/rate"])
    assert replica.get("/gone") == {"new": 2}


@pytest.mark.parametrize("line", ["delete", "delete /x -y"])
def test_what_is_to_be_deleted_must_be_clear(param: Command, line: str) -> None:
    code, out, err = param(*line.split())
    assert (code, out) == (2, "")
    assert "--gone" in err


@pytest.fixture
def ros2(network: Network, replica: Replica) -> Iterator[Ros2Node]:  # noqa: ARG001  # there before
    with ros2_node(network.rendezvous, network.domain, "arm", speed=1.5, gains__p=2) as node:
        node.read_only.add("gains.p")
        yield node


def test_parameters_of_a_node_of_ros2(param: Command, ros2: Ros2Node, tmp_path: Path) -> None:
    """All commands reach them as those of the store."""
    eventually(lambda: param("list") == (0, "/arm/gains/p\n/arm/speed\n", ""), "the node")
    assert param("get", "/arm/gains") == (0, "p: 2\n\n", "")
    assert param("set", "/arm/speed", "3") == (0, "", "")
    assert ros2.get("speed") == 3.0
    assert param("dump", "arm.yaml", "/arm") == (0, "", "")
    assert (tmp_path / "arm.yaml").read_text() == "gains:\n  p: 2\nspeed: 3.0\n"
    assert param("set", "/arm/speed", "4") == (0, "", "")
    code, out, err = param("load", "arm.yaml", "/arm", "--dry-run")
    assert (code, out) == (0, "~ /arm/speed: 4.0 -> 3.0\n")
    assert param("load", "arm.yaml", "/arm") == (0, "", "")
    assert ros2.get("speed") == 3.0
    code, out, err = param("set", "/arm/gains/p", "5")
    assert (code, out) == (1, "")
    assert "'gains.p' cannot be set because it is read-only" in err
    code, out, err = param("delete", "/arm/speed")
    assert (code, out) == (1, "")
    assert "node '/arm' refuses to set '/arm/speed'" in err
    assert param("set", "/other", "1") == (0, "", "")
    assert param("get", "/") == (0, "arm:\n  gains:\n    p: 2\n  speed: 3.0\nother: 1\n\n", "")
