"""Which tags there are, and what each may carry and hold.

The first set of attributes is roslaunch's. The second is understood beyond it: what ROS 2's XML
calls the same thing, and rosz's own additions. roslaunch ignores those with a warning.
"""

from __future__ import annotations

from collections.abc import Iterable

from rosz.errors import near_miss

__all__ = ("TAGS", "TagRule", "misplaced", "unknown_attribute")


class TagRule:
    """What a tag may carry and hold.

    Args:
        attributes: Names of roslaunch's attributes, separated by spaces.
        more: Names of attributes beyond roslaunch.
        holds: Names of the tags that may stand inside.

    Attributes:
        attributes: All attributes, ``if`` and ``unless`` among them.
        holds: Tags that may stand inside.
    """

    def __init__(self, attributes: str, more: str = "", holds: str = "") -> None:
        self.attributes = frozenset(f"{attributes} {more} if unless".split())
        self.holds = frozenset(holds.split())


_BODY = (
    "arg env executable group include let machine node param push-ros-namespace push_ros_namespace"
    " remap rosparam set_env test"
)
_NODE = "args clear_params cwd launch-prefix machine name ns output pkg required type"
_NODE_BODY = "env param remap rosparam"
_WAIT = "wait_for wait_timeout"
_START = f"respawn_max spawn_delay {_WAIT}"

TAGS = {
    "arg": TagRule("default doc name value", "description"),
    "env": TagRule("name value"),
    "executable": TagRule(
        "", f"args cmd cwd launch-prefix name output required respawn respawn_delay {_START}", "env"
    ),
    "group": TagRule("clear_params ns", f"namespace {_WAIT}", _BODY),
    "include": TagRule("clear_params file ns pass_all_args", "namespace", "arg env"),
    "launch": TagRule("deprecated", "version", _BODY),
    "let": TagRule("", "name value"),
    "machine": TagRule("address default env-loader name password ssh-port timeout user"),
    "node": TagRule(f"{_NODE} respawn respawn_delay", f"exec namespace {_START}", f"{_NODE_BODY}"),
    "param": TagRule("binfile command name textfile type value"),
    "push-ros-namespace": TagRule("", "namespace"),
    "push_ros_namespace": TagRule("", "namespace"),
    "remap": TagRule("from to"),
    "rosparam": TagRule("command file ns param subst_value"),
    "set_env": TagRule("", "name value"),
    "test": TagRule(f"{_NODE} retry test-name time-limit", "exec namespace", f"{_NODE_BODY}"),
}
"""Every tag by its name."""


def misplaced(tag: str, parent: str) -> str:
    """Say that a tag means nothing inside another, and what would."""
    holds = TAGS[parent].holds
    if not holds:
        return f"<{tag}> means nothing in <{parent}>, which holds no tags"
    hint = near_miss(tag, holds)
    if not hint and tag in TAGS:
        homes = [name for name, rule in TAGS.items() if tag in rule.holds]
        hint = f"; it may stand in {_listing(homes)}"
    return (
        f"<{tag}> means nothing in <{parent}>{hint}"
        if hint
        else f"<{tag}> is no tag of launch files; <{parent}> may hold {_listing(holds)}"
    )


def unknown_attribute(tag: str, attribute: str) -> str:
    """Say that a tag has no such attribute, and which ones it has."""
    known = TAGS[tag].attributes
    hint = near_miss(attribute, known) or f"; it has {', '.join(sorted(known))}"
    return f"<{tag}> has no attribute '{attribute}'{hint}"


def _listing(names: Iterable[str]) -> str:
    return ", ".join(f"<{name}>" for name in sorted(names))
