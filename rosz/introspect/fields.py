"""Fields of messages that a person names, and filters on them.

A path (``pose/position``, ``ranges[0]``, ``poses[2:4]/x``) is checked against the type before the
first message arrives, so that a wrong name is an error at once.
"""

from __future__ import annotations

import ast
import re
from array import array
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from rosz.errors import NotFoundError, RoszError, UsageError, near_miss
from rosz.message import Message, Slot, ros1_slots, slot_type, slots
from rosz.names import short_type

_STEP = re.compile(r"(\w+)(?:\[([^\]]*)\])?")
_COLON = re.compile(r":(?![^\[]*\])")  # not one in an index
_MOST_SLICE_PARTS = 3
_FEW = 100

Loader = Callable[[str], type[Message]]


class _Step(msgspec.Struct, frozen=True):
    """One name of a path, with the index or slice behind it."""

    name: str
    index: int | slice | None


class FieldPath:
    """The path from a message to a part of it.

    Args:
        text: Names joined by slashes, each with an index or slice where it is a sequence; without
            any name it is the message itself.

    Raises:
        UsageError: The text does not have that form.
    """

    @staticmethod
    def spell_out(word: str) -> list[str]:
        """Return what a word names: ``/a/x`` and ``/a/y`` for ``/a/x:y``, as in rqt_plot."""
        first, *others = [part for part in _COLON.split(word) if part] or [word]
        return [first, *(f"{first.rpartition('/')[0]}/{other}" for other in others)]

    def __init__(self, text: str) -> None:
        self.text = text.strip("/")
        self.steps = tuple(_parse_step(part, text) for part in self.text.split("/") if part)

    def read(self, message: Any) -> Any:
        """Return the part of a message.

        Raises:
            LookupError: An index is outside of the sequence.
        """
        return _follow(message, self.steps)

    def type_in(self, cls: type[Message]) -> str:
        """Return the type of the part, as ROS 1 spells it, such as ``float64[]``.

        Raises:
            NotFoundError: The class has no such field.
            UsageError: An index is given for a single value, or is missing for a sequence.
        """
        type_text = cls._type
        here: type[Any] | str = cls
        before = cls._type
        for step in self.steps:
            if isinstance(here, str):
                raise NotFoundError(f"'{before}' is a {type_text}: it has no field '{step.name}'")
            slot = _slot(here, step.name)
            here = slot.kind
            type_text = slot_type(slot)
            before = f"{before}.{step.name}"
            if step.index is not None and slot.shape == "one" and slot.kind != "string":
                raise UsageError(f"'{before}' is a {type_text}, not a sequence: it takes no index")
            if step.index is None and slot.shape != "one" and step is not self.steps[-1]:
                raise UsageError(
                    f"'{before}' is a {type_text}: give an index, as in {step.name}[0]"
                )
            if isinstance(step.index, int):
                type_text = slot_type(msgspec.structs.replace(slot, shape="one"))
        return type_text

    def __repr__(self) -> str:
        return f"FieldPath({self.text!r})"


def _parse_step(part: str, whole: str) -> _Step:
    match = _STEP.fullmatch(part)
    if match is None:
        raise UsageError(
            f"'{part}' in '{whole}' is not a field; expected a form such as ranges[0:3]"
        )
    name, inside = match.groups()
    if inside is None:
        return _Step(name, None)
    numbers = inside.split(":")
    try:
        ends = [int(number) if number.strip() else None for number in numbers]
    except ValueError as error:
        raise UsageError(
            f"'[{inside}]' in '{whole}' is not an index; expected whole numbers"
        ) from error
    if len(ends) == 1 and ends[0] is not None:
        return _Step(name, ends[0])
    if len(ends) == 1 or len(ends) > _MOST_SLICE_PARTS:
        raise UsageError(
            f"'[{inside}]' in '{whole}' is not an index; expected [3] or [start:stop:step]"
        )
    if len(ends) == _MOST_SLICE_PARTS and ends[2] == 0:
        raise UsageError(f"'[{inside}]' in '{whole}' has step 0; expected a step other than 0")
    return _Step(name, slice(*ends))


