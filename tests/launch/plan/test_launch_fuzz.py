"""Any bytes give a plan, or an error with a place."""

from __future__ import annotations

import random
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rosz.errors import LaunchFileError
from rosz.launch.plan import LaunchText, Plan, describe_args, loader, plan, substitution

from .corpus import FILES, VALID
from .fake_context import FakeContext

SEEDS = [case.path.read_bytes() for case in VALID if "pass_all" not in case.name]
PIECES = [
    *(b"<", b">", b"/>", b'"', b"'", b"&amp;", b"&#0;", b"<!--", b"-->", b"<![CDATA[", b"]]>"),
    *(b"$(", b")", b"$(arg ", b"$(eval ", b"$(find robot)", b"~", b"//", b"\x00", b"\xff", b"\n"),
    *(b"<group ns='a'>", b"</group>", b"<rosparam>", b"</rosparam>", b"<node ", b" name='", b"="),
    *(b"[1, {a: ", b"!!binary ", b"&a [*a]", b"1e999", b"-", b"<launch>", b"</launch>"),
]


def read(data: bytes) -> Plan | LaunchFileError:
    outside = FakeContext({str(path): path.read_text() for path in FILES.rglob("*.yaml")})
    try:
        found = plan([LaunchText(data)], {"foo": "1"}, outside)
    except LaunchFileError as error:
        return error
    describe_args([LaunchText(data)], {"foo": "1"}, outside)
    return found


@given(data=st.binary(max_size=80) | st.lists(st.sampled_from(PIECES), max_size=30).map(b"".join))
@settings(max_examples=200)
def test_any_bytes(data: bytes) -> None:
    found = read(data)
    assert isinstance(found, Plan) or found.path


@given(seed=st.sampled_from(SEEDS), chance=st.integers(0, 2**32))
@settings(max_examples=400)
def test_damaged_launch_files(seed: bytes, chance: int) -> None:
    dice = random.Random(chance)
    data = bytearray(seed)
    for _ in range(dice.randint(1, 4)):
        start = dice.randrange(len(data) + 1)
        end = start + dice.choice([0, 0, 1, 5])
        data[start:end] = dice.choice([b"", *PIECES])
    found = read(bytes(data))
    if isinstance(found, LaunchFileError) and found.path == "<stdin>":
        assert found.line >= 0
        assert found.line <= data.count(b"\n") + 2


@given(text=st.text(alphabet="$()argevl findo'\\\" /~1.", max_size=40))
@settings(max_examples=300)
def test_any_value(text: str) -> None:
    from xml.sax.saxutils import quoteattr

    body = f'<launch><arg name="a" value="b"/><param name="p" value={quoteattr(text)}/></launch>'
    found = read(body.encode())
    if isinstance(found, LaunchFileError):
        assert found.line == 1
        assert 30 <= found.column <= len(body)


CONDITIONS = [
    "",
    ' if="$(eval n &lt; 3)"',
    ' if="$(eval n &lt; 40)"',
    ' if="$(eval n &lt; 400)"',
    ' unless="$(eval len(x) &lt; 99)"',
    ' ns="$(arg x)"',
    ' pass_all_args="true"',
]
VALUES = ["$(arg x)", "$(arg x)$(arg x)", "$(eval x * 2)", "$(dirname)", "$(anon x)", "x"]


@st.composite
def including(draw: st.DrawFn) -> dict[str, str]:
    """Return the texts of files that include each other, under conditions, and pass args on."""
    count = draw(st.integers(1, 5))
    files: dict[str, str] = {}
    for number in range(count):
        text = '<arg name="x" default="x"/><arg name="n" default="0"/><param name="p" value="1"/>'
        for _ in range(draw(st.integers(0, 3))):
            to, condition = draw(st.integers(0, count - 1)), draw(st.sampled_from(CONDITIONS))
            text += f'<include file="$(dirname)/{to}"{condition}>'
            text += f'<arg name="x" value="{draw(st.sampled_from(VALUES))}"/>'
            text += '<arg name="n" value="$(eval n + 1)"/></include>'
        files[f"/{number}"] = f"<launch>{text}</launch>"
    return files


@given(files=including())
@settings(max_examples=100)
def test_files_that_include_each_other(files: dict[str, str]) -> None:
    """Each ends, in a number of steps that is limited."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loader, "MAX_INCLUDED", 2000)
        patch.setattr(substitution, "_MOST_CHARACTERS", 100_000)
        for faults in [None, list[LaunchFileError]()]:
            with suppress(LaunchFileError):
                plan(["/0"], {}, FakeContext(files), faults=faults)


def test_includes_that_double() -> None:
    include = "<include file='/{}'/>"
    files = {f"/{n}": f"<launch>{include.format(n + 1) * 2}</launch>" for n in range(40)}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loader, "MAX_INCLUDED", 2000)
        for faults in [None, list[LaunchFileError]()]:
            with pytest.raises(LaunchFileError, match="included files have more than 2000 tags"):
                plan(["/0"], {}, FakeContext({**files, "/40": "<launch/>"}), faults=faults)
