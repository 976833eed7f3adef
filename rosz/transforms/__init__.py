"""Transforms between coordinate frames, from ``/tf`` and ``/tf_static`` (REP 105).

`poses` is the arithmetic and `buffer` the tree of frames over time; both are pure. `conversions`
gives messages in other frames, `topics` connects a tree to a node, and `monitor` measures
rates and delays. May import nodes and everything below them.
"""

from rosz.transforms.buffer import Buffer
from rosz.transforms.conversions import (
    FIELD_FORMATS,
    transform_cloud,
    transform_message,
    transform_point,
    transform_pose,
    transform_vector,
    transform_wrench,
)
from rosz.transforms.monitor import (
    BroadcasterReport,
    FrameParents,
    FrameReport,
    Monitor,
    describe_other_parents,
    tree_as_dot,
    tree_as_text,
)
from rosz.transforms.poses import (
    IDENTITY,
    Pose,
    compose,
    describe_pose,
    from_rpy,
    invert,
    rotate,
    to_rpy,
)
from rosz.transforms.republisher import Republisher
from rosz.transforms.topics import (
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformListener,
    pose_of,
)

__all__ = (
    "FIELD_FORMATS",
    "IDENTITY",
    "BroadcasterReport",
    "Buffer",
    "FrameParents",
    "FrameReport",
    "Monitor",
    "Pose",
    "Republisher",
    "StaticTransformBroadcaster",
    "TransformBroadcaster",
    "TransformListener",
    "compose",
    "describe_other_parents",
    "describe_pose",
    "from_rpy",
    "invert",
    "pose_of",
    "rotate",
    "to_rpy",
    "transform_cloud",
    "transform_message",
    "transform_point",
    "transform_pose",
    "transform_vector",
    "transform_wrench",
    "tree_as_dot",
    "tree_as_text",
)