def _follow(value: Any, steps: Sequence[_Step]) -> Any:
    for number, step in enumerate(steps):
        value = getattr(value, step.name)
        if step.index is None:
            continue
        value = value[step.index]
        rest = steps[number + 1 :]
        if isinstance(step.index, slice):
            if not rest:
                return list(value) if isinstance(value, bytes | array) else value
            return [_follow(item, rest) for item in value]
    return value


def _slot(cls: type[Any], name: str) -> Slot:
    for slot in slots(cls):
        if slot.name == name:
            return slot
    other = ros1_slots(cls).get(name)
    if other is not None:
        return other
    fields = cls.__slots__
    listing = f"; it has {', '.join(fields)}" if fields else "; it has no fields"
    raise NotFoundError(f"'{cls._type}' has no field '{name}'{near_miss(name, fields) or listing}")


class Target(msgspec.Struct, frozen=True):
    """A topic, or a field of its messages.

    Attributes:
        topic: Name of the topic.
        type_name: Type of the topic, ``pkg/msg/Name``.
        path: Path from a message to the field.
    """

    topic: str
    type_name: str
    path: FieldPath

    def type_text(self, load: Loader) -> str:
        """Return the text of ``rostopic type``.

        Raises:
            RoszError: The path does not fit the type.
        """
        own = short_type(self.type_name)
        if not self.path.steps:
            return own
        return f"{own} {self.path.text} {self.path.type_in(load(self.type_name))}"


def find_target(name: str, topics: Mapping[str, Sequence[str]], load: Loader) -> Target:
    """Find the topic, or the topic and the field, that a name stands for.

    The whole name is a topic, or else its longest beginning that is a topic and has such a field.

    Args:
        name: Global name, fields and indices included.
        topics: Types by topic.
        load: Function that returns the class of a type.

    Raises:
        NotFoundError: The topic or the field does not exist; the text says which.
        UsageError: The path is malformed.
    """
    if name in topics:
        return Target(name, topics[name][0], FieldPath(""))
    refused = ""
    for topic in sorted(topics, key=len, reverse=True):
        if not name.startswith(f"{topic}/"):
            continue
        path = FieldPath(name[len(topic) :])
        try:
            path.type_in(load(topics[topic][0]))
        except RoszError as error:
            refused = refused or f"; '{topic}' is there, but {error}"
            continue
        return Target(topic, topics[topic][0], path)
    raise NotFoundError(f"unknown topic '{name}'{refused or near_miss(name, topics)}")


class FilterFailed(RoszError):
    """A filter failed on a message."""


class Filter:
    """A condition on messages, written in Python as ``rostopic`` takes it: ``m.data > 3``.

    Args:
        text: Python expression of ``m``, the message, and ``topic``, its name.

    Raises:
        UsageError: The text is not an expression.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            self._code = compile(ast.parse(text.strip(), "<filter>", "eval"), "<filter>", "eval")
        except SyntaxError as error:
            before = len(text) - len(text.lstrip())
            column = before + (error.offset or len(text.strip()) + 1)
            raise self._refused(f"{error.msg} at column {column}") from error
        except ValueError as error:
            raise self._refused(str(error)) from error
        except (MemoryError, RecursionError) as error:
            raise self._refused("it is nested too deep") from error

    def _refused(self, reason: str) -> UsageError:
        return UsageError(f"filter '{self.text:.{_FEW}}' is not a Python expression: {reason}")

    def accepts(self, message: Any, topic: str = "", time: Any = None) -> bool:
        """Return whether a message passes.

        Raises:
            FilterFailed: The expression fails on this message.
        """
        return bool(self.value(message, topic, time))

    def value(self, message: Any, topic: str = "", time: Any = None) -> Any:
        """Return the value of the expression.

        Args:
            message: Value of ``m``.
            topic: Value of ``topic``.
            time: Value of ``t``, which only messages of bags have.

        Raises:
            FilterFailed: The expression fails on this message.
        """
        names = {"m": message, "topic": topic}
        try:
            return eval(self._code, names if time is None else {**names, "t": time})  # noqa: S307  # the user's
        except Exception as error:
            raise FilterFailed(
                f"filter '{self.text}' failed: {type(error).__name__}: {error}"
            ) from error
