"""Read launch files into a plan: the walk through tags, groups and includes.

The walk keeps its own stack, so that neither deep groups nor long chains of includes reach Python's
recursion limit. A file may include itself under a condition, up to `MAX_INCLUDES` deep.
"""

from __future__ import annotations

import os.path
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from rosz.errors import LaunchFileError, RoszError, near_miss
from rosz.launch.plan.context import LaunchContext, LaunchText
from rosz.launch.plan.document import Document, Element, TagError, TextError, misplaced, parse
from rosz.launch.plan.model import ArgDoc, Notice, Place, Plan, PlanBuilder
from rosz.launch.plan.node import (
    read_container,
    read_executable,
    read_machine,
    read_namespace,
    read_node,
    read_test,
    read_wait,
)
from rosz.launch.plan.param import read_param, read_rosparam
from rosz.launch.plan.scope import Scope, make_global
from rosz.launch.plan.substitution import Substitution
from rosz.launch.plan.tag import Tag

MAX_INCLUDES = 300
"""Maximum depth of includes, about that of roslaunch."""
MAX_INCLUDED = 100_000
"""Maximum number of tags in all included files, each counted as often as it is included."""

_SHOWN_INCLUDES = 12


def plan(
    files: Sequence[str | Path | LaunchText],
    args: Mapping[str, str],
    context: LaunchContext,
    *,
    ns: str = "",
    faults: list[LaunchFileError] | None = None,
    assign_machines: bool = True,
) -> Plan:
    """Read launch files into a plan.

    Args:
        files: Paths, relative to the context's folder, or texts; read in order into one plan.
        args: Values for ``<arg>`` by name, for all files.
        context: The system around the launch.
        ns: Namespace to begin in: ``__ns``, otherwise ``ROS_NAMESPACE``.
        faults: List for the error of each tag that is refused, and then left out; the first one is
            raised when not given. Later tags may depend on a refused ``<arg>``, so its error
            is always raised.
        assign_machines: Whether every node is assigned to its machine, which has to be declared.

    Raises:
        LaunchFileError: If a file is refused, or cannot be read.
    """
    loader = _LaunchLoader(context, args, ns, faults=faults)
    for file in files:
        loader.load(file)
    return loader.finish(assign_machines=assign_machines)


def describe_args(
    files: Sequence[str | Path | LaunchText],
    args: Mapping[str, str],
    context: LaunchContext,
    *,
    ns: str = "",
) -> tuple[ArgDoc, ...]:
    """Return the args that the last file takes, in order, reading only ``<arg>`` tags.

    Raises:
        LaunchFileError: If a file is refused, or cannot be read.
    """
    loader = _LaunchLoader(context, args, ns, args_only=True)
    for file in files:
        loader.load(file)
    return tuple(loader.docs.values())


class _Frame(msgspec.Struct):
    """A position in a list of sibling tags."""

    children: Iterator[Element]
    scope: Scope
    chain: tuple[tuple[str, str], ...]
    root: str = "launch"
    leave: Callable[[], None] | None = None


