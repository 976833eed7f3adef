"""Type hashes against constants from ROS 2 and against rosbags."""

from __future__ import annotations

import pytest

from rosz.idl import Field, FieldType, MessageSpec, ServiceSpec, message_hash, service_hash
from rosz.typestore import TypeStore

from .definitions import catalog_of, names, shipped

# From ROS 2's own documents, captured tokens, and an independent implementation of the rules.
MESSAGES = {
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "std_msgs/msg/Header": "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
    "std_msgs/msg/Empty": "20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
    "std_msgs/msg/Char": "3ad2d04dd29ba19d04b16659afa3ccaedd691914b02a64e82e252f2fa6a586a9",
    "geometry_msgs/msg/Twist": "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    "nav_msgs/msg/Odometry": "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "sensor_msgs/msg/Image": "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
    "rcl_interfaces/msg/Log": "e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac",
    "rcl_interfaces/msg/ParameterEvent": (
        "043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204"
    ),
    "action_msgs/msg/GoalStatusArray": (
        "6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e"
    ),
    "rosgraph_msgs/msg/Clock": "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "tf2_msgs/msg/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}
SERVICES = {
    "example_interfaces/srv/AddTwoInts": (
        "e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
    ),
    "std_srvs/srv/Trigger": "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
    "std_srvs/srv/SetBool": "abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a",
    "std_srvs/srv/Empty": "5888399dedec5ccc85ea6451949fd2c9f97bfdf963f9a588821639fcd31b5d19",
    "action_msgs/srv/CancelGoal": (
        "573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a"
    ),
    "rcl_interfaces/srv/DescribeParameters": (
        "845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff"
    ),
    "rcl_interfaces/srv/GetParameterTypes": (
        "da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca"
    ),
    "rcl_interfaces/srv/GetParameters": (
        "bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc"
    ),
    "rcl_interfaces/srv/ListParameters": (
        "3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d"
    ),
    "rcl_interfaces/srv/SetParameters": (
        "56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0"
    ),
    "rcl_interfaces/srv/SetParametersAtomically": (
        "0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd"
    ),
    "type_description_interfaces/srv/GetTypeDescription": (
        "69b9c19c1021405984cc60dbbb1edceb147a6538b411d812ba6afabeed962cd5"
    ),
}
UNLIKE_ROSBAGS = {  # its char is IDL's
    "std_msgs/msg/Char",
    "service_msgs/msg/ServiceEventInfo",
}


@pytest.mark.parametrize(("name", "expected"), MESSAGES.items())
def test_messages(name: str, expected: str) -> None:
    assert TypeStore().message(name)._type_hash == f"RIHS01_{expected}"


@pytest.mark.parametrize(("name", "expected"), SERVICES.items())
def test_services(name: str, expected: str) -> None:
    assert TypeStore().service(name)._type_hash == f"RIHS01_{expected}"


def test_bounds_and_shapes() -> None:
    text = "string<=8[] a\nwstring<=3 b\nQ[<=1] c\nfloat64[] d\nbyte[2] e"
    catalog = catalog_of({"p/msg/A": text, "p/msg/Q": "int32 x"})
    from rosz.idl import describe

    fields = describe(catalog.message("p/msg/A"))["fields"]
    kinds = [field["type"] for field in fields]
    assert [kind["type_id"] for kind in kinds] == [165, 22, 97, 155, 64]
    assert [kind["capacity"] for kind in kinds] == [0, 0, 1, 0, 2]
    assert [kind["string_capacity"] for kind in kinds] == [8, 3, 0, 0, 0]
    assert [kind["nested_type_name"] for kind in kinds] == ["", "", "p/msg/Q", "", ""]


def test_services_of_an_action() -> None:
    """Hash the get_result service of a Fibonacci action, put together by hand."""
    texts = {
        name: shipped().message(name).text
        for name in ("service_msgs/msg/ServiceEventInfo", "builtin_interfaces/msg/Time")
    }
    prefix = "action_tutorials_interfaces/action/Fibonacci"
    result = f"{prefix}_Result"
    texts |= {"unique_identifier_msgs/msg/UUID": "uint8[16] uuid", result: "int32[] sequence"}
    catalog = catalog_of(texts)
    service = ServiceSpec(
        f"{prefix}_GetResult",
        MessageSpec(
            f"{prefix}_GetResult_Request",
            (Field("goal_id", FieldType("unique_identifier_msgs/msg/UUID")),),
        ),
        MessageSpec(
            f"{prefix}_GetResult_Response",
            (Field("status", FieldType("int8")), Field("result", FieldType(result))),
        ),
    )
    assert service_hash(service, catalog) == (
        "RIHS01_8b47e383f1e31f6d8df6417ab54957e7d5ea24dad315646ad711ac3fdea81d58"
    )


def test_comments_constants_and_defaults_do_not_count() -> None:
    plain = catalog_of({"p/msg/A": "int32 x"})
    rich = catalog_of({"p/msg/A": "# c\nint32 Y=5\nint32 x 7 # d"})
    assert message_hash(plain.message("p/msg/A"), plain) == message_hash(
        rich.message("p/msg/A"), rich
    )


def test_as_rosbags_has_them() -> None:
    rosbags = pytest.importorskip("rosbags.typesys", reason="needs rosbags")
    store = rosbags.get_typestore(rosbags.Stores.ROS2_JAZZY)
    known = [name for name in names("msg") if name in store.types]
    assert len(known) > 150
    ours = {name: TypeStore().message(name)._type_hash for name in known}
    theirs = {name: store.hash_rihs01(name) for name in known}
    assert {name for name in known if ours[name] != theirs[name]} == UNLIKE_ROSBAGS
