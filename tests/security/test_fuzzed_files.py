"""Launch files, files of parameters and bags, damaged at random: an error, or what they mean.

No traceback, and within limits of time and memory. ``ROSZ_SEED`` repeats a run.
"""

from __future__ import annotations

import os
import random
import resource
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from cli.command import ROSZ, environ
from network import Network, eventually, repeats

from rosz.bags import Channel, McapWriter
from rosz.bags.formats.ros1_writer import Ros1Writer
from rosz.msgs.std_msgs.msg import String

MOST_BYTES = 600 << 20
MOST_SECONDS = 15
"""Of the processor; the wall clock of a busy machine says nothing."""
COUNT = repeats(4, 300)


@pytest.fixture
def rng() -> random.Random:
    seed = int(os.environ.get("ROSZ_SEED", random.SystemRandom().randrange(1 << 32)))
    print("ROSZ_SEED =", seed)
    return random.Random(seed)


def limited(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run a command with the limits, on a network that nobody else has."""
    variables = environ(
        folder, ROSZ_RENDEZVOUS=f"unixsock-stream/{folder}/z.sock", PYTHONFAULTHANDLER="1"
    )

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
        resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))

    return subprocess.run(
        [*ROSZ, *words],
        cwd=folder,
        env=variables,
        capture_output=True,
        timeout=300,
        check=False,
        text=True,
        errors="replace",
        stdin=subprocess.DEVNULL,
        preexec_fn=limit,  # no threads take part in it
    )


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Return bytes with some of them changed, left out, repeated or moved."""
    copy = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5, 20))):
        at, size = rng.randrange(len(copy)), rng.choice((1, 1, 4, 8, 40, 400))
        kind = rng.randrange(5)
        if kind == 0:
            copy[at] = rng.randrange(256)
        elif kind == 1:
            del copy[at : at + size]
        elif kind == 2:
            copy[at:at] = copy[at : at + size] * rng.choice((1, 3, 50))
        elif kind == 3:
            copy[at : at + 8] = rng.choice((b"\xff" * 8, bytes(8), b"\xff" * 4 + bytes(4)))
        else:
            other = rng.randrange(len(copy))
            copy[at:at] = copy[other : other + size]
        copy = copy or bytearray(b"\0")
    return bytes(copy)


LAUNCH = """<?xml version="1.0" encoding="UTF-8"?>
<launch>
  <arg name="n" default="2"/> <arg name="flag" default="$(eval arg('n') == 2)"/>
  <include file="$(dirname)/inner.launch" ns="deep" if="$(arg flag)"><arg name="x" value="1"/>
  </include>
  <group ns="g"><remap from="a" to="b"/><param name="p" type="yaml" value="{a: [1, 2.5, no]}"/>
    <rosparam command="load" file="$(dirname)/values.yaml" subst_value="true"/>
    <rosparam param="list">[1, &x [2, 3], *x, !degrees 90, !!binary aGk=, 0x1f, 1:30, ~]</rosparam>
    <node pkg="rosz_tutorials" type="publisher.py" name="$(anon pub)" args="a b" respawn="true"/>
  </group>
  <env name="A" value="$(optenv HOME none)"/><test test-name="t" pkg="a" type="b" time-limit="5"/>
</launch>
"""
VALUES = """# a comment
wheel: {radius: 0.05, name: left, more: &more {a: 1, b: [1, 2]}}
other: {<<: *more, c: !radians pi/2, d: !!binary aGVsbG8=, e: 2001-12-14t21:59:43.10-05:00}
text: |
  two
  lines
folded: >-
  on one line
? complex
: "\\x41\\u00e9"
big: 123456789012345678901234567890
nan: [.nan, .inf, -.inf, 1e400]
"""


@pytest.mark.parametrize("name", ["outer.launch", "inner.launch", "values.yaml"])
def test_damaged_launch_files(tmp_path: Path, rng: random.Random, name: str) -> None:
    inner = LAUNCH.replace("$(arg flag)", "false").replace("<launch>", "<launch><arg name='x'/>")
    whole = {"outer.launch": LAUNCH, "inner.launch": inner, "values.yaml": VALUES}
    for file, text in whole.items():
        (tmp_path / file).write_text(text)
    for _ in range(COUNT):
        data = damaged(whole[name].encode(), rng)
        (tmp_path / name).write_bytes(data)
        done = limited(tmp_path, "launch", "--dump-params", "outer.launch")
        assert done.returncode in {0, 1}, (data, done)
        assert "Traceback" not in done.stderr, data


