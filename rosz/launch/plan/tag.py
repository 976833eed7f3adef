"""One tag in its scope: attributes with substitutions applied, errors and warnings with places."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NoReturn

from rosz.errors import InvalidName
from rosz.launch.plan.document import TAGS, Element, TagError, TextError, unknown_attribute
from rosz.launch.plan.model import Place
from rosz.launch.plan.scope import Scope
from rosz.launch.plan.substitution import Substitution, parse_bool

Warn = Callable[[Element, str, str | None, int], None]
"""Takes a warning: element, text, attribute name or None, index in the attribute's value."""


class Tag:
    """An element in a scope.

    Methods that read an attribute raise `TagError`, at its place, if the attribute is wrong or a
    substitution in it fails.

    Args:
        refuse: Function that takes the error of a tag, and raises it unless all are wanted.
        includes: Places of the ``<include>`` tags that led here, outermost first.

    Attributes:
        name: Name of the tag in lower case.
    """

    def __init__(
        self,
        element: Element,
        scope: Scope,
        substitution: Substitution,
        warn: Warn,
        refuse: Callable[[TagError], None],
        includes: tuple[str, ...],
    ) -> None:
        self.element = element
        self.scope = scope
        self.name: str = element.tag.lower()
        self._substitution = substitution
        self._warn = warn
        self.refuse = refuse
        self._includes = includes

    def inside(self, element: Element, scope: Scope) -> Tag:
        """Return the tag for a child element."""
        return Tag(element, scope, self._substitution, self._warn, self.refuse, self._includes)

    @property
    def place(self) -> Place:
        """The position of the tag."""
        element = self.element
        return Place(element.file, element.line, element.column, self._includes)

    def check(self) -> None:
        """Warn about attributes that the tag does not have."""
        allowed = TAGS[self.name].attributes
        for attribute in self.element.attributes:
            foreign = ":" in attribute and self.name == "launch"  # a schema for editors
            if attribute not in allowed and not foreign:
                self.warn(unknown_attribute(self.name, attribute), attribute)

    def wanted(self) -> bool:
        """Return whether ``if`` and ``unless`` let the tag take part."""
        attributes = self.element.attributes
        if "if" not in attributes and "unless" not in attributes:
            return True
        condition, exclusion = self.get("if"), self.get("unless")
        if condition is not None and exclusion is not None:
            self.fail(f"<{self.name}> has both 'if' and 'unless'; keep one", "unless")
        if condition is not None:
            return self._condition(condition, "if")
        return not self._condition(exclusion or "", "unless")

    def _condition(self, text: str, attribute: str) -> bool:
        try:
            return parse_bool(text)
        except ValueError as error:
            self.fail(f"'{attribute}': {error}", attribute)

    def get(self, attribute: str) -> str | None:
        """Return an attribute with substitutions applied, or None if it is absent."""
        text = self.element.attributes.get(attribute)
        if text is None or "$" not in text:
            return text
        try:
            resolved = self._substitution(text, self.scope)
        except TextError as error:
            raise TagError(self.element, error.reason, attribute, error.index) from error
        if "$(" in resolved and "$(" in text:
            start = text.rfind("$(")
            if ")" not in text[start:]:
                self.warn("'$(' is never closed, so it stays as it is", attribute, start)
        return resolved

    def substitute(self, text: str) -> str:
        """Apply the substitutions in a text that belongs to the tag.

        Raises:
            TextError: If a substitution fails.
        """
        return self._substitution(text, self.scope)

    def require(self, attribute: str, *others: str) -> str:
        """Return a required attribute, or the first of the others that is there."""
        texts = (self.get(name) for name in (attribute, *others))
        value = next((text for text in texts if text is not None), None)
        if value is None:
            allowed = TAGS[self.name].attributes
            strangers = [name for name in self.element.attributes if name not in allowed]
            hint = f", and '{strangers[0]}' is not one of its attributes" if strangers else ""
            self.fail(f"<{self.name}> needs the attribute '{attribute}'{hint}")
        return value

    def alias(self, attribute: str, other: str) -> str | None:
        """Return an attribute, or if it is absent, the attribute that ROS 2 uses for it."""
        if attribute not in self.element.attributes:
            return self.get(other)
        if other in self.element.attributes:
            self.warn(f"'{other}' is ignored beside '{attribute}'", other)
        return self.get(attribute)

    def flag(self, attribute: str) -> bool:
        """Return a bool attribute, or False if it is absent."""
        text = self.get(attribute)
        if text is None:
            return False
        if text.lower() not in {"true", "false"}:
            self.fail(f"'{attribute}' is '{text}'; expected true or false", attribute)
        return text.lower() == "true"

    def number(self, attribute: str, default: float, least: float = -math.inf) -> float:
        """Return an attribute that is a finite number, or the default if it is absent."""
        text = self.get(attribute)
        if text is None:
            return default
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or value < least:
            bound = f" of at least {least:g}" if math.isfinite(least) else ""
            self.fail(f"'{attribute}' is '{text}'; expected a number{bound}", attribute)
        return value

    def whole(self, attribute: str, default: int | None, least: float) -> int | None:
        """Return an attribute that is a whole number, or the default if it is absent or empty."""
        text = self.get(attribute)
        if not text:
            return default
        try:
            value = int(text)
        except ValueError:
            self.fail(f"'{attribute}' is '{text}'; expected a whole number", attribute)
        if value < least:
            self.fail(f"'{attribute}' is '{text}'; expected {least} or more", attribute)
        return value

    def words(self, attribute: str) -> tuple[str, ...]:
        """Return an attribute split into words as a shell does, or () if it is absent."""
        return self.split(attribute, self.get(attribute) or "")

    def split(self, attribute: str, text: str) -> tuple[str, ...]:
        """Split the value of an attribute into words as a shell does."""
        if not text:
            return ()
        import shlex

        try:
            return tuple(shlex.split(text))
        except ValueError as error:
            self.fail(f"'{attribute}' cannot be split: {str(error).lower()}: {text}", attribute)

    def again(self, attribute: str) -> str:
        """Return an attribute with substitutions applied twice, as roslaunch does for ``args``.

        The second time, no args and no anonymous names are known.
        """
        text = self.get(attribute) or ""
        try:
            return self._substitution(text, Scope("/", "")) if "$(" in text else text
        except TextError as error:
            self.fail(f"in '{text}', which '{attribute}' came to: {error.reason}", attribute)

    def remap(self, into: Scope) -> None:
        """Add the remapping of a ``<remap>`` to a scope."""
        self.check()
        old, new = self.require("from"), self.require("to")
        try:
            with self.refusing():
                into.remap(old, new)
        except InvalidName as error:
            self.fail(str(error), "from" if error.name in {old, old.strip("/")} else "to")

    def env(self, into: Scope) -> None:
        """Add the variable of an ``<env>`` or ``<set_env>`` to a scope."""
        self.check()
        name, value = self.require("name"), self.require("value")
        if not name:
            self.fail("'name' is empty; expected the name of a variable", "name")
        into.env.append((name, value))
        if self.name == "set_env":
            into.environ[name] = value

    @contextmanager
    def refusing(self, attribute: str | None = None) -> Iterator[None]:
        """Refuse the file for a `TextError` in a block, with the place of an attribute."""
        try:
            yield
        except TextError as error:
            raise TagError(self.element, error.reason, attribute) from error

    def fail(self, reason: str, attribute: str | None = None, index: int = 0) -> NoReturn:
        """Refuse the file."""
        raise TagError(self.element, reason, attribute, index)

    def warn(self, text: str, attribute: str | None = None, index: int = 0) -> None:
        """Warn the user."""
        self._warn(self.element, text, attribute, index)