class _LaunchLoader:
    """Reads files into one plan."""

    def __init__(
        self,
        context: LaunchContext,
        args: Mapping[str, str],
        ns: str,
        *,
        args_only: bool = False,
        faults: list[LaunchFileError] | None = None,
    ) -> None:
        self.docs: dict[str, ArgDoc] = {}
        self.builder = PlanBuilder(context)
        self._context = context
        self._given = dict(args)
        self._ns = ns
        self._args_only = args_only
        self._faults = faults
        self._substitution = Substitution(context)
        self._documents: dict[str, Document] = {}
        self._declared: set[str] = set()
        self._stack: list[_Frame] = []
        self._chain: tuple[tuple[str, str], ...] = ()
        self._included = 0

    def finish(self, *, assign_machines: bool) -> Plan:
        used = self._declared | self._substitution.used
        unused = tuple(name for name in self._given if name not in used)
        for name in unused:
            hint = near_miss(name, self._declared)
            text = f"no file declares an arg '{name}', so '{name}:=…' does nothing{hint}"
            self.builder.warnings.append(Notice(text, Place("<command line>")))
        return self.builder.build(unused, assign_machines=assign_machines)

    def load(self, file: str | Path | LaunchText) -> None:
        self._chain = ()
        self.builder.default_machine = ""
        if isinstance(file, LaunchText):
            path = file.name
            data = file.text.encode() if isinstance(file.text, str) else file.text
            document = parse(path, data)
        else:
            path = str(file)
            try:
                document = self._document(path)
            except OSError as error:
                raise LaunchFileError(f"cannot be read: {error.strerror}", path) from error
        try:
            scope = Scope(make_global(self._ns), path)
        except TextError as error:
            raise LaunchFileError(error.reason, "<command line>") from error
        scope.args = dict(self._given)
        self.docs = {}
        self._launch(document.launch, scope)
        self._stack = [_Frame(iter(document.launch.children), scope, ())]
        self._walk()

    def _document(self, path: str) -> Document:
        if path not in self._documents:
            self._documents[path] = parse(path, self._context.read(path))
        absolute = os.path.normpath(os.path.join(self._context.cwd, path))  # noqa: PTH118  # pure
        self.builder.files.setdefault(absolute)
        return self._documents[path]

    def _walk(self) -> None:
        stack = self._stack
        while stack:
            frame = stack[-1]
            self._chain = frame.chain
            element = next(frame.children, None)
            if element is None:
                stack.pop()
                if frame.leave is not None:
                    frame.leave()
                continue
            self._included += bool(frame.chain)
            if self._included > MAX_INCLUDED:
                reason = f"the included files have more than {MAX_INCLUDED} tags"
                self._faults = None  # so that this is raised: a list of faults would go on
                self._refuse(TagError(element, reason))
            try:
                self._read(element, frame)
            except TagError as error:
                self._refuse(error)
            except LaunchFileError as error:  # of an included file that is not XML
                if self._faults is None:
                    raise
                self._faults.append(error)

    def _read(self, element: Element, frame: _Frame) -> None:
        if self._args_only and element.tag != "arg":
            return
        tag = self._tag(element, frame.scope)
        reader = _READERS.get(element.tag)
        if reader is None:
            if element.tag == "master":
                tag.warn("<master> has no meaning any more")
            else:
                tag.warn(misplaced(element.tag, frame.root))
        elif tag.wanted():
            reader(self, tag)

    def _tag(self, element: Element, scope: Scope) -> Tag:
        return Tag(element, scope, self._substitution, self._warn, self._refuse, self._places())

    def _places(self) -> tuple[str, ...]:
        return tuple(place for place, _ in self._chain)

    def _launch(self, element: Element, scope: Scope) -> None:
        """Read the attributes of a ``<launch>``; conditions on it do nothing, as in roslaunch."""
        tag = self._tag(element, scope)
        try:
            tag.check()
            if "if" in element.attributes or "unless" in element.attributes:
                tag.wanted()
                tag.warn("conditions on <launch> do nothing; put them on its tags or the <include>")
        except TagError as error:
            self._refuse(error)
        text = element.attributes.get("deprecated")
        if text:
            self.builder.deprecations.append(Notice(text, tag.place))

    def read_arg(self, tag: Tag) -> None:
        tag.check()
        name, value, default = tag.require("name"), tag.get("value"), tag.get("default")
        if value is not None and default is not None:
            tag.fail("<arg> has both 'value' and 'default'; keep one", "default")
        doc = tag.alias("doc", "description")
        with tag.refusing("name"):
            tag.scope.declare(name, value, default)
        self._declared.add(name)
        if len(self._stack) == 1 and not value:
            self.docs[name] = ArgDoc(name, doc, default)

    def read_let(self, tag: Tag) -> None:
        tag.check()
        tag.scope.args[tag.require("name")] = tag.require("value")

    def read_group(self, tag: Tag) -> None:
        tag.check()
        scope = self._open(tag, read_namespace(tag))
        scope.private = dict(scope.private)
        scope.waits = (*scope.waits, *read_wait(tag, scope.ns))
        read_container(tag, scope)
        self._stack.append(_Frame(iter(tag.element.children), scope, self._chain, root="group"))

    def _open(self, tag: Tag, ns: str | None, *, include: bool = False) -> Scope:
        with tag.refusing("ns"):
            scope = tag.scope.include(ns) if include else tag.scope.child(ns)
        if tag.get("clear_params") and tag.flag("clear_params"):
            if not ns:
                tag.fail("'clear_params' needs 'ns'", "clear_params")
            self.builder.clear(scope.ns)
        return scope

    def read_push_namespace(self, tag: Tag) -> None:
        tag.check()
        with tag.refusing("namespace"):
            tag.scope.ns = tag.scope.child(tag.require("namespace")).ns

    def read_include(self, tag: Tag) -> None:
        tag.check()
        path = tag.require("file")
        pass_all = tag.flag("pass_all_args")
        scope = self._open(tag, read_namespace(tag), include=True)
        if pass_all:
            for name, value in tag.scope.args.items():
                scope.declare(name, value, None)
            scope.lenient = True
        self._read_passed(tag, scope)
        with tag.refusing():
            passed = scope.enter()
        document = self._include(tag, path)
        scope.file = path
        chain = self._chain
        self._chain = (*chain, (str(tag.place), path))
        self._launch(document.launch, scope)

        def leave() -> None:
            unknown = [name for name in passed if name not in scope.declared]
            if unknown and not pass_all:
                self._chain = chain
                hint = near_miss(unknown[0], scope.declared)
                takes = f"; it takes {', '.join(scope.declared)}" if scope.declared else ""
                reason = f"'{path}' declares no arg '{unknown[0]}'{hint or takes}"
                self._refuse(TagError(tag.element, reason))

        self._stack.append(_Frame(iter(document.launch.children), scope, self._chain, leave=leave))

    def _read_passed(self, tag: Tag, scope: Scope) -> None:
        for element in tag.element.children:
            inner = tag.inside(element, scope)
            if inner.name not in {"arg", "env"}:
                inner.warn(misplaced(element.tag, "include"))
            elif inner.wanted():
                if inner.name == "env":
                    inner.env(scope)
                else:
                    self.read_arg(inner)

    def _include(self, tag: Tag, path: str) -> Document:
        if len(self._chain) >= MAX_INCLUDES:
            loop = [file for _, file in self._chain]
            by_way = (
                " and ".join(dict.fromkeys(loop[-loop[::-1].index(path) :])) if path in loop else ""
            )
            again = f"; '{path}' includes itself through {by_way}" if by_way else ""
            tag.fail(f"includes nest deeper than {MAX_INCLUDES}{again}", "file")
        try:
            return self._document(path)
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            hint = "; launch files in Python are not read" if path.endswith(".py") else ""
            tag.fail(f"'{path}' cannot be read: {reason}{hint}", "file")
        except LaunchFileError as error:
            if path.endswith((".py", ".yaml", ".yml")):
                tag.fail(f"'{path}' is not XML; launch files are read as XML only", "file")
            places = (*self._places(), str(tag.place))
            raise LaunchFileError(
                error.reason, error.path, error.line, error.column, _shorten(places)
            ) from None

    def _warn(self, element: Element, text: str, attribute: str | None, index: int) -> None:
        line, column = element.locate(attribute, index)
        place = Place(element.file, line, column, self._places())
        self.builder.warnings.append(Notice(text, place))

    def _refuse(self, error: TagError) -> None:
        places, element = self._places(), error.element
        path, line, column = element.file, *element.locate(error.attribute, error.index)
        if error.place is not None:
            if error.place[0] != path:
                places = (*places, f"{path}:{line}:{column}")
            path, line, column = error.place
        cause = error.__cause__ if isinstance(error.__cause__, RoszError) else None
        fault = LaunchFileError(error.reason, path, line, column, _shorten(places))
        if self._faults is None or element.tag == "arg":
            raise fault from cause
        self._faults.append(fault)


