"""No text of a definition reaches generated source unquoted: whatever it says, the module runs."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rosz.errors import DefinitionError, TypeNotFound
from rosz.idl import Catalog, Definition
from rosz.idl.generate import message_module, service_module, shipped_module
from rosz.typestore import TypeStore

from .test_grammar import FRAGMENTS

STORE = TypeStore()


def module_of(text: str, kind: str = "msg") -> Any:
    """Return the module that is generated from a definition."""
    name = f"written/{kind}/It"

    def find(wanted: str) -> Definition:
        if wanted == name:
            return Definition(text, name)
        if wanted.startswith("written/"):
            raise TypeNotFound(wanted)
        return STORE.definition(wanted)

    catalog = Catalog(find)
    if kind == "msg":
        source = message_module([catalog.message(name)], catalog, shipped_module, "written")
    else:
        source = service_module([catalog.service(name)], catalog, shipped_module, "written")
    source.encode()
    module = ModuleType("written")
    exec(compile(source, "<written>", "exec"), module.__dict__)
    return module


def words_of(text: str) -> list[str]:
    return text.replace('"', "'").split()


LONG = "set by (the driver, or by nobody) if [it, or its maker] knows, {one, way}, " * 4


@pytest.mark.parametrize(
    "last",
    [LONG, LONG + '"', '"""', "\\", "\\u12", "ends with a quote'", "\0", "\f", "\x85", "\\N{x}"],
)
def test_comments_that_have_broken_modules(last: str) -> None:
    text = f"# A head\n# {last}\nint32 x\n"
    cls = module_of(text).It
    assert cls(x=5) == cls.from_cdr(cls(x=5).to_cdr())
    assert cls._text == text
    assert "A head" in cls.__doc__
    assert max(map(len, cls.__doc__.splitlines())) < 400


COMMENTS = st.lists(
    st.one_of(
        st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\n\r")),
        st.lists(st.sampled_from([LONG, '"', "'", "\\", '"""', " ", "\0", "n", "if ", " or "])).map(
            "".join
        ),
    ),
    min_size=1,
    max_size=4,
)


@given(COMMENTS)
def test_any_comment_becomes_a_docstring(comment: list[str]) -> None:
    text = "".join(f"#{line}\n" for line in comment) + "int32 x # " + "".join(comment) + "\n"
    for module in (module_of(text), module_of(f"{text}---\n", "srv")):
        cls = module.It
        assert cls._text in (text, f"{text}---\n")
        first = comment[0].splitlines()[0].strip("# \t") if comment[0].splitlines() else ""
        if first:
            assert words_of(cls.__doc__)[:1] == words_of(first)[:1]
        else:
            assert "#" not in (cls.__doc__ or "")


@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\n\r"), max_size=200))
def test_any_text_may_be_a_constant_and_a_default(value: str) -> None:
    quoted = value.replace("\\", "\\\\").replace("'", "\\'")
    text = f"string<=800 a '{quoted}'\nstring[] b ['{quoted}', x]\nstring C={quoted}\n"
    cls = module_of(text).It
    assert (cls().a, cls().b) == (value, [value, "x"])
    assert quoted.strip() == cls.C


@pytest.mark.parametrize(
    "text",
    [
        "Header Header\nHeader p",
        "float64 Point\ngeometry_msgs/Point[2] b\ngeometry_msgs/Point c",
        "int32 Pose=1\ngeometry_msgs/Pose[] poses\ngeometry_msgs/Pose one",
        "float32 bytes\nuint8[2] data [40, 44]",
        "uint8[] data [" + "40, 44, 32, " * 60 + "41]",
        "bool list\nint32 range\nfloat64[3] float\ngeometry_msgs/Point[2] points",
    ],
)
def test_fields_may_have_the_names_of_classes(text: str) -> None:
    cls = module_of(text).It
    assert cls.from_cdr(cls().to_cdr()).to_cdr() == cls().to_cdr()


@settings(max_examples=300)
@given(st.lists(FRAGMENTS, max_size=30).map("".join))
def test_any_definition_runs_or_is_refused(text: str) -> None:
    try:
        cls = module_of(text).It
    except DefinitionError:
        return
    assert cls.from_cdr(cls().to_cdr()).to_cdr() == cls().to_cdr()
