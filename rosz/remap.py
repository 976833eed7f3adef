"""The command-line arguments of a node (ROS wiki, Remapping Arguments).

``from:=to`` remaps a name, ``_param:=value`` sets a private parameter, ``__key:=value`` is for rosz
itself; everything else belongs to the program.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec

from rosz import names

__all__ = ("Arguments", "parse")


class Arguments(msgspec.Struct, frozen=True):
    """A node's command line, sorted by meaning; texts are as they were written.

    Attributes:
        remaps: Name to name, unresolved.
        params: Private parameter, without its leading underscore, to YAML text.
        special: ``__name``, ``__ns``, ``__log`` … to value.
        rest: The arguments that are none of these, in order.
    """

    remaps: dict[str, str] = {}
    params: dict[str, str] = {}
    special: dict[str, str] = {}
    rest: tuple[str, ...] = ()

    def node_name(self, name: str, environment_namespace: str = "") -> str:
        """Return the full name of a node called ``name`` in its program.

        Args:
            name: The base name that the program chose.
            environment_namespace: ``ROS_NAMESPACE``, which ``__ns`` overrides.

        Raises:
            InvalidName: A name or namespace is not legal.
        """
        base = names.check_base(self.special.get("__name", name))
        ns = names.check(self.special.get("__ns", environment_namespace))
        return names.canonical(f"/{ns}/{base}")

    def resolved_remaps(self, node: str) -> Mapping[str, str]:
        """Resolve both sides of every remapping as the node of that full name sees them.

        Raises:
            InvalidName: A side is not a legal name.
        """
        return {
            names.resolve(old, node): names.resolve(new, node) for old, new in self.remaps.items()
        }


def parse(argv: Sequence[str]) -> Arguments:
    """Sort a command line without its program name.

    One of ours that leads to nothing (``a:=``, ``__name:=``) counts for nothing, as in rospy.
    """
    remaps: dict[str, str] = {}
    params: dict[str, str] = {}
    special: dict[str, str] = {}
    rest: list[str] = []
    for argument in argv:
        left, separator, right = argument.partition(":=")
        left, right = left.strip(), right.strip()
        if not separator or not left:
            rest.append(argument)
        elif not right:
            continue
        elif left.startswith("__"):
            special[left] = right
        elif left.startswith("_"):
            params[left[1:]] = right
        else:
            remaps[left] = right
    return Arguments(remaps, params, special, tuple(rest))
