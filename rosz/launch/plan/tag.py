"""A tag read in a scope: attributes with substitutions made, complaints with a place."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NoReturn

from rosz.errors import InvalidName
from rosz.launch.plan.document import Element
from rosz.launch.plan.fault import Fault, TextFault
from rosz.launch.plan.model import Place
from rosz.launch.plan.scope import Scope
from rosz.launch.plan.substitution import Substitution
from rosz.launch.plan.tags import TAGS, unknown_attribute
from rosz.launch.plan.value import boolean

__all__ = ("Notify", "Tag")

Notify = Callable[[Element, str, str | None, int], None]
"""Takes a warning: the tag, the text, the attribute or None, an index in its value."""


class Tag:
    """A tag in a scope.

    Args:
        element: The tag.
        scope: What its substitutions see.
        substitution: Makes them.
        notify: Takes warnings.
        includes: Places of the ``<include>`` tags that led here, outermost first.

    Attributes:
        element: The tag.
        scope: The scope.
        name: Name of the tag in lower case.
    """

    def __init__(
        self,
        element: Element,
        scope: Scope,
        substitution: Substitution,
        notify: Notify,
        includes: tuple[str, ...],
    ) -> None:
        self.element = element
        self.scope = scope
        self.name = element.tag.lower()
        self._substitution = substitution
        self._notify = notify
        self._includes = includes

    def inside(self, element: Element, scope: Scope) -> Tag:
        """Return a tag inside this one."""
        return Tag(element, scope, self._substitution, self._notify, self._includes)

    @property
    def place(self) -> Place:
        """Where it stands."""
        element = self.element
        return Place(element.file, element.line, element.column, self._includes)

    def check(self) -> None:
        """Warn about attributes that it does not have."""
        known = TAGS[self.name].attributes
        for attribute in self.element.attributes:
            foreign = ":" in attribute and self.name == "launch"  # a schema for editors
            if attribute not in known and not foreign:
                self.warn(unknown_attribute(self.name, attribute), attribute)

    def wanted(self) -> bool:
        """Evaluate ``if`` and ``unless``.

        Raises:
            Fault: There are both, or one is no bool.
        """
        attributes = self.element.attributes
        if "if" not in attributes and "unless" not in attributes:
            return True
        wish, veto = self.get("if"), self.get("unless")
        if wish is not None and veto is not None:
            self.fail(f"<{self.name}> has both 'if' and 'unless'; keep one", "unless")
        if wish is not None:
            return self._condition(wish, "if")
        return not self._condition(veto or "", "unless")

    def _condition(self, text: str, attribute: str) -> bool:
        try:
            return boolean(text)
        except ValueError as error:
            self.fail(f"'{attribute}': {error}", attribute)

    def get(self, attribute: str) -> str | None:
        """Return an attribute with substitutions made; None where it is absent.

        Raises:
            Fault: A substitution fails.
        """
        text = self.element.attributes.get(attribute)
        if text is None or "$" not in text:
            return text
        try:
            resolved = self._substitution(text, self.scope)
        except TextFault as fault:
            raise Fault(self.element, fault.reason, attribute, fault.index) from fault
        if "$(" in resolved and "$(" in text:
            start = text.rfind("$(")
            if ")" not in text[start:]:
                self.warn("'$(' is never closed, so it stays as it is", attribute, start)
        return resolved

    def substitute(self, text: str) -> str:
        """Make the substitutions in a text that belongs to the tag.

        Raises:
            TextFault: One fails.
        """
        return self._substitution(text, self.scope)

    def require(self, attribute: str, *others: str) -> str:
        """Return an attribute that must be there, under this name or, failing that, another.

        Raises:
            Fault: It is absent, or a substitution fails.
        """
        texts = (self.get(name) for name in (attribute, *others))
        found = next((text for text in texts if text is not None), None)
        if found is None:
            known = TAGS[self.name].attributes
            strangers = [name for name in self.element.attributes if name not in known]
            hint = f", and '{strangers[0]}' is none of its attributes" if strangers else ""
            self.fail(f"<{self.name}> needs the attribute '{attribute}'{hint}")
        return found

    def alias(self, attribute: str, other: str) -> str | None:
        """Return an attribute, or what ROS 2 calls it where it is absent.

        Raises:
            Fault: A substitution fails.
        """
        if attribute not in self.element.attributes:
            return self.get(other)
        if other in self.element.attributes:
            self.warn(f"'{other}' is ignored beside '{attribute}'", other)
        return self.get(attribute)

    def flag(self, attribute: str) -> bool:
        """Return a bool attribute, False where it is absent.

        Raises:
            Fault: It is neither ``true`` nor ``false``.
        """
        text = self.get(attribute)
        if text is None:
            return False
        if text.lower() not in {"true", "false"}:
            self.fail(f"'{attribute}' is '{text}'; expected true or false", attribute)
        return text.lower() == "true"

    def number(self, attribute: str, default: float, least: float = -math.inf) -> float:
        """Return a finite number attribute.

        Raises:
            Fault: It is none, or below the least allowed.
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
        """Return a whole-number attribute; the default where it is absent or empty.

        Raises:
            Fault: It is none, or below the least allowed.
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
        """Return an attribute split as a shell does; empty where it is absent.

        Raises:
            Fault: Its quotes do not match.
        """
        return self.split(attribute, self.get(attribute) or "")

    def split(self, attribute: str, text: str) -> tuple[str, ...]:
        """Split the value of an attribute as a shell does.

        Raises:
            Fault: Its quotes do not match.
        """
        if not text:
            return ()
        import shlex

        try:
            return tuple(shlex.split(text))
        except ValueError as error:
            self.fail(f"'{attribute}' cannot be split: {str(error).lower()}: {text}", attribute)

    def again(self, attribute: str) -> str:
        """Return an attribute with substitutions made, then made again in what came of them.

        The second time no args and no anonymous names are known.

        Raises:
            Fault: A substitution fails.
        """
        text = self.get(attribute) or ""
        try:
            return self._substitution(text, Scope("/", "")) if "$(" in text else text
        except TextFault as fault:
            self.fail(f"in '{text}', which '{attribute}' came to: {fault.reason}", attribute)

    def remap(self, into: Scope) -> None:
        """Read ``<remap>`` into a scope.

        Raises:
            Fault: A name is missing or not legal.
        """
        self.check()
        old, new = self.require("from"), self.require("to")
        try:
            into.remap(old, new)
        except TextFault as fault:
            raise Fault(self.element, fault.reason) from fault
        except InvalidName as error:
            self.fail(str(error), "from" if error.name in {old, old.strip("/")} else "to")

    def env(self, into: Scope) -> None:
        """Read ``<env>`` or ROS 2's ``<set_env>`` into a scope.

        Raises:
            Fault: Name or value is missing.
        """
        self.check()
        name, value = self.require("name"), self.require("value")
        if not name:
            self.fail("'name' is empty; expected the name of a variable", "name")
        into.env.append((name, value))

    def fail(self, reason: str, attribute: str | None = None, index: int = 0) -> NoReturn:
        """Refuse the file.

        Raises:
            Fault: Always.
        """
        raise Fault(self.element, reason, attribute, index)

    def warn(self, text: str, attribute: str | None = None, index: int = 0) -> None:
        """Warn the user."""
        self._notify(self.element, text, attribute, index)
