"""Transforms between coordinate frames, as they are told on ``/tf`` and ``/tf_static`` (REP 105).

``poses`` is the arithmetic, ``history`` what is known of one frame, ``buffer`` the tree of frames
and the questions that people ask of it; these three are pure. ``broadcast`` and ``listener`` join
them to a node.
"""

from rosz.transforms.broadcast import StaticTransformBroadcaster, TransformBroadcaster
from rosz.transforms.buffer import Buffer
from rosz.transforms.listener import TransformListener
from rosz.transforms.poses import IDENTITY, Pose, compose, invert

__all__ = (
    "IDENTITY",
    "Buffer",
    "Pose",
    "StaticTransformBroadcaster",
    "TransformBroadcaster",
    "TransformListener",
    "compose",
    "invert",
)
