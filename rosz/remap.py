"""The command-line arguments of a node (ROS wiki, Remapping Arguments).

``from:=to`` remaps a name, ``_param:=value`` sets a private parameter, ``__key:=value`` is for
rosz itself; everything else belongs to the program.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec

from rosz import names

_ROS2_WORDS = frozenset({"--ros-args", "-r", "--remap", "-p", "--param", "--"})
_ROS2_OPTIONS = frozenset({"--params-file", "--log-level"})


class Arguments(msgspec.Struct, frozen=True):
    """The command line of a node, sorted by kind; texts are as written.

    Attributes:
        remaps: Remappings from name to name, unresolved.
        params: YAML texts by private parameter, without the leading underscore.
        special: Values by ``__name``, ``__ns``, ``__log`` and the like.
        rest: Other arguments, in order.
    """

    remaps: dict[str, str] = {}
    params: dict[str, str] = {}
    special: dict[str, str] = {}
    rest: tuple[str, ...] = ()

    def node_name(self, name: str, environment_namespace: str = "") -> str:
        """Return the full name of a node.

        Args:
            name: Base name that the program chose.
            environment_namespace: Value of ``ROS_NAMESPACE``, which ``__ns`` overrides.

        Raises:
            InvalidName: A name or namespace is not legal.
        """
        base = names.check_base(self.special.get("__name", name))
        ns = names.check(self.special.get("__ns", environment_namespace))
        return names.check_length(names.canonical(f"/{ns}/{base}"))

    def resolved_remaps(self, node: str) -> Mapping[str, str]:
        """Return the remappings with both sides resolved for the node of a full name.

        Raises:
            InvalidName: A side of a remapping is not legal.
        """
        return {
            names.resolve(old, node): names.resolve(new, node) for old, new in self.remaps.items()
        }


def parse(argv: Sequence[str]) -> Arguments:
    """Parse a command line without its program name.

    Arguments with an empty right side (``a:=``, ``__name:=``) are ignored, as in rospy.
    """
    remaps: dict[str, str] = {}
    params: dict[str, str] = {}
    special: dict[str, str] = {}
    rest: list[str] = []
    ros2 = "--ros-args" in argv
    for before, argument in zip(("", *argv), argv, strict=False):
        if ros2 and (argument in _ROS2_WORDS or {before, argument} & _ROS2_OPTIONS):
            continue  # files of parameters are not read here
        left, separator, right = argument.partition(":=")
        left, right = left.strip(), right.strip()
        if not separator or not left:
            rest.append(argument)
        elif not right:
            continue
        elif left.startswith("__"):
            special["__name" if left == "__node" else left] = right
        elif ros2 and before in {"-p", "--param"}:
            params[left.replace(".", "/")] = right
        elif left.startswith("_"):
            params[left[1:]] = right
        else:
            remaps[left] = right
    return Arguments(remaps, params, special, tuple(rest))
