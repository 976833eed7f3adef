"""Substitution args: ``$(arg x)``, ``$(find pkg)/file``, ``$(eval …)`` and the others.

A value takes two passes, as in roslaunch: first every substitution except ``find``, then ``find``,
which needs the path that follows it. The second pass sees the results of the first one.
Substitutions do not nest, there is no escape, and an unclosed one stays as it is.

Two substitutions of ROS 2 are understood too: ``$(var x)`` is ``$(arg x)``, and
``$(find-pkg-share pkg)`` is the folder of a package; the path that follows is left alone.
"""

from __future__ import annotations

import os.path
import re
from collections.abc import Callable, Mapping
from typing import Any

from rosz.errors import LaunchError, RoszError, near_miss
from rosz.launch.plan.context import LaunchContext
from rosz.launch.plan.document import TextError
from rosz.launch.plan.scope import Scope

_EVAL = "$(eval "
_SUGGESTED = ("anon", "arg", "dirname", "env", "eval", "find", "optenv")
_SUBSTITUTION = re.compile(r"\$\(([^$()]*)([$()])?")
_MOST_CHARACTERS = 1 << 26
"""Most characters of all substituted values of a plan. Each include may double an arg."""
_COMMANDS = ("anon", "arg", "dirname", "env", "find", "find-pkg-share", "optenv", "var")


def guess_type(text: str) -> bool | int | float | str:
    """Convert a text to the type that roslaunch guesses.

    A text with a dot is a float if it can be, one without is an int if it can be (``1e5`` is
    neither, nor is ``1_000``); ``true`` and ``false`` in any case are bool; the rest is text.
    """
    try:
        if "." in text:
            return float(text)
        if "_" not in text:
            return int(text)
    except ValueError:
        pass
    lower = text.lower()
    return lower == "true" if lower in {"true", "false"} else text


def parse_bool(text: str) -> bool:
    """Return the bool that a text of a condition or a parameter means.

    Raises:
        ValueError: If it means none.
    """
    lower = text.lower().strip()
    if lower not in {"true", "1", "false", "0"}:
        raise ValueError(f"'{text}' is not a bool; expected true, false, 1 or 0")
    return lower in {"true", "1"}


def substitute(
    text: str, context: LaunchContext, args: dict[str, str], anonymous: dict[str, str], file: str
) -> str:
    """Return a text outside any launch file with all substitutions applied.

    Args:
        text: The text.
        context: Source of variables, packages and anonymous names.
        args: Values of args by name.
        anonymous: Names made by ``$(anon)`` by base name, which grow here.
        file: Path of the launch file, for ``$(dirname)``.

    Raises:
        LaunchError: If a substitution is malformed or has no value.
    """
    scope = Scope("/", file)
    scope.args, scope.anonymous = args, anonymous
    try:
        return Substitution(context)(text, scope)
    except TextError as error:
        raise LaunchError(error.reason) from error


