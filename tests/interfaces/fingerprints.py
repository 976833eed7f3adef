"""RIHS01 hashes and MD5 sums of the definitions, straight from the rules and slow."""

import hashlib
import json
import re
from dataclasses import dataclass

from .definitions import DEFINITIONS, PRIMITIVES, Constant, Definition, Section

EVENT = "service_msgs/msg/ServiceEventInfo"
UUID = "unique_identifier_msgs/msg/UUID"
TIME = "builtin_interfaces/msg/Time"
NESTED, BOOL, INT8, UINT8 = 1, PRIMITIVES["bool"], PRIMITIVES["int8"], PRIMITIVES["uint8"]
FIXED, BOUNDED, UNBOUNDED = 48, 96, 144  # added to the number of a type
LIMITED = 4  # added to the number of a string with a bound


@dataclass(frozen=True)
class Member:
    """A field as a type hash sees it."""

    name: str
    number: int
    message: str = ""
    capacity: int = 0
    length: int = 0


def members(section: Section) -> list[Member]:
    """Return the fields of a message, or the stand-in of one that has none."""
    found = []
    for field in section.fields:
        shape = re.fullmatch(r"[\w/]+(?:<=(\d+))?(\[(<=)?(\d*)\])?", field.spelling)
        assert shape, field.spelling
        length, array, bounded, capacity = shape.groups()
        number = PRIMITIVES.get(field.base, NESTED) + (LIMITED if length else 0)
        if array:
            number += BOUNDED if bounded else FIXED if capacity else UNBOUNDED
        sizes = (int(capacity or 0), int(length or 0))
        found.append(Member(field.name, number, section.message(field), *sizes))
    return found or [Member("structure_needs_at_least_one_member", UINT8)]


def service(name: str, request: list[Member], response: list[Member]) -> dict[str, list[Member]]:
    """Return the four types that make up a service."""
    parts = (f"{name}_Request", f"{name}_Response", f"{name}_Event")
    event = [
        Member("info", NESTED, EVENT),
        Member("request", NESTED + BOUNDED, parts[0], 1),
        Member("response", NESTED + BOUNDED, parts[1], 1),
    ]
    fields = ("request_message", "response_message", "event_message")
    whole = [Member(field, NESTED, part) for field, part in zip(fields, parts, strict=True)]
    return dict(zip((*parts, name), (request, response, event, whole), strict=True))


def action(
    name: str, goal: list[Member], result: list[Member], feedback: list[Member]
) -> dict[str, list[Member]]:
    """Return the types that make up an action."""
    parts = {f"{name}_Goal": goal, f"{name}_Result": result, f"{name}_Feedback": feedback}
    goal_id = Member("goal_id", NESTED, UUID)
    parts[f"{name}_FeedbackMessage"] = [goal_id, Member("feedback", NESTED, f"{name}_Feedback")]
    parts |= service(
        f"{name}_SendGoal",
        [goal_id, Member("goal", NESTED, f"{name}_Goal")],
        [Member("accepted", BOOL), Member("stamp", NESTED, TIME)],
    )
    outcome = [Member("status", INT8), Member("result", NESTED, f"{name}_Result")]
    parts |= service(f"{name}_GetResult", [goal_id], outcome)
    whole = {
        "goal": "Goal",
        "result": "Result",
        "feedback": "Feedback",
        "send_goal_service": "SendGoal",
        "get_result_service": "GetResult",
        "feedback_message": "FeedbackMessage",
    }
    fields = [Member(field, NESTED, f"{name}_{part}") for field, part in whole.items()]
    return {**parts, name: fields}


def types(definition: Definition) -> dict[str, list[Member]]:
    """Return the types that a file defines, by full name."""
    parts = [members(section) for section in definition.sections]
    match definition.kind:
        case "srv":
            return service(str(definition), *parts)
        case "action":
            return action(str(definition), *parts)
        case _:
            return {str(definition): parts[0]}


TYPES = {name: fields for item in DEFINITIONS for name, fields in types(item).items()}
FILES = {str(item): item for item in DEFINITIONS}


def describe(name: str) -> dict[str, object]:
    """Return the description of a type that its hash is made of."""
    fields = [
        {
            "name": member.name,
            "type": {
                "type_id": member.number,
                "capacity": member.capacity,
                "string_capacity": member.length,
                "nested_type_name": member.message,
            },
        }
        for member in TYPES[name]
    ]
    return {"type_name": name, "fields": fields}


def type_hash(name: str) -> str:
    """Return the RIHS01 hash of a type, without the prefix."""
    reached: set[str] = set()
    ahead = [name]
    while ahead:
        for member in TYPES[ahead.pop()]:
            if member.message and member.message not in reached:
                reached.add(member.message)
                ahead.append(member.message)
    whole = {
        "type_description": describe(name),
        "referenced_type_descriptions": [describe(other) for other in sorted(reached)],
    }
    return hashlib.sha256(json.dumps(whole).encode()).hexdigest()


def md5_text(section: Section) -> str:
    """Return the text that ROS 1 takes the MD5 sum of: constants first, no comments."""
    constants = [line for line in section.lines if isinstance(line, Constant)]
    lines = [f"{line.type} {line.name}={line.value}" for line in constants]
    for field in section.fields:
        ros_1 = field.base in PRIMITIVES or field.base in {"time", "duration"}
        spelling = field.spelling if ros_1 else md5sum(section.message(field))
        lines.append(f"{spelling} {field.name}")
    return "\n".join(lines)


def md5sum(name: str) -> str:
    """Return the MD5 sum of a message or a service."""
    text = "".join(md5_text(section) for section in FILES[name].sections)
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()
