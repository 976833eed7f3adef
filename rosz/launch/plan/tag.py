"""One tag in its scope: attributes with substitutions applied, errors and warnings with places."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NoReturn

from rosz.errors import InvalidName
from rosz.launch.plan.document import TAGS, Element, TagError, TextError, unknown_attribute
from rosz.launch.plan.model import Place
from rosz.launch.plan.scope import Scope
from rosz.launch.plan.substitution import Substitution

__all__ = ("Tag", "Warn")

Warn = Callable[[Element, str, str | None, int], None]
"""Takes a warning: element, text, attribute name or None, index in the attribute's value."""


class Tag:
    """An element in a scope.

    Args:
        element: The element.
        scope: The scope that substitutions look names up in.
        substitution: Applies the substitutions.
        warn: Function that takes warnings.
        refuse: Function that takes the error of a tag, and raises it unless all are wanted.
        includes: Places of the ``<include>`` tags that led here, outermost first.

    Attributes:
        element: The element.
        scope: The scope.
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
        known = TAGS[self.name].attributes
        for attribute in self.element.attributes:
            foreign = ":" in attribute and self.name == "launch"  # a schema for editors
            if attribute not in known and not foreign:
                self.warn(unknown_attribute(self.name, attribute), attribute)

    def wanted(self) -> bool:
        """Return whether ``if`` and ``unless`` let the tag take part.

        Raises:
            TagError: If both are present, or one is not a bool.
        """
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
        lower = text.lower().strip()
        if lower in {"true", "1"}:
            return True
        if lower not in {"false", "0"}:
            reason = f"'{text}' is not a bool; expected true, false, 1 or 0"
            self.fail(f"'{attribute}': {reason}", attribute)
        return False

    def get(self, attribute: str) -> str | None:
        """Return an attribute with substitutions applied, or None if it is absent.

        Raises:
            TagError: If a substitution fails.
        """
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
        """Return a required attribute.

        Args:
            attribute: Name of the attribute.
            *others: Names to try in turn if the attribute is absent.

        Raises:
            TagError: If the attribute is absent, or a substitution fails.
        """
        texts = (self.get(name) for name in (attribute, *others))
        found = next((text for text in texts if text is not None), None)
        if found is None:
            known = TAGS[self.name].attributes
            strangers = [name for name in self.element.attributes if name not in known]
            hint = f", and '{strangers[0]}' is not one of its attributes" if strangers else ""
            self.fail(f"<{self.name}> needs the attribute '{attribute}'{hint}")
        return found

    def alias(self, attribute: str, other: str) -> str | None:
        """Return an attribute, or if it is absent, the attribute that ROS 2 uses for it.

        Raises:
            TagError: If a substitution fails.
        """
        if attribute not in self.element.attributes:
            return self.get(other)
        if other in self.element.attributes:
            self.warn(f"'{other}' is ignored beside '{attribute}'", other)
        return self.get(attribute)

    def flag(self, attribute: str) -> bool:
        """Return a bool attribute, or False if it is absent.

        Raises:
            TagError: If the value is neither ``true`` nor ``false``.
        """
        text = self.get(attribute)
        if text is None:
            return False
        if text.lower() not in {"true", "false"}:
            self.fail(f"'{attribute}' is '{text}'; expected true or false", attribute)
        return text.lower() == "true"

    def number(self, attribute: str, default: float, least: float = -math.inf) -> float:
        """Return an attribute that is a finite number.

        Args:
            attribute: Name of the attribute.
            default: Value to return if the attribute is absent.
            least: Least value allowed.

        Raises:
            TagError: If the value is not a number, or is below the least value.
        """
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
        """Return an attribute that is a whole number.

        Args:
            attribute: Name of the attribute.
            default: Value to return if the attribute is absent or empty.
            least: Least value allowed.

        Raises:
            TagError: If the value is not a whole number, or is below the least value.
        """
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
        """Return an attribute split into words as a shell does, or () if it is absent.

        Raises:
            TagError: If the quotes do not match.
        """
        return self.split(attribute, self.get(attribute) or "")

    def split(self, attribute: str, text: str) -> tuple[str, ...]:
        """Split the value of an attribute into words as a shell does.

        Raises:
            TagError: If the quotes do not match.
        """
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

        Raises:
            TagError: If a substitution fails.
        """
        text = self.get(attribute) or ""
        try:
            return self._substitution(text, Scope("/", "")) if "$(" in text else text
        except TextError as error:
            self.fail(f"in '{text}', which '{attribute}' came to: {error.reason}", attribute)

    def remap(self, into: Scope) -> None:
        """Add the remapping of a ``<remap>`` to a scope.

        Raises:
            TagError: If a name is missing or invalid.
        """
        self.check()
        old, new = self.require("from"), self.require("to")
        try:
            into.remap(old, new)
        except TextError as error:
            raise TagError(self.element, error.reason) from error
        except InvalidName as error:
            self.fail(str(error), "from" if error.name in {old, old.strip("/")} else "to")

    def env(self, into: Scope) -> None:
        """Add the variable of an ``<env>`` or ``<set_env>`` to a scope.

        Raises:
            TagError: If the name or the value is missing.
        """
        self.check()
        name, value = self.require("name"), self.require("value")
        if not name:
            self.fail("'name' is empty; expected the name of a variable", "name")
        into.env.append((name, value))
        if self.name == "set_env":
            into.environ[name] = value

    def fail(self, reason: str, attribute: str | None = None, index: int = 0) -> NoReturn:
        """Refuse the file.

        Raises:
            TagError: Always.
        """
        raise TagError(self.element, reason, attribute, index)

    def warn(self, text: str, attribute: str | None = None, index: int = 0) -> None:
        """Warn the user."""
        self._warn(self.element, text, attribute, index)
