"""The nested scopes of a launch file, by roslaunch's rules.

Each file, group and node has its own scope. A scope sees the declarations before it, and its own
stay in it, with two exceptions:

- ``~params`` of an included file reach the includer if it already had some (`Scope.private`).
- An included file sees only the args passed to it, and has its own anonymous names.
"""

from __future__ import annotations

from typing import Any

from rosz import names
from rosz.launch.plan.document import TextError


class Scope:
    """The declarations visible at one point of a launch file.

    Attributes:
        ns: Global namespace with a trailing slash.
        anonymous: Names made by ``$(anon)``, by base name.
        env: (name, value) of environment variables, in order.
        environ: Those of ``<set_env>``, which ``$(env)`` and ``$(optenv)`` see as well.
        private: ``~params`` for the following nodes: (value, origin) by name, in order.
        waits: Conditions that the following nodes wait for.
        remaps: (from, to) in order, those of outer scopes first; no name twice.
        incoming: Args passed to an include while its tag is read, otherwise None.
        lenient: Whether args may be set twice, as ``pass_all_args`` allows.
    """

    def __init__(self, ns: str, file: str) -> None:
        self.ns: str = make_global(ns)
        self.file = file
        self.args: dict[str, str] = {}
        self.declared: list[str] = []
        self.anonymous: dict[str, str] = {}
        self.env: list[tuple[str, str]] = []
        self.environ: dict[str, str] = {}
        self.private: dict[str, tuple[Any, Any]] = {}
        self.waits: tuple[Any, ...] = ()
        self.included: bool = False
        self.incoming: dict[str, str] | None = None
        self.lenient = False
        self.container = ""
        self.by_reference = False
        self.remaps: list[tuple[str, str]] = []

    def child(self, ns: str | None = None) -> Scope:
        """Return a scope inside this one, by default in the same namespace.

        Raises:
            TextError: If the namespace is private.
        """
        scope = Scope(join(self.ns, ns) if ns else self.ns, self.file)
        scope.args = dict(self.args)
        scope.declared = list(self.declared)
        scope.anonymous = dict(self.anonymous)
        scope.env = list(self.env)
        scope.environ = dict(self.environ)
        # Not a copy unless empty: in roslaunch, nodes see such params from included files.
        scope.private = self.private or {}
        scope.waits = self.waits
        scope.container = self.container
        scope.by_reference = self.by_reference
        scope.included = self.included
        scope.remaps = list(self.remaps)
        return scope

    def include(self, ns: str | None) -> Scope:
        """Return the scope of a file included here, before its args are passed."""
        scope = self.child(ns)
        scope.declared = []
        scope.incoming = {}
        return scope

    def enter(self) -> list[str]:
        """Make the args passed to an include its args, and return their names.

        Raises:
            TextError: If an arg was passed without a value.
        """
        incoming = self.incoming or {}
        for name in self.declared:
            if name not in incoming:
                raise TextError(f"<arg name='{name}'> of an include needs a value")
        self.args = incoming
        self.incoming = None
        self.included = True
        self.declared = []
        self.anonymous = {}
        return list(incoming)

    def declare(self, name: str, value: str | None, default: str | None) -> None:
        """Declare an arg.

        Args:
            name: Name of the arg.
            value: Fixed value, or None.
            default: Value if none was passed, or None.

        Raises:
            TextError: If the arg is already declared, or a value was passed for a fixed arg.
        """
        if name not in self.declared:
            self.declared.append(name)
        elif not self.lenient:
            raise TextError(f"arg '{name}' is declared twice in this scope")
        args = self.args if self.incoming is None else self.incoming
        if value is not None:
            if name in args and not self.lenient:
                raise TextError(
                    f"arg '{name}' has a fixed value, and '{args[name]}' was passed for it"
                )
            args[name] = value
        elif default is not None:
            args.setdefault(name, default)

    def remap(self, old: str, new: str) -> None:
        """Add a remapping; it replaces an earlier one of the same name.

        Raises:
            TextError: If a name is empty.
            InvalidName: If a name is invalid.
        """
        pair = names.canonical(old), names.canonical(new)
        if not all(pair):
            raise TextError("a remap needs two names, and one is empty")
        for name in pair:
            names.check(name)
        self.remaps = [earlier for earlier in self.remaps if earlier[0] != pair[0]]
        self.remaps.append(pair)

    def add_private(self, name: str, value: Any, origin: Any) -> None:
        """Add a ``~param`` at the end; it replaces an earlier one of the same name."""
        self.private.pop(name, None)
        self.private[name] = value, origin


def make_global(ns: str) -> str:
    """Return a namespace with a slash at both ends.

    Raises:
        TextError: If the namespace is private.
    """
    if ns.startswith("~"):
        raise TextError(f"namespace '{ns}' is private; only names of a node can be")
    ns = ns if ns.startswith("/") else f"/{ns}"
    return ns if ns.endswith("/") else f"{ns}/"


def join(ns: str, name: str) -> str:
    """Join a namespace and a name as text, keeping every slash, as roslaunch does."""
    if not ns or name.startswith(("/", "~")):
        return name
    if ns == "~":
        return f"~{name}"
    return ns + name if ns.endswith("/") else f"{ns}/{name}"
