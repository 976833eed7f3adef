"""Transforms between coordinate frames, from ``/tf`` and ``/tf_static`` (REP 105).

`poses` is the arithmetic and `buffer` the tree of frames over time; both are pure. `topics`
connects them to a node. May import nodes and everything below them.
"""

from rosz.transforms.buffer import Buffer
from rosz.transforms.poses import IDENTITY, Pose, compose, invert, rotate
from rosz.transforms.topics import (
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformListener,
    pose_of,
)

__all__ = (
    "IDENTITY",
    "Buffer",
    "Pose",
    "StaticTransformBroadcaster",
    "TransformBroadcaster",
    "TransformListener",
    "compose",
    "invert",
    "pose_of",
    "rotate",
)
