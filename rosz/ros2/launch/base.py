"""What launch files are made of, and the state that it changes while it is executed.

A launch file of ROS 2 makes objects, which are executed one after the other. Here each of them adds
to a plan what it starts, and nothing runs before the plan is whole. Any error in the code of a user
becomes one of the launch file, with its place.
"""

from __future__ import annotations

import os
import sys
import sysconfig
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from inspect import signature
from itertools import islice
from pathlib import Path
from traceback import walk_tb
from typing import Any

from msgspec.structs import replace

from rosz.environment import Environment, package_index
from rosz.errors import LaunchError, LaunchFileError, RoszError
from rosz.launch.plan import ArgDoc, Notice, Place, PlanBuilder, SystemContext, Trigger
from rosz.launch.plan.substitution import parse_bool

_ROSZ = str(Path(__file__).parents[2])
_LIBRARIES = (_ROSZ, sysconfig.get_path("stdlib"), sysconfig.get_path("purelib"), "<frozen")


class SubstitutionFailure(LaunchError):
    """A substitution has no text, or an action cannot be executed."""


class LaunchContext:
    """The state of a launch while its files are read.

    Attributes:
        environment: Environment variables of the processes that follow.
        load: Function that returns the description of a file, which becomes the innermost one.
        files: Launch files that are being read, the innermost last.
        docs: Arguments that the files declare, by name.
        place: Position of the action that is being executed.
        timing: Event, and time in seconds after it, that what is added waits for.
    """

    def __init__(
        self, args: Mapping[str, str] | None = None, ns: str = "", *, system: Any = None, **_: Any
    ) -> None:
        packages = package_index(Environment.read())
        self.system = system or SystemContext(packages, os.environ, Path.cwd(), str)
        self.builder = PlanBuilder(self.system)
        self.launch_configurations: dict[str, Any] = dict(args or {})
        if ns:
            self.launch_configurations["ros_namespace"] = f"/{ns.strip('/')}"
        self.environment: dict[str, str] = dict(self.system.environ)
        self.files: list[str] = []
        self.load: Any = None
        self.docs: dict[str, ArgDoc] = {}
        self.includes: tuple[str, ...] = ()
        self.place = Place("")
        self.handlers: list[Any] = []
        self.timing: tuple[Trigger | None, float] = (None, 0.0)

    def text(self, subs: Any) -> str:
        """Return the text of a substitution, of a text, or of several in a row."""
        if isinstance(subs, str | os.PathLike):
            return os.fspath(subs)
        if hasattr(subs, "perform"):
            return str(subs.perform(self))
        if isinstance(subs, Iterable):
            return "".join(map(self.text, subs))
        raise SubstitutionFailure(f"{subs!r} is neither a text nor a substitution; write '{subs}'")

    perform_substitution = text

    def is_true(self, value: Any) -> bool:
        """Return the bool that a bool, a text or a substitution means; a ValueError if none."""
        return value if isinstance(value, bool) else parse_bool(self.text(value))

    def warn(self, text: str) -> None:
        """Add a warning about the action to the plan."""
        self.builder.warnings.append(Notice(text, self.place))


def normalize_to_list_of_substitutions(subs: Any) -> list[Any]:
    """Return a substitution, or several, as a list."""
    return [subs] if isinstance(subs, str | os.PathLike) or hasattr(subs, "perform") else [*subs]


perform_substitutions = LaunchContext.text


class Part:
    """A part of a launch file, whose function is called with the context."""

    function: Callable[..., Any]

    def evaluate(self, context: LaunchContext) -> bool:
        """Return whether a condition holds."""
        return bool(self.function(context))


class Substitution(Part):
    """A text that is known when the launch file is executed."""

    def perform(self, context: LaunchContext) -> str:
        """Return the text."""
        result = self.function(context)
        return str(result).lower() if isinstance(result, bool) else str(result)

    def __truediv__(self, part: Any) -> Substitution:
        path = Substitution()
        path.function = lambda context: "/".join(map(context.text, (self, part)))
        return path


class LaunchDescription:
    """The parts of a launch file in order."""

    def __init__(self, initial_entities: Iterable[Any] | None = None, **_: Any) -> None:
        self.entities: list[Any] = [*(initial_entities or ())]
        self.add_action = self.add_entity = self.entities.append

    def visit(self, _: LaunchContext) -> list[Any]:
        """Return the parts."""
        return self.entities


class Action(Part):
    """A part that does something.

    Attributes:
        condition: What it needs to be executed, or None.
        place: Where the file makes it.
    """

    def __init__(self, *, condition: Any = None) -> None:
        self.condition = condition
        frame = sys._getframe()  # noqa: SLF001  # there is no other way to see one's callers
        while frame.f_back is not None and not _is_users(frame.f_code.co_filename):
            frame = frame.f_back
        position = next(islice(frame.f_code.co_positions(), frame.f_lasti // 2, None))
        self.place = Place(frame.f_code.co_filename, frame.f_lineno, (position[2] or 0) + 1)

    def visit(self, context: LaunchContext) -> Any:
        """Execute the action if its condition holds, and return further ones or None."""
        with refusing(self.place, context.includes):
            context.place = replace(self.place, includes=context.includes)
            if self.condition is None or self.condition.evaluate(context):
                return self.execute(context)
        return None

    def execute(self, context: LaunchContext) -> Any:
        """Execute the action, and return further ones or None."""
        return self.function(context)


def make(module: str, base: type, functions: Mapping[str, Callable[..., Any]]) -> dict[str, Any]:
    """Return classes of parts by name, which take the arguments of a function but its context."""

    def make_one(name: str, function: Callable[..., Any]) -> Any:
        def create(self: Any, *args: Any, **options: Any) -> None:
            if base is Action:
                Action.__init__(self, condition=options.pop("condition", None))
            given = signature(function).bind(None, *args, **options).arguments
            vars(self).update([*given.items()][1:])
            self.function = lambda context: function(context, *args, **options)

        return type(name, (base,), {"__init__": create, "__module__": module})

    return {name: make_one(name, function) for name, function in functions.items()}


def visit_all(context: LaunchContext, entities: Any) -> None:
    """Execute parts of a launch file, and those that they return."""
    for entity in entities if isinstance(entities, list | tuple) else [entities]:
        if hasattr(entity, "visit"):
            visit_all(context, entity.visit(context))
        elif entity is not None:
            raise SubstitutionFailure(f"{entity!r} is not an action")


def _is_users(file: str) -> bool:
    return not file.startswith(_LIBRARIES) or file.startswith(f"{_ROSZ}/share")


@contextmanager
def refusing(place: Place, includes: tuple[str, ...]) -> Iterator[None]:
    """Turn any error of a block into one of the launch file, as the user's code may fail anyhow."""
    try:
        yield
    except LaunchFileError:
        raise
    except (Exception, SystemExit) as error:
        file, line, column = place.file, place.line, place.column
        for frame, number in walk_tb(error.__traceback__):
            if _is_users(frame.f_code.co_filename):
                file, line, column = frame.f_code.co_filename, number, 0
        ours = isinstance(error, RoszError) or type(error).__module__.startswith("rosz.")
        text = str(error) if ours else f"{type(error).__name__}: {error}"
        if isinstance(error, SyntaxError):
            text = f"{error.msg}: {(error.text or '').strip()}"
            if error.filename != "<string>":  # which is an expression in the file
                file, line, column = error.filename or file, error.lineno or 0, error.offset or 0
        if isinstance(error, ImportError):
            text = text.replace("rosz.ros2.", "").partition(" (")[0] + ", which rosz does not have"
        raise LaunchFileError(text, file, line, column, includes) from error
