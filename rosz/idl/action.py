"""The messages that ROS 1 makes of an .action file (ROS wiki, actionlib, "Action files").

``Do.action`` gives ``DoGoal``, ``DoResult`` and ``DoFeedback``, the three that carry them over
topics, and ``DoAction``, which holds the three together.
"""

from __future__ import annotations

__all__ = ("action_messages", "action_parts")

_PARTS = ("Goal", "Result", "Feedback")
_ENVELOPES = {
    "ActionGoal": "Header header\nactionlib_msgs/GoalID goal_id\n{name}Goal goal\n",
    "ActionResult": "Header header\nactionlib_msgs/GoalStatus status\n{name}Result result\n",
    "ActionFeedback": "Header header\nactionlib_msgs/GoalStatus status\n{name}Feedback feedback\n",
    "Action": (
        "{name}ActionGoal action_goal\n"
        "{name}ActionResult action_result\n"
        "{name}ActionFeedback action_feedback\n"
    ),
}


def action_parts(name: str) -> list[str]:
    """Return the names of the messages that an action of a name gives."""
    return [name + suffix for suffix in (*_PARTS, *_ENVELOPES)]


def action_messages(name: str, text: str) -> dict[str, str]:
    """Return the definitions of the messages of an action by their names.

    Args:
        name: Name of the action, ``Do``.
        text: What the file says; parts that are missing are empty.
    """
    parts: list[list[str]] = [[]]
    for line in text.splitlines(keepends=True):
        if line.strip() == "---":
            parts.append([])
        else:
            parts[-1].append(line)
    # What stands behind a third line of dashes belongs to the last part, where it is refused.
    texts = ["".join(part) for part in parts[:2]] + ["---\n".join(map("".join, parts[2:]))]
    found = {name + suffix: part for suffix, part in zip(_PARTS, texts, strict=False)}
    found |= {name + suffix: form.format(name=name) for suffix, form in _ENVELOPES.items()}
    return {one: found.get(one, "") for one in action_parts(name)}
