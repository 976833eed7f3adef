"""The store's meaning in the plainest words: replay of everything, nothing ever dropped."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from typing import Any, cast

from rosz.params.writes import DELETED, Write


def replay(writes: Iterable[Write]) -> dict[str, Any]:
    """Return the tree that writes give, oldest first."""
    root: dict[str, Any] = {}
    for write in sorted(set_of(writes), key=lambda write: (write.time, write.clock, write.path)):
        if not write.path:
            root = copy.deepcopy(cast("dict[str, Any]", write.value))
            continue
        node = root
        for part in write.path[:-1]:
            if not isinstance(node.get(part), dict):
                node[part] = {}
            node = node[part]
        if write.value is DELETED:
            node.pop(write.path[-1], None)
        else:
            node[write.path[-1]] = copy.deepcopy(write.value)
    return root


def set_of(writes: Iterable[Write]) -> list[Write]:
    """Return writes without repetitions."""
    return list({(write.path, write.time, write.clock): write for write in writes}.values())
