"""What ROS 2 makes of an action: names, hashes and bytes, beside rosbags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from rosz.errors import DefinitionError, TypeNotFound
from rosz.message import Message
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.packages import PackageIndex
from rosz.typestore import TypeStore

from .test_generate import package

# As rosidl wrote them into builds of ROS 2 Jazzy; from captured keys.
PUBLISHED = {
    "Fibonacci_SendGoal_Request": (
        "3d088942b413247db536576f0286768c6be8fcd5d0c9a5d544f359fba090a238"
    ),
    "Fibonacci_GetResult_Request": (
        "c8a4f5e7d13b81286ee1043e2ecd084281cecf1ff06aaa799464f5f15479f003"
    ),
    "Fibonacci_FeedbackMessage": "c1de71afd52e49a89c53d8262366884185bc0a02f78ce051c4e46b0a7fe59bb2",
    "Fibonacci_SendGoal": "d1a57fb2a4afe8c21e34fb10db206f16ce6729b28531141472df92277c55b557",
}

NAVIGATE = """
geometry_msgs/PoseStamped pose
string behavior_tree
---
uint16 NONE=0
uint16 error_code
---
geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
builtin_interfaces/Duration estimated_time_remaining
int16 number_of_recoveries
float32 distance_remaining
"""
FOLLOW = """
trajectory_msgs/JointTrajectory trajectory
trajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory
JointTolerance[] path_tolerance
JointTolerance[] goal_tolerance
builtin_interfaces/Duration goal_time_tolerance
---
int32 error_code
int32 SUCCESSFUL = 0
int32 INVALID_GOAL = -1
string error_string
---
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint desired
trajectory_msgs/JointTrajectoryPoint actual
trajectory_msgs/JointTrajectoryPoint error
"""
TOLERANCE = "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n"
DOCK = "---\n---\n"  # three empty parts: each is one byte on the wire

ACTIONS = [
    "example_interfaces/action/Fibonacci",
    "actionlib/action/TestRequest",
    "nav_msgs/action/GetMap",
    "tf2_msgs/action/LookupTransform",
    "nav2_msgs/action/NavigateToPose",
    "control_msgs/action/FollowJointTrajectory",
    "control_msgs/action/Dock",
]
MESSAGES = (
    "Goal",
    "Result",
    "Feedback",
    "FeedbackMessage",
    "SendGoal_Request",
    "SendGoal_Response",
    "GetResult_Request",
    "GetResult_Response",
)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> TypeStore:
    root = tmp_path_factory.mktemp("packages")
    package(root, "nav2_msgs", NavigateToPose_action=NAVIGATE)
    package(
        root,
        "control_msgs",
        FollowJointTrajectory_action=FOLLOW,
        Dock_action=DOCK,
        JointTolerance_msg=TOLERANCE,
    )
    return TypeStore(PackageIndex([root]))


@pytest.fixture(scope="module")
def oracle() -> Any:
    """Return rosbags' types of Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


def half(store: TypeStore, action: str, name: str) -> Any:
    """Return a message that is made of an action."""
    service, _, role = name.partition("_")
    cls = store.action(action)
    return getattr(getattr(cls, service), role) if role else getattr(cls, service)


def register(oracle: Any, cls: type[Message]) -> None:
    """Give rosbags the text of a type, and of all in it that it lacks."""
    for _, kind, _ in cls._schema:
        if isinstance(kind, type):
            register(oracle, kind)
    if cls._type_name not in oracle.fielddefs:
        # In the text of an action, a bare name is a message.
        oracle.register(get_types_from_msg(cls._text, cls._type_name.replace("/action/", "/msg/")))
        fields = oracle.fielddefs[cls._type_name.replace("/action/", "/msg/")]
        oracle.register({cls._type_name: fields})


@pytest.mark.parametrize("action", ACTIONS)
@pytest.mark.parametrize("name", MESSAGES)
def test_hash_and_bytes_are_those_of_rosbags(
    store: TypeStore, oracle: Any, action: str, name: str
) -> None:
    cls = half(store, action, name)
    assert cls._type_name == f"{action}_{name}"
    register(oracle, cls)
    assert cls._type_hash == oracle.hash_rihs01(cls._type_name)
    message = filled(cls)
    written = message.to_cdr()
    assert bytes(oracle.serialize_cdr(to_oracle(oracle, message), cls._type_name)) == written
    assert cls.from_cdr(written).to_cdr() == written


