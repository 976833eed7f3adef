"""Random launch files: groups, includes, args, params and nodes in all combinations."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import msgspec
from hypothesis import strategies as st

_NAMES = ["a", "b", "c", "/g", "x/y", "~p", "n//m/"]
_ARGS = ["foo", "bar", "baz"]
_MORE_ARGS = ["new", "newer", "newest", "latest", "foo"]
_BASES = ["one", "two", "three", "four", "five", "six", "seven", "eight", "nine"]
_VALUES = [
    *("1", "-2", "3.5", "true", "False", "text", "", " padded ", "1e3", "a b", "0x1", "[1, 2]"),
    *("$(arg foo)", "$(arg bar)", "x$(arg baz)y", "$(optenv HOME)", "$(optenv ROSZ_NONE d e)"),
    *("$(find demo_robot)/config", "$(anon q)", "$(eval 1 + 2)", "$(eval foo)", "$(dirname)"),
    *("$(eval arg('bar') * 2)", "$$(arg foo)", "$(arg foo"),
]
_GIVEN = ["7", "true", "0", "word", "", "two words", "a:=b"]
_CONDITIONS = ["true", "false", "1", "0", "$(eval not true)", "$(eval 1 < 2)", "TRUE"]
_BOOLS = ["true", "false", "True", "FALSE", "$(eval not true)"]
_YAML = ["a: 1", "{b: [1, 2], c: {d: x}}", "", "x: $(arg foo)", "'a/b': 1", "a: {}"]


class Tree(msgspec.Struct, frozen=True):
    """Some files that include each other.

    Attributes:
        files: Texts by name; the first one is read.
        argv: The command line.
    """

    files: dict[str, str]
    argv: tuple[str, ...]

    def write(self, folder: Path) -> str:
        """Write the files and return the name of the first."""
        for name, text in self.files.items():
            (folder / name).write_text(text)
        return next(iter(self.files))


def _tag(name: str, attributes: dict[str, str | None], body: str = "") -> str:
    written = "".join(
        f" {key}={quoteattr(value)}" for key, value in attributes.items() if value is not None
    )
    return f"<{name}{written}>{body}</{name}>" if body else f"<{name}{written}/>"


def _mostly(good: list[str], *bad: str) -> st.SearchStrategy[str]:
    return st.sampled_from([*(good * 8), *bad])


def _maybe(
    values: st.SearchStrategy[str] | st.SearchStrategy[str | None],
) -> st.SearchStrategy[str | None]:
    # Absent far more often than not, so that most files have something left after conditions.
    return st.one_of(st.none(), st.none(), st.none(), st.none(), values)


_value = _mostly(_VALUES, "$(env ROSZ_NONE)", "$(arg)", "$(nil)", "$(eval 1 / 0)")
_plain = st.sampled_from(_VALUES[:17])
_bool = _mostly(_BOOLS, "1", "")
_condition = st.fixed_dictionaries(
    {
        "if": _maybe(_mostly(_CONDITIONS, "$(arg bar)", "nope")),
        "unless": _maybe(_maybe(_mostly(_CONDITIONS, ""))),
    }
)
_ns = _maybe(_mostly(["r", "/abs", "deep/er", "r//x/"], "$(arg foo)", "~", ""))


@st.composite
def _simple(draw: st.DrawFn, *, in_node: bool = False) -> str:
    kinds = ["param", "param", "rosparam", "remap", "env"]
    kind = draw(st.sampled_from(kinds if in_node else [*kinds, "arg", "oddity"]))
    attributes: dict[str, str | None] = {}
    body = ""
    if kind == "param":
        attributes["name"] = draw(st.sampled_from(_NAMES))
        attributes["value"] = draw(_value)
        attributes["type"] = draw(_maybe(_mostly(["str", "string", "auto"], "int", "bool", "yaml")))
    elif kind == "rosparam":
        attributes["param"] = draw(_maybe(st.sampled_from(_NAMES)))
        attributes["ns"] = draw(_maybe(st.sampled_from(_NAMES)))
        attributes["subst_value"] = draw(_maybe(st.sampled_from(["true", "false"])))
        attributes["command"] = draw(_maybe(st.sampled_from(["load", "delete"])))
        body = draw(_mostly(_YAML, "[1, 2]", "3", "[", "1: 2"))
    elif kind == "remap":
        attributes["from"] = draw(st.sampled_from(_NAMES))
        attributes["to"] = draw(_mostly(_NAMES, "$(arg foo)", ""))
    elif kind == "env":
        attributes["name"] = draw(st.sampled_from(["E", "F", "ROS_X"]))
        attributes["value"] = draw(_plain)
    elif kind == "arg":
        attributes["name"] = draw(st.sampled_from(_MORE_ARGS))
        how = draw(st.sampled_from(["default", "default", "default", "value", "doc"]))
        attributes[how] = draw(_plain)
    else:
        return draw(st.sampled_from(["<nod/>", "<master/>", "text", "<!-- comment -->"]))
    return _tag(kind, {**attributes, **draw(_condition)}, body)


@st.composite
def _process(draw: st.DrawFn) -> str:
    test = draw(st.integers(0, 9)) == 0
    attributes: dict[str, str | None] = {
        "pkg": "demo_nodes",
        "type": draw(st.sampled_from(["talker.py", "listener"])),
        "name": draw(_mostly([*_BASES, "$(anon z)"], "$(arg foo)", "", "a/b")),
        "ns": draw(_ns),
        "args": draw(_maybe(_mostly(["-x 'a b'", "$(arg foo) $(anon q)"], "open '"))),
        "clear_params": draw(_maybe(_bool)),
        "cwd": draw(_maybe(_mostly(["node", "ROS_HOME"], "elsewhere"))),
        "launch-prefix": draw(_maybe(st.sampled_from(["nice", "env X='1 2'"]))),
        "machine": draw(_maybe(_maybe(st.sampled_from(["m1", "m2"])))),
        "required": draw(_maybe(_bool)),
        **draw(_condition),
    }
    if test:
        attributes["test-name"] = draw(st.sampled_from(_BASES))
        attributes["retry"] = draw(_maybe(_mostly(["2"], "x")))
    else:
        attributes["output"] = draw(_maybe(_mostly(["screen", "log"], "both")))
        attributes["respawn"] = draw(_maybe(_bool))
        attributes["respawn_delay"] = draw(_maybe(_mostly(["1", "0.5"], "x")))
    body = "".join(draw(st.lists(_simple(in_node=True), max_size=4)))
    return _tag("test" if test else "node", attributes, body)


_machine = st.builds(
    lambda name, address, default: _tag(
        "machine", {"name": name, "address": address, "default": default}
    ),
    st.sampled_from(["m1", "m2"]),
    st.sampled_from(["127.0.0.1", "127.0.0.2"]),
    _maybe(st.sampled_from(["true", "never"])),
)


@st.composite
def _include(draw: st.DrawFn, target: str) -> str:
    attributes: dict[str, str | None] = {
        "file": draw(st.sampled_from([target, f"$(dirname)/{target}"])),
        "ns": draw(_ns),
        "pass_all_args": draw(_maybe(st.sampled_from(["true", "false"]))),
        "clear_params": draw(_maybe(_bool)),
        **draw(_condition),
    }
    passed = draw(st.lists(st.sampled_from(_ARGS), max_size=2, unique=True))
    body = "".join(_tag("arg", {"name": name, "value": draw(_plain)}) for name in passed)
    return _tag("include", attributes, body)


@st.composite
def _body(draw: st.DrawFn, targets: tuple[str, ...], depth: int = 0) -> str:
    kinds = ["simple"] * 6 + ["process"] * 3 + ["machine"]
    kinds += ["group"] * 3 if depth < 3 else []
    kinds += ["include"] * 3 if targets else []
    parts: list[str] = []
    for kind in draw(st.lists(st.sampled_from(kinds), max_size=6)):
        match kind:
            case "simple":
                parts.append(draw(_simple()))
            case "process":
                parts.append(draw(_process()))
            case "machine":
                parts.append(draw(_machine))
            case "include":
                parts.append(draw(_include(draw(st.sampled_from(targets)))))
            case _:
                attributes = {
                    "ns": draw(_ns),
                    "clear_params": draw(_maybe(_bool)),
                    **draw(_condition),
                }
                parts.append(_tag("group", attributes, draw(_body(targets, depth + 1))))
    return "\n".join(parts)


@st.composite
def launch_trees(draw: st.DrawFn) -> Tree:
    """Return files that include later ones, and a command line."""
    names = ("main.launch", "second.launch", "third.launch")
    files = {}
    for number, name in enumerate(names):
        declared = draw(st.sampled_from([_ARGS, _ARGS, _ARGS, _ARGS[:2], []]))
        head = "".join(_tag("arg", {"name": arg, "default": "1"}) for arg in declared)
        files[name] = f"<launch>\n{head}\n{draw(_body(names[number + 1 :]))}\n</launch>\n"
    argv = draw(
        st.lists(
            st.builds("{}:={}".format, st.sampled_from([*_ARGS, "_p"]), st.sampled_from(_GIVEN)),
            max_size=3,
        )
    )
    return Tree(files, tuple(argv))
