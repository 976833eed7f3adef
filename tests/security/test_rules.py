from __future__ import annotations

import json

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from rosz.errors import YamlError
from rosz.security import Permit, access_control, read_rules
from rosz.security.rules import NAME_VERBS


def test_all_forms() -> None:
    rules = read_rules(
        """
laptop:
  publish: /cmd_vel
  subscribe: [/odom, "/arm*/*", "/**"]
  get: true
operator: all
"*": {}
""",
        "rules.yaml",
    )
    laptop = Permit(publish=("/cmd_vel",), subscribe=("/odom", "/arm*/*", "/**"), get=True)
    assert rules.permits == {"laptop": laptop, "operator": Permit.all(), "*": Permit()}


def test_an_empty_file_allows_nothing() -> None:
    assert read_rules("# later\n", "rules.yaml").permits == {}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[]", "r:1:1: expected a mapping of key holders"),
        (
            "a: {publsh: [/b]}",
            "r:1:5: 'publsh' is not a permission; did you mean 'publish'?; expected",
        ),
        ("a: {publish: [b]}", "r:1:15: 'b' is not a pattern of global names"),
        ("a: {publish: [/a***]}", "r:1:15: '/a***' is not a pattern"),
        ("a: {publish: [/a**]}", "r:1:15: '/a**' is not a pattern"),
        ("a: {publish: [{}]}", "r:1:15: expected a name or a list of names"),
        ("a: {get: maybe}", "r:1:10: expected true or false"),
        ("a: some", "r:1:4: 'some'; expected 'all', or a mapping of permissions"),
        ("a: {}\na: all", "r:2:1: 'a' stands here twice"),
        ("a: [", "r:1:5: "),
        ("? [a]\n: all", "r:1:3: expected a name"),
    ],
)
def test_errors_name_line_and_column(text: str, message: str) -> None:
    with pytest.raises(YamlError) as caught:
        read_rules(text, "r")
    assert str(caught.value).startswith(message)


def allowed(rules: str, flow: str, message: str) -> set[str]:
    """Return the keys on which the holder ``a`` may send or receive a kind of message."""
    control = access_control(read_rules(rules, "r"), ["lo"])
    mine = [p["rules"] for p in control["policies"] if "holder a" in p["subjects"]]
    names = {name for part in mine for name in part}
    found = [
        rule["key_exprs"]
        for rule in control["rules"]
        if rule["id"] in names and flow in rule["flows"] and message in rule["messages"]
    ]
    return {key for keys in found for key in keys}


def test_access_control_of_rules() -> None:
    one = "a: {publish: [/arm/x], subscribe: ['/arm*/**'], call: [/go], set: ['/gains/**']}"
    assert "*/arm/x/*/*" in allowed(one, "ingress", "put")
    assert "*/arm/x/*/*" not in allowed(one, "egress", "put")
    assert "*/arm$*/*/*/**" in allowed(one, "egress", "put")
    assert "*/go/*/*" in allowed(one, "ingress", "query")
    assert "@rosz/*/change/*/gains/**" in allowed(one, "ingress", "put")
    assert "@rosz/*/change/*/**" not in allowed(one, "ingress", "put")
    assert "@ros2_lv/*/*/*/*/MP/*/*/*/%arm$*/**" in allowed(one, "egress", "liveliness_token")
    assert "@ros2_lv/*/*/*/*/MP/*/*/*/%arm%x/**" in allowed(one, "ingress", "liveliness_token")


def test_missed_writes_are_taken_only_from_who_may_get_and_set_everything() -> None:
    sync = "@rosz/*/store/*/sync"
    assert sync not in allowed("a: {get: true, set: ['/gains/**']}", "ingress", "reply")
    assert sync not in allowed("a: {set: ['/**']}", "ingress", "reply")
    assert sync in allowed("a: {get: true, set: ['/**']}", "ingress", "reply")
    tell = "@rosz/*/store/*/tell"
    part = allowed("a: {get: true, set: ['/gains/**']}", "ingress", "query")
    assert [key for key in part if key.startswith(tell)] == [f"{tell}/gains/**"]
    assert not any(tell in key for key in allowed("a: {set: ['/gains/**']}", "ingress", "query"))
    assert not any(tell in key for key in allowed("a: {get: true}", "ingress", "query"))


def test_process_tokens_need_control() -> None:
    process = "@rosz/*/node/**"
    everybody = "a: {subscribe: ['/**'], publish: ['/**'], set: ['/**']}"
    assert process in allowed(everybody, "egress", "liveliness_token")
    assert process not in allowed(everybody, "ingress", "liveliness_token")
    assert process in allowed("a: {control: true}", "ingress", "liveliness_token")


@given(
    st.lists(
        st.lists(st.sampled_from(["*", "**", "a", "b*", "*c", "d*e*"]), min_size=1, max_size=5).map(
            lambda chunks: "/" + "/".join(chunks)
        ),
        min_size=1,
        max_size=3,
    )
)
def test_zenoh_accepts_all_key_expressions(names: list[str]) -> None:
    verbs = ", ".join(f"{verb}: {json.dumps(names)}" for verb in NAME_VERBS)
    control = access_control(read_rules(f"a: {{{verbs}}}", "r"), ["lo"])
    for rule in control["rules"]:
        for key in rule["key_exprs"]:
            zenoh.KeyExpr(key)


@pytest.mark.parametrize(
    ("pattern", "topic", "within"),
    [
        ("/camera/**", "camera", True),
        ("/camera/**", "camera/left/image", True),
        ("/camera/**", "cameras", False),
        ("/**", "odom", True),
        ("/*/scan", "front/scan", True),
        ("/*/scan", "front/low/scan", False),
        ("/**/scan", "front/low/scan", True),
        ("/arm*/**", "arm_2/joints", True),
        ("/arm*/**", "leg/joints", False),
    ],
)
def test_patterns(pattern: str, topic: str, within: bool) -> None:
    key = zenoh.KeyExpr(f"0/{topic}/std_msgs::msg::dds_::String_/RIHS01_00")
    keys = allowed(f"a: {{publish: ['{pattern}']}}", "ingress", "put")
    assert any(zenoh.KeyExpr(one).includes(key) for one in keys) == within


def test_the_default_is_to_refuse() -> None:
    control = access_control(read_rules("", "r"), ["lo"])
    assert control["default_permission"] == "deny"
    assert [policy["subjects"] for policy in control["policies"]] == [
        ["interfaces of this machine", "sockets of this machine"]
    ]
