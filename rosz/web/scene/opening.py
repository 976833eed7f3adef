"""Opening displays by their names and the types of topics."""

from __future__ import annotations

from rosz.errors import NotFoundError, UsageError
from rosz.introspect import Survey, list_topics, topic_types
from rosz.names import short_type
from rosz.web.model import IMAGE_TYPES, Frames, System
from rosz.web.scene import display
from rosz.web.scene.depth import DepthDisplay, info_of
from rosz.web.scene.handles import FEEDBACK, HANDLE_TYPE, HandleDisplay
from rosz.web.scene.maps import MAP_TYPE, UPDATES, MapDisplay
from rosz.web.scene.markers import MARKER_TYPES, MarkerDisplay
from rosz.web.scene.meshes import Meshes
from rosz.web.scene.robot import RobotDisplay
from rosz.web.scene.setup import AXES, DEPTH, DESCRIPTION, GRID, ROBOT, TF, Look
from rosz.web.scene.still import STILL, StillDisplay

_TYPES = display.DRAWN_TYPES | MARKER_TYPES | IMAGE_TYPES | {HANDLE_TYPE, MAP_TYPE}


def list_displays(survey: Survey) -> dict[str, str]:
    """Return the names of all possible displays, with their kinds."""
    displays = {GRID: "grid", AXES: "of a frame", TF: "frames", ROBOT: DESCRIPTION}
    topics = {
        entry.name: short_type(kind)
        for entry in list_topics(survey.view.tokens)
        for kind in entry.types
        if short_type(kind) in _TYPES
    }
    depths = {
        f"{DEPTH}:{name}": "points of a depth image"
        for name, kind in topics.items()
        if kind == "sensor_msgs/Image" and DEPTH in name and info_of(name) in topics
    }
    return displays | dict(sorted(topics.items())) | dict(sorted(depths.items()))


def open_display(
    system: System, survey: Survey, frames: Frames, meshes: Meshes, look: Look
) -> display.Display:
    """Open a display.

    Args:
        system: The system.
        survey: The running nodes.
        frames: The frames.
        meshes: The meshes.
        look: Settings of the display.

    Raises:
        RoszError: It cannot be opened, or not yet.
    """
    name, node = look.name, system.node
    sources = display.SceneSources(node, survey, frames, meshes)
    if name in STILL:
        return StillDisplay(look, frames)
    if name == TF:
        return display.FrameDisplay(look, frames)
    if name.partition(":")[0] == ROBOT:
        system.permission.check("get", name.partition(":")[2] or DESCRIPTION)
        return RobotDisplay(node, look, frames, meshes)
    if name.partition(":")[0] == DEPTH:
        topic = name.partition(":")[2]
        for topic_name in filter(None, (topic, info_of(topic), look.image)):
            system.permission.check("subscribe", topic_name)
        return DepthDisplay(sources, look)
    return _open_topic(system, sources, look)


def _open_topic(system: System, sources: display.SceneSources, look: Look) -> display.Display:
    name = look.name
    system.permission.check("subscribe", name)
    types = [short_type(type_name) for type_name in topic_types(sources.survey.view).get(name, ())]
    if not types:
        raise NotFoundError(f"topic '{name}' does not exist yet")
    if types[0] in MARKER_TYPES:
        return MarkerDisplay(sources, look)
    if types[0] == HANDLE_TYPE:
        feedback = f"{name.rpartition('/')[0]}/{FEEDBACK}"
        objection = system.permission.objection("publish", feedback)
        return HandleDisplay(sources, look, objection)
    if types[0] == MAP_TYPE:
        unseen = system.permission.objection("subscribe", name + UPDATES)
        return MapDisplay(sources, look, unseen)
    if types[0] in IMAGE_TYPES:
        return display.ImageDisplay(sources, look)
    if types[0] not in display.DRAWN_TYPES:
        raise UsageError(f"topic '{name}' is of type {types[0]}, which is not drawn")
    return display.TopicDisplay(sources, look)
