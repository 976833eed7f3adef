"""The check on transforms: a frame has one parent."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from threading import Lock

from rosz.doctor.machine import Finding, error
from rosz.errors import DecodeError
from rosz.introspect import Survey
from rosz.msgs.tf2_msgs.msg import TFMessage
from rosz.session import Sample, Session
from rosz.transforms import FrameParents
from rosz.wire import Kind, entity_key, format_token, gid, read_attachment

_TOPICS = {"/tf": False, "/tf_static": True}
_TYPE = "tf2_msgs/msg/TFMessage"
_HISTORY = 100


def check_frames(session: Session, survey: Survey, seconds: float) -> Iterator[Finding]:
    """Find frames that have several parents at the same time.

    Args:
        session: The session to subscribe with.
        survey: The nodes that are running.
        seconds: How long to listen to the transforms.
    """
    publishers = {
        gid(format_token(token)): token
        for token in survey.view.entities(Kind.PUBLISHER)
        if token.name in _TOPICS and token.type_name == _TYPE
    }
    if not publishers or seconds <= 0:
        return
    parents, lock = FrameParents(), Lock()

    def receive(static: bool, sample: Sample) -> None:
        try:
            publisher = read_attachment(sample.attachment)[2]
            transforms = TFMessage.from_cdr(sample.payload).transforms
        except DecodeError:
            return
        with lock:
            for transform in transforms:
                parents.add(transform, publisher, static=static)

    keys = {
        entity_key(token.domain, token.name, token.type_name, token.type_hash): _TOPICS[token.name]
        for token in publishers.values()
    }
    with ExitStack() as subscribers:
        for key, static in keys.items():
            history = _HISTORY if static else 0
            subscriber = session.subscriber(key, partial(receive, static), history=history)
            subscribers.callback(subscriber.close)
        time.sleep(seconds)
    with lock:
        several = parents.several()
    lines: list[str] = []
    for frame, sources in sorted(several.items()):
        for parent, publisher in sorted(sources.items()):
            token = publishers.get(publisher)
            source = f"{token.node_name} ({survey.address(token)})" if token else "a new node"
            lines.append(f"{frame} is in {parent}, says {source}")
    yield from error(
        "two-parents",
        "frames have two parents at the same time: their transforms jump between both",
        lines,
        "let one node publish each frame: end the other, or have it publish another frame"
        " ('rosz tf tree' shows the tree)",
    )
