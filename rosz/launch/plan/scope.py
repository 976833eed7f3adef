"""The nested scopes of a launch file, with roslaunch's rules of what a part sees of the others.

A scope begins with each file, group and node. It sees what was declared before it, and what is
declared in it stays in it, with two exceptions:

- ``~params`` of an included file reach the includer if there were some before (`Scope.private`).
- An include sees only the args passed to it; anonymous names start anew in it.
"""

from __future__ import annotations

from typing import Any

from rosz import names
from rosz.launch.plan.fault import TextFault

__all__ = ("Scope", "join", "make_global")


class Scope:
    """What is declared at one point of a launch file.

    Args:
        ns: Namespace, relative or global.
        file: The file, as it was given or included.

    Attributes:
        ns: Global namespace with a trailing slash.
        args: Values of args by name.
        declared: Names of the args declared, in order.
        anonymous: Names made by ``$(anon)``, by what was asked for.
        env: (name, value) in order.
        private: ``~params`` for nodes to come: (name, value, origin).
        waits: Conditions for nodes to come.
        remaps: (from, to) in order, those of outer scopes first; no name twice.
        included: The file was included by another.
        incoming: Args for an include while its tag is read, else None.
        lenient: Args may be set twice, which ``pass_all_args`` allows.
    """

    def __init__(self, ns: str, file: str) -> None:
        self.ns = make_global(ns)
        self.file = file
        self.args: dict[str, str] = {}
        self.declared: list[str] = []
        self.anonymous: dict[str, str] = {}
        self.env: list[tuple[str, str]] = []
        self.private: list[tuple[str, Any, Any]] = []
        self.waits: tuple[Any, ...] = ()
        self.included = False
        self.incoming: dict[str, str] | None = None
        self.lenient = False
        self.remaps: list[tuple[str, str]] = []

    def child(self, ns: str | None = None) -> Scope:
        """Return a scope inside this one.

        Args:
            ns: Its namespace, None for that of this scope.

        Raises:
            TextFault: The namespace is private.
        """
        scope = Scope(join(self.ns, ns) if ns else self.ns, self.file)
        scope.args = dict(self.args)
        scope.declared = list(self.declared)
        scope.anonymous = dict(self.anonymous)
        scope.env = list(self.env)
        # the list itself, unless it is empty: roslaunch's nodes see such params from included files
        scope.private = self.private or []
        scope.waits = self.waits
        scope.included = self.included
        scope.remaps = list(self.remaps)
        return scope

    def include(self, ns: str | None) -> Scope:
        """Return the scope of a file included here, ready to take its args."""
        scope = self.child(ns)
        scope.declared = []
        scope.incoming = {}
        return scope

    def enter(self) -> list[str]:
        """Swap the args taken for an include in, and return the names passed.

        Raises:
            TextFault: An arg was given no value.
        """
        incoming = self.incoming or {}
        for name in self.declared:
            if name not in incoming:
                raise TextFault(f"<arg name='{name}'> of an include needs a value")
        self.args = incoming
        self.incoming = None
        self.included = True
        self.declared = []
        self.anonymous = {}
        return list(incoming)

    def declare(self, name: str, value: str | None, default: str | None) -> None:
        """Declare an arg; a value fixes it, a default gives way to what was passed.

        Raises:
            TextFault: It is declared already, or a value was passed for a fixed one.
        """
        if name not in self.declared:
            self.declared.append(name)
        elif not self.lenient:
            raise TextFault(f"arg '{name}' is declared twice in this scope")
        args = self.args if self.incoming is None else self.incoming
        if value is not None:
            if name in args and not self.lenient:
                raise TextFault(
                    f"arg '{name}' has a fixed value, and '{args[name]}' was passed for it"
                )
            args[name] = value
        elif default is not None:
            args.setdefault(name, default)

    def remap(self, old: str, new: str) -> None:
        """Add a remapping; it replaces an earlier one of the same name.

        Raises:
            TextFault: A side is empty.
            InvalidName: A side is not a legal name.
        """
        pair = names.canonical(old), names.canonical(new)
        if not all(pair):
            raise TextFault("a remap needs two names, and one is empty")
        for name in pair:
            names.check(name)
        self.remaps = [known for known in self.remaps if known[0] != pair[0]]
        self.remaps.append(pair)

    def add_private(self, name: str, value: Any, origin: Any) -> None:
        """Add a ``~param``; it replaces an earlier one of the same name."""
        for known in [entry for entry in self.private if entry[0] == name]:
            self.private.remove(known)
        self.private.append((name, value, origin))


def make_global(ns: str) -> str:
    """Return a namespace with a slash at both ends.

    Raises:
        TextFault: It is private.
    """
    if ns.startswith("~"):
        raise TextFault(f"namespace '{ns}' is private; only names of a node can be")
    ns = ns if ns.startswith("/") else f"/{ns}"
    return ns if ns.endswith("/") else f"{ns}/"


def join(ns: str, name: str) -> str:
    """Put a name into a namespace as roslaunch does: plain text, no slash dropped."""
    if not ns or name.startswith(("/", "~")):
        return name
    if ns == "~":
        return f"~{name}"
    return ns + name if ns.endswith("/") else f"{ns}/{name}"
