"""roslib.gentools: the types that a definition needs, its md5 and its full text.

What the functions take and return is the dict that `get_dependencies` makes, as in ROS 1.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

from rosz.ros1.genmsg import HEADER, SEP, package_resource_name
from rosz.ros1.importer import type_store
from rosz.ros1.roslib import msgs, srvs
from rosz.ros1.roslib.msg_types import base_msg_type, is_builtin
from rosz.ros1.rospkg import RosPack, get_package_name
from rosz.typestore import shipped_types

__all__ = (
    "compute_full_text",
    "compute_md5",
    "compute_md5_text",
    "compute_md5_v1",
    "compute_md5_v2",
    "get_dependencies",
    "get_file_dependencies",
)

_HEADER_TYPE = f"std_msgs{SEP}{HEADER}"
_RULE = "=" * 80

Dependencies = dict[str, Any]
"""Keys ``deps``, ``uniquedeps``, ``spec``, ``package`` and, with the paths of files, ``files``."""


def get_file_dependencies(
    f: str,
    stdout: Any = None,  # noqa: ARG001  # ROS 1's, as the next one
    stderr: Any = None,  # noqa: ARG001
    rospack: RosPack | None = None,
) -> Dependencies:
    """Return the types that the definition in a file needs; see `get_dependencies`.

    Raises:
        MsgSpecException: The definition is invalid, or a type is not known.
        ValueError: It is neither a .msg nor a .srv file, or lies in no package.
    """
    package = get_package_name(f)
    if package is None:
        raise ValueError(f"[{f}] does not lie in a package")
    if f.endswith(msgs.EXT):
        return get_dependencies(msgs.load_from_file(f)[1], package, rospack=rospack)
    if f.endswith(srvs.EXT):
        return get_dependencies(srvs.load_from_file(f)[1], package, rospack=rospack)
    raise ValueError(f"[{f}] does not appear to be a message or service")


def get_dependencies(  # ROS 1's
    spec: srvs.Spec,
    package: str,
    compute_files: bool = True,
    stdout: Any = None,  # noqa: ARG001  # as the next two
    stderr: Any = None,  # noqa: ARG001
    rospack: RosPack | None = None,  # noqa: ARG001
) -> Dependencies:
    """Return the types that a message or service needs.

    Args:
        spec: The message or service.
        package: Its package.
        compute_files: Whether to add the paths of their definitions.
        stdout: Ignored.
        stderr: Ignored.
        rospack: Ignored; all types that can be imported are found.

    Raises:
        MsgSpecException: A type is not known.
    """
    msgs._init()  # noqa: SLF001  # of the same module in ROS 1
    needed: list[str] = []
    for part in srvs.parts_of(spec):
        _add_needed(part, package, needed)
    found: Dependencies = {
        "deps": needed,
        "spec": spec,
        "package": package,
        "uniquedeps": list(dict.fromkeys(needed)),
    }
    if compute_files:
        names = {one: package_resource_name(one) for one in found["uniquedeps"]}
        found["files"] = {one: msgs.msg_file(pkg or package, t) for one, (pkg, t) in names.items()}
    return found


def _add_needed(spec: msgs.MsgSpec, package: str, needed: list[str]) -> None:
    for type_ in spec.types:
        base = base_msg_type(type_) or ""
        if is_builtin(base):
            continue
        name = _full_name(base, package)
        needed.append(name)
        _add_needed(_registered(name), package_resource_name(name)[0], needed)


def _full_name(base: str, package: str) -> str:
    if base == HEADER:
        return _HEADER_TYPE
    return base if SEP in base else f"{package}{SEP}{base}"


def _registered(name: str) -> msgs.MsgSpec:
    """Return a message, and register it.

    Raises:
        MsgSpecException: It is not known.
    """
    if not msgs.is_registered(name):
        msgs.register(*msgs.load_by_type(name))
    return msgs.get_registered(name)


def compute_md5_text(
    get_deps_dict: Dependencies,
    spec: msgs.MsgSpec,
    rospack: RosPack | None = None,  # noqa: ARG001  # ROS 1's
) -> str:
    """Return the text of a message that is hashed.

    Args:
        get_deps_dict: What `get_dependencies` returned.
        spec: The message, or a message of the service.
        rospack: Ignored.
    """
    return _md5_text(spec, get_deps_dict["package"])


def _md5_text(spec: msgs.MsgSpec, package: str) -> str:
    lines = [f"{one.type} {one.name}={one.val_text}" for one in spec.constants]
    for type_, name in spec.fields():
        base = base_msg_type(type_) or ""
        lines.append(f"{type_ if is_builtin(base) else _nested_md5(base, package)} {name}")
    return "\n".join(lines)


def _nested_md5(base: str, package: str) -> str:
    name = _full_name(base, package)
    return _md5([_registered(name)], name)


def _md5(parts: Sequence[msgs.MsgSpec], name: str) -> str:
    """Return the md5 of a type, given its messages.

    Those of types that rosz ships are known: some have other fields than in ROS 1.
    """
    package, base = package_resource_name(name)
    known = shipped_types(package, "msg") if len(parts) == 1 else ()
    if base in known and parts[0] == _registered(name):
        md5: str = type_store().message(name)._md5sum
        return md5
    text = "".join(_md5_text(part, package) for part in parts)
    return hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()


def compute_md5(get_deps_dict: Dependencies, rospack: RosPack | None = None) -> str:  # noqa: ARG001
    """Return the md5 of a message or service.

    Args:
        get_deps_dict: What `get_dependencies` returned.
        rospack: Ignored.
    """
    spec = get_deps_dict["spec"]
    base = package_resource_name(spec.full_name)[1]
    return _md5(srvs.parts_of(spec), f"{get_deps_dict['package']}{SEP}{base}")


compute_md5_v2 = compute_md5


def compute_md5_v1(get_deps_dict: Dependencies) -> str:
    """Return the md5 that versions of ROS before 0.6 used, over the texts as they are."""
    texts = [one.text for one in _with_needed(get_deps_dict)]
    return hashlib.md5("".join(texts).encode(), usedforsecurity=False).hexdigest()


def _with_needed(get_deps_dict: Dependencies) -> list[Any]:
    return [get_deps_dict["spec"], *map(_registered, get_deps_dict["uniquedeps"])]


def compute_full_text(get_deps_dict: Dependencies) -> str:
    """Return a definition, followed by those of the types that it needs."""
    own, *nested = (one.text for one in _with_needed(get_deps_dict))
    names = get_deps_dict["uniquedeps"]
    below = [f"{_RULE}\nMSG: {name}\n{text}" for name, text in zip(names, nested, strict=True)]
    return "\n".join([own, *below])