def filled(cls: Any) -> Any:
    """Return a message with a value in each field, and two in each sequence."""

    def value(kind: Any) -> Any:
        if isinstance(kind, type):
            return filled(kind)
        if kind.startswith("string"):
            return "word"
        return 1.5 if kind.startswith("float") else kind == "bool" or 7

    def values(kind: Any, suffix: str) -> Any:
        size = int(suffix.strip("[]") or 2)
        many = [value(kind)] * size
        return bytes(many) if kind in ("uint8", "byte") else many

    return cls(
        **{
            name: values(kind, suffix) if suffix else value(kind)
            for name, kind, suffix in cls._schema
        }
    )


def to_oracle(oracle: Any, message: Message) -> Any:
    """Return a message of rosz as one of rosbags."""
    import numpy as np

    def value(one: Any, kind: Any, suffix: str) -> Any:
        if isinstance(kind, type):
            return [to_oracle(oracle, each) for each in one] if suffix else to_oracle(oracle, one)
        numeric = suffix and not kind.startswith("string")
        types = {"float64": np.float64, "int32": np.int32, "uint8": np.uint8, "int8": np.int8}
        return np.array(list(one), types[kind]) if numeric else one

    cls = type(message)
    values = [value(getattr(message, name), kind, suffix) for name, kind, suffix in cls._schema]
    if not values:
        values = [0]
    return oracle.types[cls._type_name](*values)


@pytest.mark.parametrize(("name", "expected"), PUBLISHED.items())
def test_published_hashes(name: str, expected: str) -> None:
    import rosz.msgs.example_interfaces.action as module

    assert getattr(module, name)._type_hash == f"RIHS01_{expected}"


def test_bytes_of_fibonacci() -> None:
    uuid = bytes(range(16))
    request = Fibonacci.SendGoal.Request(goal=Fibonacci.Goal(order=5))
    request.goal_id.uuid = uuid
    assert request.to_cdr() == b"\0\1\0\0" + uuid + b"\5\0\0\0"
    response = Fibonacci.GetResult.Response(4, Fibonacci.Result([1, 2]))
    assert response.to_cdr() == bytes.fromhex("00010000 04000000 02000000 01000000 02000000")
    feedback = Fibonacci.FeedbackMessage(feedback=Fibonacci.Feedback([7]))
    feedback.goal_id.uuid = uuid
    assert feedback.to_cdr() == b"\0\1\0\0" + uuid + bytes.fromhex("01000000 07000000")


def test_types_by_name(store: TypeStore) -> None:
    assert store.action("example_interfaces/Fibonacci") is Fibonacci
    name = "example_interfaces/action/Fibonacci"
    assert store.message(f"{name}_Feedback") is Fibonacci.Feedback
    assert store.service(f"{name}_GetResult") is Fibonacci.GetResult
    assert store.names("action", "nav2_msgs") == ["nav2_msgs/NavigateToPose"]
    compiled = store.action("nav2_msgs/NavigateToPose")
    assert store.message("nav2_msgs/action/NavigateToPose_Goal") is compiled.Goal
    assert store.service("nav2_msgs/action/NavigateToPose_SendGoal") is compiled.SendGoal


@pytest.mark.parametrize("name", ["nav2_msgs/action/NavigateToPose", "nav2_msgs/action/None_Goal"])
def test_what_is_no_message(store: TypeStore, name: str) -> None:
    with pytest.raises(TypeNotFound):
        store.message(name)


def test_a_service_of_an_action_is_no_message(store: TypeStore) -> None:
    with pytest.raises(TypeNotFound, match="not the name of a msg"):
        store.message("example_interfaces/action/Fibonacci_SendGoal")


def test_errors_name_the_line_of_the_file(tmp_path: Path) -> None:
    package(tmp_path, "wrong", Do_action="int32 a\n---\nint32 b\n---\nfloat c\n")
    with pytest.raises(DefinitionError, match=r"Do\.action:5"):
        TypeStore(PackageIndex([tmp_path])).action("wrong/Do")


def test_type_from_the_texts_of_another_node(store: TypeStore) -> None:
    name = "far_msgs/action/Do_FeedbackMessage"
    text = "unique_identifier_msgs/msg/UUID goal_id\nfar_msgs/action/Do_Feedback feedback\n"
    cls: Any = store.message_from_text(name, text, {"far_msgs/action/Do_Feedback": "int8 x"})
    made = cls.from_cdr(cls().to_cdr())
    assert made.feedback.x == 0
    known = store.action("control_msgs/FollowJointTrajectory").FeedbackMessage
    assert store.message_from_text(known._type_name, known._text) is known
