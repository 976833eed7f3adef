"""roslib.msgs: specs of messages, and a table of those that a program has registered.

``rosz.idl`` reads the texts; a spec here spells types as ROS 1 does.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rosz.bags.ros1_form import ros1_definition
from rosz.errors import DefinitionError, PackageError, TypeNotFound
from rosz.idl import FieldType, parse_message
from rosz.ros1.genmsg import HEADER, SEP, is_legal_resource_name, package_resource_name
from rosz.ros1.importer import type_store
from rosz.ros1.roslib.msg_types import (
    BUILTIN_TYPES,
    COMMENTCHAR,
    CONSTCHAR,
    DURATION,
    EXT,
    PRIMITIVE_TYPES,
    RESERVED_TYPES,
    TIME,
    MsgSpecException,
    base_msg_type,
    is_builtin,
    is_header_type,
    is_valid_constant_type,
    is_valid_msg_field_name,
    is_valid_msg_type,
    parse_type,
    resolve_type,
)
from rosz.ros1.roslib.packages import (
    list_package_resources,
    resource_file,
)
from rosz.ros1.rospkg import RosPack
from rosz.typestore import shipped_packages

__all__ = (
    "BUILTIN_TYPES",
    "COMMENTCHAR",
    "CONSTCHAR",
    "DURATION",
    "DURATION_MSG",
    "EXT",
    "EXTENDED_BUILTINS",
    "HEADER",
    "PRIMITIVE_TYPES",
    "REGISTERED_TYPES",
    "RESERVED_TYPES",
    "SEP",
    "TIME",
    "TIME_MSG",
    "Constant",
    "Field",
    "MsgSpec",
    "MsgSpecException",
    "base_msg_type",
    "get_pkg_msg_specs",
    "get_registered",
    "is_builtin",
    "is_header_type",
    "is_registered",
    "is_valid_constant_type",
    "is_valid_msg_field_name",
    "is_valid_msg_type",
    "is_verbose",
    "list_msg_types",
    "load_by_type",
    "load_from_file",
    "load_from_string",
    "load_package",
    "load_package_dependencies",
    "msg_file",
    "parse_type",
    "register",
    "reinit",
    "resolve_type",
    "set_verbose",
)

TIME_MSG = "uint32 secs\nuint32 nsecs"
DURATION_MSG = "int32 secs\nint32 nsecs"
_HEADER_NAMES = (HEADER, f"std_msgs/{HEADER}", f"roslib/{HEADER}")
_HEADER_MSG = "uint32 seq\ntime stamp\nstring frame_id\n"
_TIMES = {"builtin_interfaces/msg/Time": TIME, "builtin_interfaces/msg/Duration": DURATION}
_NO_PACKAGE = "local"
_SIGNED_BITS = {"int8": 8, "byte": 8, "int16": 16, "int32": 32, "int64": 64}
_UNSIGNED_BITS = {"uint8": 8, "char": 8, "uint16": 16, "uint32": 32, "uint64": 64}

VERBOSE = False


def is_verbose() -> bool:
    """Return whether files are named on stdout when they are read."""
    return VERBOSE


def set_verbose(v: bool) -> None:
    """Set whether files are named on stdout when they are read."""
    global VERBOSE  # noqa: PLW0603  # ROS 1's
    VERBOSE = v


def _report(text: str) -> None:
    if VERBOSE:
        sys.stdout.write(f"{text}\n")


class Constant:
    """A constant of a message.

    Attributes:
        type: Type.
        name: Name.
        val: Value.
        val_text: Value as the text spells it.
    """

    __slots__ = ("name", "type", "val", "val_text")

    def __init__(self, type_: str, name: str, val: Any, val_text: str) -> None:
        if None in {type_, name, val_text} or val is None:
            raise ValueError("Constant must have non-None parameters")
        self.type = type_
        self.name = name.strip()
        self.val = val
        self.val_text = val_text

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Constant) and (self.type, self.name, self.val) == (
            other.type,
            other.name,
            other.val,
        )

    def __hash__(self) -> int:
        return hash((self.type, self.name))

    def __repr__(self) -> str:
        return f"{self.type} {self.name}={self.val}"


class Field:
    """A field of a message.

    Attributes:
        name: Name.
        type: Type.
        base_type: Type without the array part.
        is_array: Whether it is an array.
        array_len: Length of an array, if that is fixed.
        is_header: Whether it is a header.
        is_builtin: Whether the base type is one of the language.
    """

    def __init__(self, name: str, type: str) -> None:  # noqa: A002  # ROS 1's
        self.name = name
        self.type = type
        self.base_type, self.is_array, self.array_len = parse_type(type)
        self.is_header = is_header_type(self.base_type)
        self.is_builtin = is_builtin(self.base_type)

    def __repr__(self) -> str:
        values = self.name, self.type, self.base_type, self.is_array, self.array_len
        return f"[{', '.join(map(str, values))}]"


class MsgSpec:
    """A message.

    Args:
        types: Types of the fields.
        names: Names of the fields.
        constants: The constants.
        text: Text of the definition.
        full_name: Name with the package.
        short_name: Name without the package.
        package: Package.

    Raises:
        MsgSpecException: Two fields have one name.
        ValueError: There are more types than names, or fewer.
    """

    def __init__(  # noqa: PLR0917  # ROS 1's
        self,
        types: Sequence[str],
        names: Sequence[str],
        constants: Sequence[Constant],
        text: str,
        full_name: str = "",
        short_name: str = "",
        package: str = "",
    ) -> None:
        if len(set(names)) != len(names):
            raise MsgSpecException(f"Duplicate field names in message: {list(names)}")
        self._fields = [Field(name, type_) for name, type_ in zip(names, types, strict=True)]
        self.types = list(types)
        self.names = list(names)
        self.constants = list(constants)
        self.text = text
        self.full_name = full_name
        self.short_name = short_name
        self.package = package
        first = self._fields[:1]
        self.header_present = bool(first) and first[0].name == "header" and first[0].is_header

    def fields(self) -> list[tuple[str, str]]:
        """Return types and names of the fields."""
        return list(zip(self.types, self.names, strict=True))

    def parsed_fields(self) -> list[Field]:
        """Return the fields."""
        return self._fields

    def has_header(self) -> bool:
        """Return whether the first field is a header."""
        return self.header_present

    def _values(self) -> tuple[Any, ...]:
        return self.types, self.names, self.constants, self.text

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MsgSpec) and self._values() == other._values()

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        parts = ([self.constants] if self.constants else []) + [self.types, self.names]
        return f"MsgSpec[{', '.join(map(repr, parts))}]"

    def __str__(self) -> str:
        return "".join(f"{line}\n" for line in _lines(self, ""))


def _lines(spec: MsgSpec, indent: str) -> Iterable[str]:
    """Yield the lines of a definition with the fields of the types in it."""
    for constant in spec.constants:
        yield f"{indent}{constant.type} {constant.name}={constant.val_text}"
    for field in spec.parsed_fields():
        yield f"{indent}{field.type} {field.name}"
        if not field.is_builtin:
            yield from _lines(get_registered(field.base_type), f"{indent}  ")


def _convert_val(type_: str, val: str) -> Any:
    """Return the value of a constant.

    Raises:
        MsgSpecException: The type has no constants, or the value is out of its range.
        ValueError: The text is not a value of the type.
    """
    if type_ in {"float32", "float64"}:
        return float(val)
    if type_ == "string":
        return val.strip()
    if type_ == "bool":
        return val.strip() not in {"0", "False"}
    signed, unsigned = _SIGNED_BITS.get(type_), _UNSIGNED_BITS.get(type_)
    if signed is not None:
        low, high = -(2 ** (signed - 1)), 2 ** (signed - 1) - 1
    elif unsigned is not None:
        low, high = 0, 2**unsigned - 1
    else:
        raise MsgSpecException(f"invalid constant type: [{type_}]")
    number = int(val)
    if not low <= number <= high:
        raise MsgSpecException(f"cannot coerce [{number}] to {type_} (out of bounds)")
    return number


# Reading definitions.


def load_from_string(
    text: str, package_context: str = "", full_name: str = "", short_name: str = ""
) -> MsgSpec:
    """Return the spec of a definition.

    Args:
        text: The definition.
        package_context: Package of types that have none; when empty they stay without.
        full_name: Name with the package.
        short_name: Name without the package.

    Raises:
        MsgSpecException: The text is not a definition.
    """
    try:
        spec = parse_message(f"{package_context or _NO_PACKAGE}/msg/{short_name or 'X'}", text)
    except DefinitionError as error:
        raise MsgSpecException(f"Invalid declaration: {error}") from error
    types = [_written(field.type, package_context) for field in spec.fields]
    names = [field.name for field in spec.fields]
    constants = [Constant(one.type, one.name, one.value, one.text) for one in spec.constants]
    return MsgSpec(types, names, constants, text, full_name, short_name, package_context)


def _written(kind: FieldType, package: str) -> str:
    """Return a type as ROS 1 spells it."""
    base = _TIMES.get(kind.base, kind.written)
    local = package and SEP not in base and base not in RESERVED_TYPES
    return (f"{package}{SEP}{base}" if local else base) + kind.suffix


def load_from_file(file_path: str, package_context: str = "") -> tuple[str, MsgSpec]:
    """Return the name and the spec of the message in a file.

    Args:
        file_path: Path of the file.
        package_context: Package of the message; the name has none when empty.

    Raises:
        MsgSpecException: The file does not hold a definition, or its name is not that of a type.
        OSError: The file cannot be read.
    """
    path = Path(file_path)
    package = package_context.rstrip(SEP)
    base = path.name.removesuffix(EXT)
    name = f"{package}{SEP}{base}" if package else base
    where = f" into package [{package}]" if package else ""
    _report(f"Load spec from {file_path}{where}")
    if not is_legal_resource_name(name):
        raise MsgSpecException(f"{file_path}: [{name}] is not a legal type name")
    try:
        return name, load_from_string(path.read_text("utf-8"), package, name, base)
    except MsgSpecException as error:
        raise MsgSpecException(f"{path.name}: {error}") from error


def load_by_type(msgtype: str, package_context: str = "") -> tuple[str, MsgSpec]:
    """Return the name and the spec of a message.

    Args:
        msgtype: Type of the message.
        package_context: Package of a type that has none.

    Raises:
        MsgSpecException: The message does not exist, or its definition is invalid.
    """
    package, base = package_resource_name(msgtype)
    package = package or package_context
    name = f"{package}{SEP}{base}"
    store = type_store()
    try:
        if package in shipped_packages():
            text = ros1_definition(store.message(name)).partition(f"{'=' * 80}\n")[0]
        else:
            text = store.definition(f"{package}/msg/{base}").text
    except (TypeNotFound, PackageError) as error:
        raise MsgSpecException(f"Cannot locate message type [{name}]: {error}") from error
    return name, load_from_string(text, package, name, base)


def list_msg_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of the messages of a package, without it.

    Args:
        package: Name of the package.
        include_depends: Whether to add those of the packages that it depends on, with them.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    found = list_package_resources(package, include_depends, "msg", lambda p: p.endswith(EXT))
    return [name.removesuffix(EXT) for name in found]


def msg_file(package: str, type_: str) -> str:
    """Return the path of the definition of a message; it need not exist.

    Raises:
        InvalidROSPkgException: The package does not exist.
    """
    return resource_file(package, "msg", type_ + EXT)


def get_pkg_msg_specs(package: str) -> tuple[list[tuple[str, MsgSpec]], list[str]]:
    """Return the messages of a package, and the names of those that cannot be read.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    specs: list[tuple[str, MsgSpec]] = []
    failures: list[str] = []
    for name in list_msg_types(package, include_depends=False):
        try:
            specs.append(load_by_type(name, package))
        except MsgSpecException as error:
            failures.append(name)
            sys.stdout.write(f"ERROR: unable to load {name}, {error}\n")
    return specs, failures