def _shorten(places: tuple[str, ...]) -> tuple[str, ...]:
    """Return the places of a chain of includes, without the middle of a long one."""
    if len(places) <= _SHOWN_INCLUDES:
        return places
    half = _SHOWN_INCLUDES // 2
    return (*places[:half], f"… {len(places) - 2 * half} more", *places[-half:])


_READERS: Mapping[str, Callable[[_LaunchLoader, Tag], None]] = {
    "arg": _LaunchLoader.read_arg,
    "env": lambda _, tag: tag.env(tag.scope),
    "executable": lambda loader, tag: read_executable(tag, loader.builder),
    "group": _LaunchLoader.read_group,
    "include": _LaunchLoader.read_include,
    "let": _LaunchLoader.read_let,
    "machine": lambda loader, tag: read_machine(tag, loader.builder),
    "node": lambda loader, tag: read_node(tag, loader.builder),
    "param": lambda loader, tag: read_param(tag, loader.builder),
    "push-ros-namespace": _LaunchLoader.read_push_namespace,
    "push_ros_namespace": _LaunchLoader.read_push_namespace,
    "remap": lambda _, tag: tag.remap(tag.scope),
    "rosparam": lambda loader, tag: read_rosparam(tag, loader.builder),
    "set_env": lambda _, tag: tag.env(tag.scope),
    "test": lambda loader, tag: read_test(tag, loader.builder),
}
