from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosz.errors import DecodeError
from rosz.qos import CLOCK, DEFAULT, LATCHED, PARAMETERS, ROSOUT, SENSOR_DATA, QoS
from rosz.wire import (
    Kind,
    ProcessToken,
    Token,
    dds_type,
    entity_key,
    format_process,
    format_qos,
    format_token,
    gid,
    parse_process,
    parse_qos,
    parse_token,
    ros_type,
)

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
LOG_HASH = "RIHS01_e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac"
ADD_HASH = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"

TOKENS = [
    (
        "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener",
        Token(0, "aac3178e146ba6f1fc6e6a4085e77f21", 0, 0, Kind.NODE, "/", "listener"),
        "5bd72f4daf53c0bb00c7394e7fc19547",
    ),
    (
        "@ros2_lv/0/7c5037777c3984c9cda2bf1988d2f02/0/10/MP/%/%robot1/talker/%robot1%chatter/"
        f"std_msgs::msg::dds_::String_/{STRING_HASH}/::,10:,:,:,,",
        Token(
            0,
            "7c5037777c3984c9cda2bf1988d2f02",
            0,
            10,
            Kind.PUBLISHER,
            "/robot1",
            "talker",
            name="/robot1/chatter",
            type_name="std_msgs/msg/String",
            type_hash=STRING_HASH,
            qos=DEFAULT,
        ),
        "199bdb6e2a4bef544af82bd3f5ca5f86",
    ),
    (
        "@ros2_lv/0/e1dc8d1b45ae8717fce78689cc655685/0/10/SC/%/%/add_two_ints_client/%add_two_ints/"
        f"example_interfaces::srv::dds_::AddTwoInts_/{ADD_HASH}/::,10:,:,:,,",
        Token(
            0,
            "e1dc8d1b45ae8717fce78689cc655685",
            0,
            10,
            Kind.CLIENT,
            "/",
            "add_two_ints_client",
            name="/add_two_ints",
            type_name="example_interfaces/srv/AddTwoInts",
            type_hash=ADD_HASH,
            qos=DEFAULT,
        ),
        "26970b3b2b7cf4e3c6219b0549875e8c",
    ),
    (
        "@ros2_lv/0/943f9ebc32acd3e072bfda12ce8c7ed2/0/1/MP/%/%/_ros2cli_31/%rosout/"
        f"rcl_interfaces::msg::dds_::Log_/{LOG_HASH}/:1:,1000:,:10,0:,,",
        Token(
            0,
            "943f9ebc32acd3e072bfda12ce8c7ed2",
            0,
            1,
            Kind.PUBLISHER,
            "/",
            "_ros2cli_31",
            name="/rosout",
            type_name="rcl_interfaces/msg/Log",
            type_hash=LOG_HASH,
            qos=ROSOUT,
        ),
        None,
    ),
]


@pytest.mark.parametrize(("key", "token", "digest"), TOKENS)
def test_tokens_both_ways(key: str, token: Token, digest: str | None) -> None:
    assert format_token(token) == key
    assert parse_token(key) == token
    if digest is not None:
        assert gid(key).hex() == digest


def test_a_reader_takes_further_chunks() -> None:
    key, token, _ = TOKENS[1]
    assert parse_token(key + "/backends:cpu") == token


