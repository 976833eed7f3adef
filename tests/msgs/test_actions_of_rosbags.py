"""The messages of actions against rosbags: their hashes, and their bytes in both directions."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest

from rosz.message import Message
from rosz.packages import PackageIndex
from rosz.typestore import TypeStore

from . import values

pytest.importorskip("rosbags.typesys", reason="needs rosbags")

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from .test_rosbags import build

MESSAGES = {
    "control_msgs/JointTolerance": "string name\nfloat64 position\nfloat64 velocity\n"
    "float64 acceleration\n",
    "control_msgs/JointComponentTolerance": "string joint_name\nuint16 component\n"
    "float64 position\nfloat64 velocity\nfloat64 acceleration\n",
}
ACTIONS = {
    "example_interfaces/Fibonacci": ("int32 order\n", "int32[] sequence\n", "int32[] sequence\n"),
    "tf2_msgs/LookupTransform": (
        "string target_frame\nstring source_frame\nbuiltin_interfaces/Time source_time\n"
        "builtin_interfaces/Duration timeout\nbuiltin_interfaces/Time target_time\n"
        "string fixed_frame\nbool advanced\n",
        "geometry_msgs/TransformStamped transform\ntf2_msgs/TF2Error error\n",
        "",
    ),
    "nav2_msgs/NavigateToPose": (
        "geometry_msgs/PoseStamped pose\nstring behavior_tree\n",
        "uint16 error_code\nstring error_msg\n",
        "geometry_msgs/PoseStamped current_pose\nbuiltin_interfaces/Duration navigation_time\n"
        "builtin_interfaces/Duration estimated_time_remaining\nint16 number_of_recoveries\n"
        "float32 distance_remaining\n",
    ),
    "control_msgs/FollowJointTrajectory": (
        "trajectory_msgs/JointTrajectory trajectory\n"
        "trajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory\n"
        "control_msgs/JointTolerance[] path_tolerance\n"
        "control_msgs/JointComponentTolerance[] component_path_tolerance\n"
        "control_msgs/JointTolerance[] goal_tolerance\n"
        "control_msgs/JointComponentTolerance[] component_goal_tolerance\n"
        "builtin_interfaces/Duration goal_time_tolerance\n",
        "int32 error_code\nstring error_string\n",
        "std_msgs/Header header\nstring[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint desired\n"
        "trajectory_msgs/JointTrajectoryPoint actual\n"
        "trajectory_msgs/JointTrajectoryPoint error\nstring[] multi_dof_joint_names\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_desired\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_actual\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error\n",
    ),
}
_UUID = "unique_identifier_msgs/UUID goal_id\n"
PARTS = {
    "SendGoal_Request": _UUID + "{action}_Goal goal\n",
    "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp\n",
    "GetResult_Request": _UUID,
    "GetResult_Response": "int8 status\n{action}_Result result\n",
    "FeedbackMessage": _UUID + "{action}_Feedback feedback\n",
}


def full(action: str) -> str:
    return action.replace("/", "/action/")


@pytest.fixture(scope="module")
def theirs() -> Any:
    store = get_typestore(Stores.ROS2_JAZZY)
    found: dict[str, Any] = {}
    for name, text in MESSAGES.items():
        found |= get_types_from_msg(text, name.replace("/", "/msg/"))
    for action, texts in ACTIONS.items():
        name = full(action)
        for part, text in zip(("Goal", "Result", "Feedback"), texts, strict=True):
            found |= get_types_from_msg(text, f"{name}_{part}")
        for part, text in PARTS.items():
            found |= get_types_from_msg(text.format(action=name), f"{name}_{part}")
    store.register(found)
    return store


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> TypeStore:
    """Types whose definitions rosz does not ship come from files."""
    root: Path = tmp_path_factory.mktemp("src")
    for package in ("control_msgs", "nav2_msgs"):
        for kind in ("msg", "action"):
            (root / package / kind).mkdir(parents=True)
        (root / package / "package.xml").write_text(f"<package><name>{package}</name></package>")
    for name, text in MESSAGES.items():
        package, base = name.split("/")
        (root / package / "msg" / f"{base}.msg").write_text(text)
    for name, texts in ACTIONS.items():
        package, base = name.split("/")
        if (root / package).exists():
            (root / package / "action" / f"{base}.action").write_text("---\n".join(texts))
    return TypeStore(PackageIndex([root]))


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("action", ACTIONS)
def test_messages_of_actions(action: str, part: str, ours: TypeStore, theirs: Any) -> None:
    name = f"{full(action)}_{part}"
    found: Any = ours.action(action)
    catalog = ours._catalog
    for one in part.split("_"):
        found = getattr(found, one)
    cls: type[Message] = found
    assert cls._type_hash == theirs.hash_rihs01(name)
    rng = random.Random(name)
    service, _, side = name.rpartition("_")
    if part == "FeedbackMessage":
        spec = catalog.message(name)
    else:
        spec = getattr(catalog.service(service), side.lower())
    for _ in range(4):
        plain = values.value(rng, catalog, spec)
        written = bytes(theirs.serialize_cdr(build(spec, plain, catalog, theirs), name))
        assert values.build(cls, plain).to_cdr() == written
        assert values.same(values.plain(cls.from_cdr(written)), plain)
