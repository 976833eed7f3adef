"""``wait_for``: what has to be there before a node starts.

Beyond roslaunch. ``wait_for="topic /scan"`` waits for one thing, a comma asks for one more, ``|``
for one of several: ``topic /scan, service /reset | param /ready``. Kinds are topic, service, param
and node; names are resolved as the node would. ``wait_timeout`` is in seconds, 30 when not given.
On a group both concern every node in it, and each node may ask for more.
"""

from __future__ import annotations

from typing import Literal, get_args

from rosz import names
from rosz.errors import InvalidName, near_miss
from rosz.launch.plan.model import Condition, Wait
from rosz.launch.plan.tag import Tag

__all__ = ("DEFAULT_TIMEOUT", "read_wait")

DEFAULT_TIMEOUT = 30.0
"""Seconds to wait where ``wait_timeout`` says nothing."""

_Kind = Literal["topic", "service", "param", "node"]
_KINDS: dict[str, _Kind] = {kind: kind for kind in get_args(_Kind)}


def read_wait(tag: Tag, ns: str, node: str = "") -> tuple[Wait, ...]:
    """Read ``wait_for`` and ``wait_timeout``.

    Args:
        tag: The tag that has them or not.
        ns: Namespace of relative names, with its trailing slash.
        node: Base name of the node, for private names; empty for a group.

    Raises:
        Fault: A condition or the timeout is wrong.
    """
    text = tag.get("wait_for")
    if text is None:
        if "wait_timeout" in tag.element.attributes:
            tag.warn("'wait_timeout' does nothing without 'wait_for'", "wait_timeout")
        return ()
    timeout = tag.number("wait_timeout", DEFAULT_TIMEOUT, 0.0)
    return tuple(
        Wait(
            tuple(_condition(tag, part.split(), ns, node) for part in group.split("|")),
            timeout,
            tag.place,
        )
        for group in text.split(",")
    )


def _condition(tag: Tag, words: list[str], ns: str, node: str) -> Condition:
    kind, name = words if len(words) == 2 else ("", "")  # noqa: PLR2004  # a kind and a name
    if not kind:
        found = " ".join(words)
        expected = "expected a kind and a name, as in 'topic /scan'"
        tag.fail(f"'wait_for' has '{found}'; {expected}", "wait_for")
    if kind not in _KINDS:
        hint = near_miss(kind, _KINDS) or f"; there are {', '.join(_KINDS)}"
        tag.fail(f"'wait_for' knows no '{kind}'{hint}", "wait_for")
    if names.is_private(name) and not node:
        tag.fail(f"'wait_for' has '{name}', and a group has no private names", "wait_for")
    try:
        return Condition(_KINDS[kind], names.resolve(name, f"{ns}{node or '_'}"))
    except InvalidName as error:
        tag.fail(f"'wait_for': {error}", "wait_for")