DAMAGED = {
    "chatter": "has 1 chunks, expected 9 or 13",
    "@ros2_lv/0/a/0/0/NN/%/%": "has 8 chunks",
    "@ros2_lv/0/a//0/NN/%/%/n": "has an empty chunk",
    "@ros2_lv/0/a/0/0/XX/%/%/n": "'XX' is not a valid Kind",
    "@ros2_lv/zero/a/0/0/NN/%/%/n": "invalid literal",
    "@ros2_lv/0/*/0/0/NN/%/%/n": "or a wildcard",
    "@ros2_lv/0/a/0/0/NN/%/%/n\n/other": r"n\\n.* a line feed",
    "@ros2_lv/0/a/0/1/MP/%/%/n/**/s::msg::dds_::S_/h/::,1:,:,:,,": "or a wildcard",
    **dict.fromkeys(
        (
            f"@ros2_lv/0/a/0/1/MP/%/%/n/{name}/s::msg::dds_::S_/h/::,1:,:,:,,"
            for name in ("%", "%%", "%t%", "%t%%u", "é" * 512)
        ),
        "no endpoint can have this name",
    ),
    "@ros2_lv/0/a/0/1/MP/%/%/n": "has 9 chunks, expected 13",
    "@ros2_lv/0/a/0/1/MP/%/%/n/%t/String/h/::,1:,:,:,,": "expected 'package::msg::dds_::Name_'",
    "@ros2_lv/0/a/0/1/MP/%/%/n/%t/s::msg::dds_::S_/h/1:1": "QoS chunk",
    "@ros2_lv/0/a/0/1/MP/%/%/n/%t/s::msg::dds_::S_/h/9::,1:,:,:,,": "a value that is not known",
}


@pytest.mark.parametrize(("key", "reason"), DAMAGED.items())
def test_damaged_tokens(key: str, reason: str) -> None:
    with pytest.raises(DecodeError, match=reason):
        parse_token(key)


@given(st.text())
def test_any_text_is_a_token_or_refused(text: str) -> None:
    for candidate in (text, f"@ros2_lv/0/a/0/1/MP/%/%/n/%t/s::msg::dds_::S_/h/{text}"):
        try:
            parse_token(candidate)
        except DecodeError:
            continue


PROFILES = [
    (DEFAULT, "::,10:,:,:,,"),
    (SENSOR_DATA, "2::,5:,:,:,,"),
    (LATCHED, ":1:,1:,:,:,,"),
    (PARAMETERS, "::,1000:,:,:,,"),
    (ROSOUT, ":1:,1000:,:10,0:,,"),
    (CLOCK, "2::,1:,:,:,,"),
    (QoS(depth=42, history="keep_all"), "::2,:,:,:,,"),
    (QoS(depth=42), "::,:,:,:,,"),
    (QoS(deadline=100_000_000), "::,10:0,100000000:,:,,"),
]


@pytest.mark.parametrize(("qos", "chunk"), PROFILES)
def test_qos_profiles(qos: QoS, chunk: str) -> None:
    assert format_qos(qos) == chunk
    assert parse_qos(chunk) == qos


def test_unset_durations_mean_forever() -> None:
    assert format_qos(QoS(deadline=0, lifespan=0, lease=0)) == "::,10:,:,:,,"


@pytest.mark.parametrize("name", ["std_msgs/msg/String", "a/srv/B", "a/action/B_SendGoal"])
def test_type_names_both_ways(name: str) -> None:
    assert ros_type(dds_type(name)) == name


def test_keys() -> None:
    expected = f"0/robot1/chatter/std_msgs::msg::dds_::String_/{STRING_HASH}"
    assert entity_key(0, "/robot1/chatter", "std_msgs/msg/String", STRING_HASH) == expected
    assert entity_key(7, "/a", "*", "*") == "7/a/*/*"


def test_process_tokens() -> None:
    token = ProcessToken(3, "ab", 4, 5, 6, "robo-1.lan", "/ns/talker")
    key = "@rosz/3/node/ab/4/5/6/robo-1.lan/%ns%talker"
    assert format_process(token) == key
    assert parse_process(key) == token


def test_which_process_is_newer() -> None:
    a = ProcessToken(0, "ab", 0, 100, 1, "h", "/n")
    b = ProcessToken(0, "aa", 0, 101, 1, "h", "/n")
    c = ProcessToken(0, "ac", 0, 100, 1, "h", "/n")
    assert b.newer_than(a)
    assert not a.newer_than(b)
    assert c.newer_than(a)
    assert not a.newer_than(c)


@pytest.mark.parametrize("key", ["@rosz/0/node/a", "@rosz/x/node/a/0/0/0/h/%n"])
def test_damaged_process_tokens(key: str) -> None:
    with pytest.raises(DecodeError, match="process token"):
        parse_process(key)
