"""Parameters as pages show and change them, with the changes since a page looked."""

from __future__ import annotations

import threading
from collections import deque

from rosz.access import PagePolicy
from rosz.errors import ParamError, UsageError
from rosz.node import Node
from rosz.params import Value, condense, joined, spread, type_name
from rosz.params.replica import Changed
from rosz.params.yaml import dump, inline, load, load_documents

_MOST_CHANGES = 200


class ParameterModel:
    """The parameters of all nodes, and their newest changes, until it is closed.

    Args:
        node: The node that reads and writes them.
        permission: The changes that the page may make.

    Attributes:
        version: Number that grows with each change.
    """

    def __init__(self, node: Node, permission: PagePolicy) -> None:
        self.version: int = 0
        self._params = node.params
        self._permission = permission
        self._lock = threading.Lock()
        self._changes: deque[Changed] = deque(maxlen=_MOST_CHANGES)
        self._watch = self._params.watch("/", self._changed)

    def _changed(self, change: Changed) -> None:
        with self._lock:
            self.version += 1
            self._changes.append(change)

    def changes(self) -> list[Changed]:
        """Return the newest changes, the newest first."""
        with self._lock:
            return list(reversed(self._changes))

    def values(self) -> dict[str, Value]:
        """Return the value of each parameter that is not a namespace, by full name."""
        tree: dict[str, Value] = {}
        for name in self._params.names():
            if self._permission.objection("get", name):
                continue
            value = self._params.get(name, None)
            if value is not None:
                tree[name] = value
        return tree

    def set_text(self, name: str, text: str, *, other_type: bool = False) -> None:
        """Set a parameter to a value in YAML.

        Args:
            name: Full name.
            text: The value.
            other_type: Whether it may get another type than it has.

        Raises:
            UsageError: The type is another one, or the page may not set it.
            YamlError: The text is not YAML.
            ParamError: A parameter cannot hold the value.
        """
        value = load(text, name)
        old = self._params.get(name, None)
        if isinstance(old, float) and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if isinstance(old, str) and not isinstance(value, str) and not other_type:
            value = text
        if old is not None and not other_type and type(old) is not type(value):
            raise UsageError(
                f"'{name}' is of type {type_name(old)}, and {inline(value)} of type"
                f" {type_name(value)}; allow another type to set it all the same"
            )
        self.set(name, value)

    def set(self, name: str, value: Value) -> None:
        """Set a parameter.

        Raises:
            UsageError: The page may not set it.
            ParamError: A parameter cannot hold the value.
        """
        self._permission.check("set", name)
        self._params.set(name, value)

    def delete(self, name: str) -> None:
        """Delete a parameter.

        Raises:
            UsageError: The page may not.
            ParamNotFound: It is not set any more.
        """
        self._permission.check("set", name)
        self._params.delete(name)

    def save(self, namespace: str) -> str:
        """Return all parameters of a namespace as YAML.

        Raises:
            ParamError: There is none.
        """
        value = self._params.get(namespace, None)
        if value is None:
            raise ParamError(f"no parameter is set in '{namespace}'")
        return dump(value)

    def load(self, namespace: str, text: str, file: str) -> int:
        """Set the parameters of a YAML file as one change, and return how many.

        Args:
            namespace: Namespace that they are loaded into.
            text: Text of the file.
            file: Its name, for errors.

        Raises:
            YamlError: The file is not YAML.
            ParamError: It does not consist of parameters.
            UsageError: The page may not set them.
        """
        documents = load_documents(text, namespace, file)
        changes = condense(change for space, value in documents for change in spread(space, value))
        values = {joined(path): value for path, value in changes}
        for name in values:
            self._permission.check("set", name)
        self._params.update(values)
        return len(values)

    def close(self) -> None:
        """Follow the parameters no longer."""
        self._watch.close()