def bombs() -> Iterator[tuple[str, bytes]]:
    """Yield the names and texts of files that ask for much."""
    yield "flow", b"[" * 200_000
    yield "maps", b"{a: " * 200_000
    yield "blocks", b"".join(b" " * depth + b"a:\n" for depth in range(2000))
    yield "dashes", b"- " * 100_000
    yield "keys", b"? " * 100_000
    yield "tags", b"!!python/object/apply:os.system [echo hi]"
    yield "unknown tag", b"a: !" + b"x" * 1_000_000 + b" 1"
    yield "alias of a key", b"&a a: *a"
    yield "cycle", b"&a {b: *a}"
    yield "merge with itself", b"a: &a\n  <<: *a\n  b: 1"
    levels = (f"l{n}: &l{n} {{<<: [{', '.join([f'*l{n - 1}'] * 9)}]}}" for n in range(1, 30))
    yield "merged again and again", "\n".join(["l0: &l0 {a: 1}", *levels]).encode()
    pairs = (f"- &x{n} [*x{n - 1}, *x{n - 1}]" for n in range(1, 40))
    yield "doubled", "\n".join(["- &x0 [1, 2]", *pairs]).encode()
    yield "huge scalar", b"a: " + b"x" * 30_000_000
    yield "huge integer", b"a: " + b"9" * 300_000
    yield "huge octal", b"a: 0" + b"7" * 300_000
    yield "sexagesimal", b"a: 1" + b":59" * 100_000
    yield "huge angle", b"a: !degrees 9**9**9**9"
    yield "deep angle", b"a: !degrees " + b"(" * 100_000
    yield "long name", b"a" * 100_000 + b": 1"
    yield "many names", b"".join(b"k%d: 1\n" % n for n in range(100_000))
    yield "anchors", b"".join(b"- &a%d 1\n" % n for n in range(50_000))
    yield "utf-16", "a: é\n".encode("utf-16")
    yield "utf-32", "a: é\n".encode("utf-32")
    yield "half of utf-16", b"\xff\xfea"
    yield "latin-1", b"a: \xe9\n"
    yield "control characters", b"a: \x1b[31m\x00"
    yield "surrogates", b"a: \xed\xa0\x80"
    yield "surrogate escapes", b'a: "\\ud800\\udfff"'
    yield "noncharacters", "a: \ufffe\uffff".encode()
    yield "beyond unicode", b'a: "\\Uffffffff"'
    yield "year 0", b"a: 0000-00-00"
    yield "documents", b"---\n" * 100_000
    yield "directives", b"%YAML 9.9\n---\na: 1"
    yield "tabs", b"\ta:\t1"
    yield "comment", b"#" * 10_000_000
    yield "base64", b"a: !!binary " + b"A" * 999_999
    yield "not hashable", b"? [a, {b: c}]\n: 1"
    yield "null key", b"~: 1"


@pytest.mark.parametrize("text", [pytest.param(text, id=name) for name, text in bombs()])
def test_files_of_parameters_that_ask_for_much(network: Network, text: bytes) -> None:
    """`load` reads and checks a file before it looks for a replica, of which there is none."""
    (network.folder / "a.yaml").write_bytes(text)
    done = limited(network.folder, "param", "load", "a.yaml")
    assert done.returncode in {0, 1}, done.stderr[:500]
    assert "Traceback" not in done.stderr
    assert len(done.stderr) < 2000
    (network.folder / "a.launch").write_text(
        '<launch><rosparam command="load" file="$(dirname)/a.yaml"/></launch>'
    )
    done = limited(network.folder, "launch", "--nodes", "a.launch")
    assert done.returncode in {0, 1}, done.stderr[:500]
    assert "Traceback" not in done.stderr
    assert len(done.stderr) < 2000


@pytest.mark.parametrize("form", ["mcap", "bag"])
def test_damaged_bags_are_played(network: Network, rng: random.Random, form: str) -> None:
    """The player publishes what is whole, and ends by itself."""
    whole = network.folder / f"whole.{form}"
    with McapWriter(whole) if form == "mcap" else Ros1Writer(whole) as writer:
        for number in range(30):
            message = String(data=f"hello {number}")
            channel = Channel(f"/t{number % 3}", "std_msgs/msg/String", definition="string data\n")
            if form == "bag":
                channel = Channel(
                    f"/t{number % 3}",
                    "std_msgs/msg/String",
                    encoding="ros1",
                    md5=String._md5sum,
                    definition="string data\n",
                )
            data = message.to_cdr() if form == "mcap" else message.to_ros1()
            writer.write(writer.add(channel), 1_000_000_000 + number, data)
    data = whole.read_bytes()
    for _ in range(COUNT):
        copy = damaged(data, rng)
        (network.folder / f"a.{form}").write_bytes(copy)
        done = limited(network.folder, "bag", "play", "-i", "--quiet", f"a.{form}")
        assert done.returncode in {0, 1}, (copy, done)
        assert "Traceback" not in done.stderr, copy


def test_many_parameters_of_a_launch_file(network: Network) -> None:
    """50 000, in seconds."""
    many = 50_000
    rows = "".join(f'<param name="p{number}" value="{number}"/>' for number in range(many))
    (network.folder / "many.launch").write_text(f"<launch>{rows}</launch>")
    done = limited(network.folder, "launch", "--dump-params", "many.launch")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("\n") >= many
    node = network.node("reader")
    launch = network.run("-m", "rosz", "launch", str(network.folder / "many.launch"))
    eventually(lambda: node.params.get(f"/p{many - 1}", None) == many - 1, "the last parameter")
    launch.close()