# The table of messages.

EXTENDED_BUILTINS = {TIME: load_from_string(TIME_MSG), DURATION: load_from_string(DURATION_MSG)}
REGISTERED_TYPES: dict[str, MsgSpec] = {}
_loaded_packages: list[str] = []
_initialized = False


def _init() -> None:
    """Register what every program has: headers and times."""
    global _initialized  # noqa: PLW0603  # ROS 1's
    if _initialized:
        return
    header = load_from_string(_HEADER_MSG, "", HEADER, HEADER)
    REGISTERED_TYPES.update(dict.fromkeys(_HEADER_NAMES, header) | EXTENDED_BUILTINS)
    _initialized = True


def reinit() -> None:
    """Forget the messages that have been registered."""
    global _initialized  # noqa: PLW0603  # ROS 1's
    _initialized = False
    _loaded_packages.clear()
    REGISTERED_TYPES.clear()
    _init()


def register(msg_type_name: str, msg_spec: MsgSpec) -> None:
    """Register a message."""
    _report(f"Register msg {msg_type_name}")
    REGISTERED_TYPES[msg_type_name] = msg_spec


def is_registered(msg_type_name: str) -> bool:
    """Return whether a message has been registered."""
    return msg_type_name in REGISTERED_TYPES


def get_registered(msg_type_name: str, default_package: str | None = None) -> MsgSpec:
    """Return a message that has been registered.

    Args:
        msg_type_name: Name of the message.
        default_package: Package of a name that has none.

    Raises:
        KeyError: It has not been registered.
    """
    if msg_type_name in REGISTERED_TYPES or not default_package or SEP in msg_type_name:
        return REGISTERED_TYPES[msg_type_name]
    return REGISTERED_TYPES[f"{default_package}{SEP}{msg_type_name}"]


def load_package(package: str) -> None:
    """Register the messages of a package.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    _init()
    if package in _loaded_packages:
        _report(f"Package {package} is already loaded")
        return
    _loaded_packages.append(package)
    for key, spec in get_pkg_msg_specs(package)[0]:
        register(key, spec)


def load_package_dependencies(package: str, load_recursive: bool = False) -> None:
    """Register the messages of the packages that a package depends on.

    Args:
        package: Name of the package.
        load_recursive: Whether to include the dependencies of the dependencies.

    Raises:
        ResourceNotFound: The package does not exist.
    """
    for name in RosPack().get_depends(package, implicit=load_recursive):
        load_package(name)
