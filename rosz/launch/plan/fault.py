"""Why a launch file is refused, on its way to the place where file and includes are known.

The parts below the loader know the tag and the attribute at most, so they raise a `Fault`; the
loader, which knows the chain of includes, turns it into a `LaunchFileError`.
"""

from __future__ import annotations

from rosz.launch.plan.document import Element

__all__ = ("Fault", "TextFault")


class TextFault(Exception):
    """Something wrong in a text.

    Attributes:
        reason: What is wrong, what was expected, what to do.
        index: 0-based index of the character where it stands.
    """

    def __init__(self, reason: str, index: int = 0) -> None:
        self.reason = reason
        self.index = index
        super().__init__(reason)


class Fault(Exception):
    """Something wrong with a tag.

    Attributes:
        element: The tag.
        reason: What is wrong, what was expected, what to do.
        attribute: The attribute that is wrong, or None for the tag itself.
        index: 0-based index in the attribute's value.
        place: Path, line and column where it is wrong, if that is not in the tag.
    """

    def __init__(
        self,
        element: Element,
        reason: str,
        attribute: str | None = None,
        index: int = 0,
        *,
        place: tuple[str, int, int] | None = None,
    ) -> None:
        self.element = element
        self.reason = reason
        self.attribute = attribute
        self.index = index
        self.place = place
        super().__init__(reason)
