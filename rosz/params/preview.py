"""What a batch would do to a tree, before it is done."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from rosz.params.merge import Change
from rosz.params.paths import joined
from rosz.params.tree import Draft, Tree, leaves
from rosz.params.values import Value
from rosz.params.writes import DELETED, check_write

__all__ = ("Difference", "preview")


class Difference(msgspec.Struct, frozen=True):
    """One parameter that would change.

    Attributes:
        name: Its global name.
        old: Its value now; ``None`` where it is not set.
        new: Its value afterwards; ``None`` where it would be gone.
    """

    name: str
    old: Value | None
    new: Value | None


def preview(root: Tree, changes: Iterable[Change]) -> list[Difference]:
    """Return what a batch would change, by name.

    Args:
        root: The tree as it is; it stays so.
        changes: The batch, as `rosz.params.condense` returns it.

    Raises:
        ParamError: A change has no meaning in the tree.
    """
    draft = Draft(root)
    for path, value in changes:
        check_write(path, value)
        if value is DELETED:
            draft.delete(path)
        else:
            draft.put(path, value)
    old = {joined(path): value for path, value in leaves(root) if path}
    new = {joined(path): value for path, value in leaves(draft.root) if path}
    return [
        Difference(name, old.get(name), new.get(name))
        for name in sorted(old.keys() | new.keys())
        if repr(old.get(name)) != repr(new.get(name))
    ]