class Substitution:
    """Applies substitutions.

    Args:
        context: Source of variables, packages and anonymous names.

    Attributes:
        used: Names of all args that were looked up.
    """

    def __init__(self, context: LaunchContext) -> None:
        self._context = context
        self._left = _MOST_CHARACTERS
        self.used: set[str] = set()

    def __call__(self, text: str, scope: Scope) -> str:
        """Return a text with all substitutions applied.

        Raises:
            TextError: If a substitution is malformed or has no value.
        """
        if "$" not in text:
            return text
        if text.startswith(_EVAL) and text.endswith(")"):
            value = self._evaluate(text[len(_EVAL) : -1], scope)
            self._charge(len(value))
            return value
        resolved = text
        for inner, index in _collect(text):
            command, words = _split(inner, index)
            if command not in {"find", "eval"}:
                value = self._value(command, words, scope, index)
                self._charge(resolved.count(f"$({inner})") * len(value), index)
                resolved = resolved.replace(f"$({inner})", value)
        return self._find_all(resolved, text)

    def _charge(self, size: int, index: int = 0) -> None:
        self._left -= size
        if self._left < 0:
            raise TextError(f"all values have more than {_MOST_CHARACTERS} characters", index)

    def _value(self, command: str, words: list[str], scope: Scope, index: int) -> str:
        if command == "optenv":
            if not words:
                raise TextError("$(optenv NAME DEFAULT…) needs the name of a variable", index)
            return self._environ(scope).get(words[0], " ".join(words[1:]))
        if command == "dirname":
            return self._dirname(scope)
        if len(words) != 1:
            noun = {"env": "variable", "find-pkg-share": "package"}.get(command, "name")
            raise TextError(
                f"$({command} …) takes one {noun}, got {len(words)}: '{' '.join(words)}'", index
            )
        try:
            match command:
                case "env":
                    return self._env(words[0], scope)
                case "anon":
                    return self._anon(words[0], scope)
                case "find-pkg-share":
                    return self._find(words[0])
                case _:
                    return self._arg(words[0], scope)
        except TextError as error:
            raise TextError(error.reason, index) from None

    def _environ(self, scope: Scope) -> Mapping[str, str]:
        return {**self._context.environ, **scope.environ}

    def _env(self, name: str, scope: Scope) -> str:
        environ = self._environ(scope)
        if name in environ:
            return environ[name]
        hint = near_miss(name, environ) or f"; set it, or write $(optenv {name} DEFAULT)"
        raise TextError(f"environment variable '{name}' is not set{hint}")

    def _anon(self, base: str, scope: Scope) -> str:
        if base not in scope.anonymous:
            scope.anonymous[base] = self._context.anonymous(base)
        return scope.anonymous[base]

    def _arg(self, name: str, scope: Scope) -> str:
        self.used.add(name)
        if name in scope.args:
            return scope.args[name]
        hint = near_miss(name, scope.args)
        if name in (scope.incoming or {}):
            hint = "; the args of an <include> do not see each other"
        elif name in scope.declared:
            how = "the <include> must pass it" if scope.included else f"give it: {name}:=VALUE"
            hint = f"; it has no default, so {how}"
        elif not hint:
            hint = f"; declare it before: <arg name='{name}' default='…'/>"
        raise TextError(f"arg '{name}' is not set{hint}")

    def _dirname(self, scope: Scope) -> str:
        folder = os.path.dirname(scope.file)  # noqa: PTH120  # text only, no file is opened
        return os.path.normpath(os.path.join(self._context.cwd, folder))  # noqa: PTH118  # text

    def _find(self, package: str) -> str:
        try:
            return self._context.find(package)
        except RoszError as error:
            raise TextError(str(error)) from error

    def _find_all(self, text: str, source: str) -> str:
        """Replace each ``$(find PKG)`` and the path that follows it, up to the first space."""
        resolved = text
        for inner, index in _collect(text):
            command, words = _split(inner, index)
            if command != "find":
                continue
            written = f"$({inner})"
            place = max(source.find(written), 0)
            if len(words) != 1:
                raise TextError(f"$(find …) takes one package, got {len(words)}", place)
            before, _, after = resolved.partition(written)
            path, space, rest = after.partition(" ")
            try:
                resolved = before + self._path(words[0], path) + space + rest
            except TextError as error:
                raise TextError(error.reason, place) from None
        return resolved

    def _path(self, package: str, path: str) -> str:
        path = path.replace("\\", "/").removeprefix("/")
        folder = self._find(package)
        if not path:
            return folder
        built = self._context.built(package, path.rpartition("/")[2])
        return built or os.path.join(folder, path)  # noqa: PTH118  # an absolute path wins

    def _evaluate(self, text: str, scope: Scope) -> str:
        from rosz.launch.plan.expression import evaluate

        def arg(name: str) -> Any:
            return guess_type(self._arg(name, scope))

        def variable(name: str) -> Any | None:
            self.used.add(name)
            return guess_type(scope.args[name]) if name in scope.args else None

        own: Mapping[str, Callable[..., Any]] = {
            "anon": lambda base: self._anon(base, scope),
            "arg": arg,
            "dirname": lambda: self._dirname(scope),
            "env": lambda name: self._env(name, scope),
            "find": self._find,
            "optenv": lambda name, default="": self._environ(scope).get(name, default),
            "var": arg,
        }
        try:
            return evaluate(text, own, variable, scope.args)
        except TextError as error:
            raise TextError(f"$(eval …): {error.reason}", len(_EVAL) + error.index) from None


def _split(inner: str, index: int) -> tuple[str, list[str]]:
    words = [word for word in inner.split(" ") if word]
    if words and words[0] in _COMMANDS:
        return words[0], words[1:]
    if words and words[0] == "eval":
        raise TextError(
            "$(eval …) must be the whole value, from the first character to the last", index
        )
    name = words[0] if words else ""
    hint = near_miss(name, _SUGGESTED) or f"; there are {', '.join(_COMMANDS)}, eval"
    raise TextError(f"unknown substitution '$({inner})'{hint}", index)


def _collect(text: str) -> list[tuple[str, int]]:
    """Return the content and the start of every substitution in a text."""
    contents: list[tuple[str, int]] = []
    for match in _SUBSTITUTION.finditer(text):
        content, end = match.groups()
        if end in {"$", "("}:
            reason = "substitutions do not nest; $(eval …) can combine values"
            raise TextError(f"'{end}' inside a substitution; {reason}", match.start(2))
        if content and end:
            contents.append((content, match.start()))
    return contents
