"""Definitions by name: where they are found, and their specs, read when needed and checked."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec

from rosz.errors import DefinitionError, TypeNotFound, near_miss
from rosz.idl.grammar import parse_action, parse_message, parse_service
from rosz.idl.spec import (
    PRIMITIVES,
    ActionSpec,
    Field,
    MessageSpec,
    ServiceSpec,
    action_of,
    is_service,
    is_service_message,
)

_NEXT_DEFINITION = re.compile(r"^=+[ \t]*\r?\nMSG:[ \t]*(\S+)[ \t]*\r?\n", re.MULTILINE)
_DASHES = re.compile(r"^---.*(?:\n|\Z)", re.MULTILINE)
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


_ACTION_TYPES = {
    "FeedbackMessage": "unique_identifier_msgs/msg/UUID goal_id\n{name}_Feedback feedback\n",
    "SendGoal": (
        "unique_identifier_msgs/msg/UUID goal_id\n{name}_Goal goal\n"
        "---\nbool accepted\nbuiltin_interfaces/msg/Time stamp\n"
    ),
    "GetResult": (
        "unique_identifier_msgs/msg/UUID goal_id\n---\nint8 status\n{name}_Result result\n"
    ),
}
"""Definitions of the types that ROS 2 makes of an action, besides its three parts."""


def action_type(action: str, definition: Definition, base: str) -> Definition | None:
    """Return the definition of a type that ROS 2 makes of an action; None if it makes none such.

    Args:
        action: Full name of the action.
        definition: Definition of the action.
        base: Name of the type without its package, ``Fibonacci_SendGoal``.
    """
    part = base.removeprefix(f"{action.rpartition('/')[2]}_")
    if part in _ACTION_TYPES:
        return Definition(_ACTION_TYPES[part].format(name=action), definition.path)
    spec = parse_action(action, definition.text, definition.path)
    texts = {"Goal": spec.goal.text, "Result": spec.result.text, "Feedback": spec.feedback.text}
    return Definition(texts[part], definition.path) if part in texts else None


def _action_parts(name: str) -> list[str]:
    """Return the names of the messages that are made of an action."""
    return [name + suffix for suffix in (*_PARTS, *_ENVELOPES)]


def action_messages(name: str, text: str) -> dict[str, str]:
    """Return the definitions of the messages that ROS 1 makes of an action, by their names.

    ``Do.action`` gives ``DoGoal``, ``DoResult`` and ``DoFeedback``, the three that carry them over
    topics, and ``DoAction``, which holds those three (ROS wiki, actionlib, "Action files").

    Args:
        name: Name of the action, ``Do``.
        text: Text of the file; missing parts are empty.
    """
    # Text after a third line of dashes stays in the last part, whose parser refuses it.
    texts = _DASHES.split(text, maxsplit=2)
    texts_by_part = {name + suffix: part for suffix, part in zip(_PARTS, texts, strict=False)}
    texts_by_part |= {name + suffix: form.format(name=name) for suffix, form in _ENVELOPES.items()}
    return {part_name: texts_by_part.get(part_name, "") for part_name in _action_parts(name)}


class Definition(msgspec.Struct, frozen=True):
    """The text of a definition, and the path that it was read from."""

    text: str
    path: str


class Catalog:
    """Specs of types by full name; each definition is parsed once.

    Args:
        find: Function that returns the definition of a full name (``std_msgs/msg/String``,
            ``std_srvs/srv/Empty``) or raises TypeNotFound.
    """

    def __init__(self, find: Callable[[str], Definition]) -> None:
        self._find = find
        self._messages: dict[str, MessageSpec] = {}
        self._services: dict[str, ServiceSpec] = {}
        self._actions: dict[str, ActionSpec] = {}
        self._checked: set[str] = set()

    def with_definition(self, name: str, definition: Definition) -> Catalog:
        """Return a catalog that has another definition of one type."""
        return Catalog(lambda wanted: definition if wanted == name else self._find(wanted))

    def message(self, name: str) -> MessageSpec:
        """Return the spec of a message, checked to refer to existing types only.

        Raises:
            TypeNotFound: The type does not exist.
            DefinitionError: The type or one in it is not well-formed, is missing, or holds itself.
        """
        spec = self._message(name)
        self._check(spec, ())
        return spec

    def service(self, name: str) -> ServiceSpec:
        """Return the spec of a service, checked to refer to existing types only.

        Raises:
            TypeNotFound: The type does not exist.
            DefinitionError: The type or one in it is not well-formed, is missing, or holds itself.
        """
        if name not in self._services:
            definition = self._find(name)
            spec = parse_service(name, definition.text, definition.path)
            self._check(spec.request, ())
            self._check(spec.response, ())
            self._services[name] = spec
        return self._services[name]

    def action(self, name: str) -> ActionSpec:
        """Return the spec of an action, checked to refer to existing types only.

        Raises:
            TypeNotFound: The type does not exist.
            DefinitionError: The type or one in it is not well-formed, is missing, or holds itself.
        """
        if name not in self._actions:
            definition = self._find(name)
            spec = parse_action(name, definition.text, definition.path)
            for part in (spec.goal, spec.result, spec.feedback):
                self._check(self._messages.setdefault(part.name, part), ())
            self._actions[name] = spec
        return self._actions[name]

    def parts(self, name: str) -> list[MessageSpec]:
        """Return the message, the request and the response, or the goal, result and feedback.

        Args:
            name: Full name of the message, service or action.

        Raises:
            TypeNotFound: The type does not exist.
            DefinitionError: The type or one in it is not well-formed, is missing, or holds itself.
        """
        _, kind, base = name.split("/")
        if is_service(name):
            service = self.service(name)
            return [service.request, service.response]
        if kind == "msg" or action_of(base) != base or is_service_message(name):
            return [self.message(name)]
        action = self.action(name)
        return [action.goal, action.result, action.feedback]

    def below(self, spec: MessageSpec) -> dict[str, MessageSpec]:
        """Return all message types that a message holds, at any depth, by name."""
        specs: dict[str, MessageSpec] = {}
        rest = [spec]
        while rest:
            for nested in self.nested(rest.pop()):
                if nested.name not in specs:
                    specs[nested.name] = nested
                    rest.append(nested)
        return specs

    def nested(self, spec: MessageSpec) -> Iterator[MessageSpec]:
        """Yield the spec of each field that is a message."""
        return (self._message(field.type.base) for field in spec.fields if not field.type.primitive)

    def _message(self, name: str) -> MessageSpec:
        if name not in self._messages:
            definition = self._find(name)
            self._messages[name] = parse_message(name, definition.text, definition.path)
        return self._messages[name]

    def _check(self, spec: MessageSpec, above: tuple[str, ...]) -> None:
        if spec.name in self._checked:
            return
        for field in spec.fields:
            if not field.type.primitive:
                self._check(self._nested(spec, field, (*above, spec.name)), (*above, spec.name))
        self._checked.add(spec.name)

    def _nested(self, spec: MessageSpec, field: Field, above: tuple[str, ...]) -> MessageSpec:
        base = field.type.base
        if base in above:
            chain = " → ".join((*above[above.index(base) :], base))
            raise DefinitionError(
                f"a message cannot hold itself: {chain}", spec.path, field.line, field.column
            )
        try:
            return self._message(base)
        except TypeNotFound as error:
            written = field.type.written
            explained = "/" in written or str(error).endswith("?")
            hint = "" if explained else near_miss(written.lower(), PRIMITIVES)
            raise DefinitionError(
                f"type '{written}' of field '{field.name}': {error}{hint}",
                spec.path,
                field.line,
                field.column,
            ) from error


def split_definitions(name: str, text: str) -> dict[str, str]:
    """Return the texts of a type and of the types behind it, by full name.

    Args:
        name: Full name of the type.
        text: Text of its definition. Texts of the types in it may follow, each behind a line of
            ``=`` and a line ``MSG: package/Name``, as in ROS 1's full texts and in bags.
    """
    own, *others = _NEXT_DEFINITION.split(text)
    names = [full_name(other, "msg") for other in others[::2]]
    return {**dict(zip(names, others[1::2], strict=True)), name: own}


def full_name(name: str, kind: str) -> str:
    """Return a type name with its middle part: ``std_msgs/String`` is ``std_msgs/msg/String``."""
    package, slash, base = name.partition("/")
    return name if "/" in base or not slash else f"{package}/{kind}/{base}"


def read_definition(file: Path) -> Definition:
    """Read a definition file.

    Raises:
        DefinitionError: The file cannot be read, or is not UTF-8.
    """
    try:
        return Definition(file.read_text("utf-8"), str(file))
    except UnicodeDecodeError as error:
        before = error.object[: error.start]
        line = before.count(b"\n") + 1
        column = error.start - before.rfind(b"\n")
        raise DefinitionError("not UTF-8", str(file), line, column) from error
    except OSError as error:
        raise DefinitionError(f"cannot be read: {error.strerror}", str(file)) from error


class Folders:
    """Definitions in the folders of packages: ``msg/*.msg``, ``srv/*.srv`` and ``action/*.action``.

    The messages that ROS 1 makes of actions are among the ``msg``; what ROS 2 makes of an action
    is found by its name, ``<package>/action/<Action>_Goal``.

    Args:
        folder: Function that returns the folder of a package by its name, or None.
        actions: Whether to include the messages that ROS 1 makes of actions.
    """

    def __init__(self, folder: Callable[[str], Path | None], *, actions: bool = True) -> None:
        self._folder = folder
        self._actions = actions

    def names(self, package: str, kind: str) -> list[str]:
        """Return the full names of a package's types of one kind, sorted."""
        folder = self._folder(package)
        if folder is None:
            return []
        bases = {file.stem for file in (folder / kind).glob(f"*.{kind}")}
        if kind == "msg" and self._actions:
            actions = (folder / "action").glob("*.action")
            bases.update(part for file in actions for part in _action_parts(file.stem))
        return [f"{package}/{kind}/{base}" for base in sorted(bases)]

    def find(self, name: str) -> Definition:
        """Return the definition of a full name.

        Raises:
            TypeNotFound: The package does not exist, or has no such type.
            DefinitionError: The file cannot be read.
        """
        package, kind, base = name.split("/")
        folder = self._folder(package)
        if folder is None:
            raise TypeNotFound(name, f"there is no package '{package}'")
        file = folder / kind / f"{base}.{kind}"
        if not file.is_file():
            made = None
            if kind == "msg" and self._actions:
                made = self._of_action(folder, base)
            elif kind == "action" and action_of(base) != base:
                action = f"{package}/action/{action_of(base)}"
                made = action_type(action, self.find(action), base)
            if made is not None:
                return made
            bases = [member.rpartition("/")[2] for member in self.names(package, kind)]
            raise TypeNotFound(
                name, f"'{folder / kind}' has no '{base}.{kind}'{near_miss(base, bases)}"
            )
        return read_definition(file)

    def _of_action(self, folder: Path, base: str) -> Definition | None:
        """Return the definition of a message that is made of an action, if there is one."""
        for file in (folder / "action").glob("*.action"):
            if base in _action_parts(file.stem):
                definition = read_definition(file)
                return Definition(
                    action_messages(file.stem, definition.text)[base], definition.path
                )
        return None
