"""ROS 1's byte layout: straight-line codecs, compiled from the schema of a class at first use.

Fields lie one behind the other without padding, in little-endian order: a string is its length and
its UTF-8 without a zero, a ``time`` two uint32 and a ``duration`` two int32 (ROS wiki, "msg", and
genpy's generated code). The layout is that of ROS 1's definition. So a header has its sequence
number, and fields that ROS 2 has added to a type are absent.

Generated code does not check its values. Where it fails, the slow codec accepts what is valid but
unusual, or says what is wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import starmap
from struct import Struct, calcsize
from typing import Any, TypeAlias

from rosz.message.ros1_layout import ros1_fields
from rosz.message.runtime import read_block, read_flags
from rosz.message.schema import ARRAY_CODES, OCTETS, SCALAR_CODES, Slot
from rosz.message.schema_codec import FAULTS, decode_plainly_ros1, encode_plainly_ros1
from rosz.message.sequences import TRUTH, flags, numbers, octets

__all__ = ("compile_decoder", "compile_encoder")

_Leaf: TypeAlias = tuple[str, str]
"""Expression of a primitive, and its type."""

_RUNTIME: dict[str, Any] = {
    "FAULTS": FAULTS,
    "TRUTH": TRUTH,
    "flags": flags,
    "numbers": numbers,
    "octets": octets,
    "read_block": read_block,
    "read_flags": read_flags,
    "starmap": starmap,
}
_LENGTH = Struct("<I")


def compile_encoder(cls: type[Any]) -> Callable[[Any], bytes]:
    """Return the function that encodes messages of a class in ROS 1's layout.

    It raises EncodeError where a value does not fit its field, or where ROS 1 has no such type.
    """
    if _has_wide_text(cls):
        return lambda m: encode_plainly_ros1(m, cls)
    source = _Source("def code(m):")
    writer = _Writer(source)
    source.indent = " " * 8
    writer.message(cls, "m")
    source.emit(f"return {writer.joined()}")
    source.lines.insert(1, "    try:")
    source.lines += ["    except FAULTS:", "        return plain(m, cls)"]
    encode: Callable[[Any], bytes] = source.function(plain=encode_plainly_ros1, cls=cls)
    return encode


def compile_decoder(cls: type[Any]) -> Callable[[bytes], Any]:
    """Return the function that decodes messages of a class from ROS 1's layout.

    It raises DecodeError for bytes that are not such a message. Bytes behind it are ignored, as
    genpy ignores them.
    """
    if _has_wide_text(cls):
        return lambda data: decode_plainly_ros1(data, cls)
    source = _Source("def code(data):")
    reader = _Reader(source)
    source.indent = " " * 8
    value = reader.message(cls)
    reader.flush()
    source.emit(f"if {reader.at()} > len(data): raise ValueError")
    source.emit(f"return {value}")
    source.lines.insert(1, "    try:")
    source.lines += ["    except FAULTS:", "        return plain(data, cls)"]
    decode: Callable[[bytes], Any] = source.function(plain=decode_plainly_ros1, cls=cls)
    return decode


class _Source:
    """A function that is being written, and the objects that its names mean.

    Args:
        head: First line.
    """

    def __init__(self, head: str) -> None:
        self.lines = [head]
        self.indent = "    "
        self._objects: dict[str, Any] = {}
        self._names: dict[tuple[str, Any], str] = {}
        self._numbers = 0

    def emit(self, line: str) -> None:
        """Add a statement."""
        self.lines.append(self.indent + line)

    def fresh(self, prefix: str) -> str:
        """Return a name for a new variable."""
        self._numbers += 1
        return f"{prefix}{self._numbers}"

    def constant(self, prefix: str, key: Any, make: Callable[[], Any]) -> str:
        """Return the name of an object, which is made when its key is new."""
        name = self._names.get((prefix, key))
        if name is None:
            name = self._names[prefix, key] = f"{prefix}{len(self._names)}_"
            self._objects[name] = make()
        return name

    def cls(self, cls: type[Any]) -> str:
        """Return the name of a message class."""
        return self.constant("C", cls, lambda: cls)

    def method(self, form: str, method: str) -> str:
        """Return the name of a method of a ``Struct``."""
        return self.constant(method, form, lambda: getattr(Struct(f"<{form}"), method))

    def function(self, **objects: Any) -> Any:
        """Return the function."""
        space = {**_RUNTIME, **self._objects, **objects}
        exec("\n".join(self.lines), space)  # noqa: S102  # the text is made of numbers and attributes
        return space["code"]


class _Writer:
    """Writes the statements that encode a message, and the pieces that one join puts together."""

    def __init__(self, source: _Source) -> None:
        self._source = source
        self._pieces: list[str] = []
        self._run: list[tuple[str, str]] = []

    def joined(self) -> str:
        """Return an expression of all bytes."""
        self._flush()
        if len(self._pieces) == 1 and self._pieces[0].endswith(")"):  # a call, which returns bytes
            return self._pieces[0]
        return f'b"".join(({", ".join(self._pieces)},))' if self._pieces else 'b""'

    def _piece(self, expression: str) -> None:
        self._flush()
        self._pieces.append(expression)

    def _flush(self) -> None:
        """Turn the run of primitives into a piece."""
        if self._run:
            pack = self._source.method("".join(code for _, code in self._run), "pack")
            self._pieces.append(f"{pack}({', '.join(value for value, _ in self._run)})")
            self._run = []

    def message(self, cls: type[Any], owner: str) -> None:
        """Encode the fields of a message."""
        for slot in ros1_fields(cls):
            value = f"{owner}.{slot.name}"
            if slot.shape == "one":
                self._one(slot, value)
            else:
                self._many(slot, value)

    def _one(self, slot: Slot, value: str) -> None:
        if not isinstance(slot.kind, str):
            local = self._source.fresh("m")
            self._source.emit(f"{local} = {value}")
            self.message(slot.kind, local)
        elif slot.kind == "string":
            local = self._source.fresh("s")
            self._source.emit(f"{local} = {value}.encode()")
            self._run.append((f"len({local})", "I"))
            self._piece(local)
        else:
            self._run.append((_checked(slot.kind, value), SCALAR_CODES[slot.kind]))

    def _count(self, slot: Slot, local: str) -> None:
        if slot.shape == "fixed":
            self._source.emit(f"if len({local}) != {slot.size}: raise ValueError")
        else:
            self._run.append((f"len({local})", "I"))

    def _many(self, slot: Slot, value: str) -> None:
        local = self._source.fresh("a")
        self._source.emit(f"{local} = {value}")
        kind = slot.kind
        if isinstance(kind, str) and kind != "string":
            self._numbers(kind, slot, local)
            return
        self._count(slot, local)
        if isinstance(kind, str):
            length = self._source.constant("pack", "I", lambda: _LENGTH.pack)
            octets = self._source.fresh("s")
            self._source.emit(f"if type({local}) is str: raise ValueError")
            self._source.emit(f"{octets} = [s.encode() for s in {local}]")
            self._piece(f'b"".join([b for s in {octets} for b in ({length}(len(s)), s)])')
            return
        leaves = _leaves(kind, "e")
        if leaves is None:
            encode = self._source.constant("encode", kind, lambda: compile_encoder(kind))
            self._piece(f'b"".join([{encode}(e) for e in {local}])')
        elif leaves:
            pack = self._source.method(_form(leaves), "pack")
            values = ", ".join(_checked(leaf, value) for value, leaf in leaves)
            self._piece(f'b"".join([{pack}({values}) for e in {local}])')

    def _numbers(self, kind: str, slot: Slot, local: str) -> None:
        more = f", {slot.size}" if slot.shape == "fixed" else ""
        count = f"len({local})"
        if kind == "bool":
            self._source.emit(f"{local} = flags({local}{more})")
        elif kind in OCTETS:
            wrong = f" or len({local}) != {slot.size}" if more else ""
            self._source.emit(f"if type({local}) is not bytes{wrong}:")
            self._source.emit(f"    {local} = octets({local}{more})")
        else:
            count = self._source.fresh("n")
            self._source.emit(f'{count}, {local} = numbers({local}, "{ARRAY_CODES[kind]}"{more})')
        if not more:
            self._run.append((count, "I"))
        self._piece(local)


class _Reader:
    """Writes the statements that decode a message.

    ``p`` is the position; where it is constant there is no variable.
    """

    def __init__(self, source: _Source) -> None:
        self._source = source
        self._base = ""
        self._constant = 0
        self._run: list[tuple[str, str]] = []

    def at(self) -> str:
        """Return an expression of the position."""
        if not self._base:
            return str(self._constant)
        return f"p + {self._constant}" if self._constant else "p"

    def flush(self) -> None:
        """Emit the unpacking of the run of primitives."""
        if not self._run:
            return
        form = "".join(code for _, code in self._run)
        targets = ", ".join(name for name, _ in self._run) + "," * (len(self._run) == 1)
        unpack = self._source.method(form, "unpack_from")
        self._source.emit(f"{targets} = {unpack}(data, {self.at()})")
        self._constant += calcsize(f"<{form}")
        self._run = []

    def message(self, cls: type[Any]) -> str:
        """Decode the fields of a message, and return the expression of the message."""
        values = []
        for slot in ros1_fields(cls):
            local = self._one(slot) if slot.shape == "one" else self._many(slot)
            values.append(f"{slot.name}={local}")
        return _made(self._source.cls(cls), cls, values)

    def _one(self, slot: Slot) -> str:
        if not isinstance(slot.kind, str):
            return self.message(slot.kind)
        local = self._source.fresh("v")
        if slot.kind == "string":
            self._skip(self._length(), 1)
            self._source.emit(f"{local} = data[q:p].decode()")
        else:
            self._run.append((local, SCALAR_CODES[slot.kind]))
        return local

    def _length(self) -> str:
        count = self._source.fresh("n")
        self._run.append((count, "I"))
        self.flush()
        return count

    def _skip(self, count: str, size: int) -> None:
        """Set ``q`` to the start of elements, and ``p`` to the position behind them."""
        self.flush()
        self._source.emit(f"q = {self.at()}")
        self._source.emit(f"p = q + {count if size == 1 else f'{count} * {size}'}")
        self._base, self._constant = "p", 0

    def _many(self, slot: Slot) -> str:
        kind = slot.kind
        local = self._source.fresh("v")
        count = str(slot.size) if slot.shape == "fixed" else self._length()
        if isinstance(kind, str) and kind != "string":
            self._skip(count, calcsize(f"<{SCALAR_CODES[kind]}"))
            if kind == "bool":
                self._source.emit(f"{local} = read_flags(data[q:p])")
            elif kind in OCTETS:
                self._source.emit(f"{local} = data[q:p]")
            else:
                self._source.emit(f'{local} = read_block("{ARRAY_CODES[kind]}", data, q, p)')
            return local
        leaves = None if isinstance(kind, str) else _leaves(kind, "e")
        if leaves and not isinstance(kind, str):
            self._alike(kind, leaves, count, local)
        else:
            self._loop(slot, count, local)
        return local

    def _alike(self, kind: type[Any], leaves: list[_Leaf], count: str, local: str) -> None:
        """Read elements that consist of primitives."""
        form = _form(leaves)
        self._skip(count, calcsize(f"<{form}"))
        elements = f"{self._source.method(form, 'iter_unpack')}(data[q:p])"
        names = [name.replace(".", "_") for name, _ in leaves]
        value = self._nested(kind, "e")
        if value == f"{self._source.cls(kind)}({', '.join(names)})":
            self._source.emit(f"{local} = list(starmap({self._source.cls(kind)}, {elements}))")
        else:
            self._source.emit(f"{local} = [{value} for {', '.join(names)}, in {elements}]")

    def _nested(self, cls: type[Any], prefix: str) -> str:
        values = []
        for slot in ros1_fields(cls):
            name = f"{prefix}_{slot.name}"
            below = slot.kind
            value = name if isinstance(below, str) else self._nested(below, name)
            values.append(f"{slot.name}={value}")
        return _made(self._source.cls(cls), cls, values)

    def _loop(self, slot: Slot, count: str, local: str) -> None:
        """Read elements one by one."""
        self.flush()
        self._source.emit(f"{local} = []")
        if self.at() != "p":
            self._source.emit(f"p = {self.at()}")
        self._source.emit(f"if {count} > len(data): raise ValueError")
        self._source.emit(f"for _ in range({count}):")
        outer = self._source.indent
        self._source.indent += "    "
        self._base, self._constant = "p", 0
        value = self._one(Slot(slot.name, slot.kind, slot.bound, "one", 0))
        self.flush()
        if self._constant:
            self._source.emit(f"p += {self._constant}")
        self._source.emit(f"{local}.append({value})")
        self._source.indent = outer
        self._base, self._constant = "p", 0


def _checked(kind: str, value: str) -> str:
    """Return the expression of a primitive; ``struct`` takes any object for a bool."""
    return f"TRUTH[{value}]" if kind == "bool" else value


def _form(leaves: list[_Leaf]) -> str:
    """Return the format of primitives that lie one behind the other."""
    return "".join(SCALAR_CODES[kind] for _, kind in leaves)


def _leaves(cls: type[Any], owner: str) -> list[_Leaf] | None:
    """Return the primitives of a message that consists of nothing else; None for any other."""
    leaves: list[_Leaf] = []
    for slot in ros1_fields(cls):
        value = f"{owner}.{slot.name}"
        if slot.shape != "one" or slot.kind == "string":
            return None
        if isinstance(slot.kind, str):
            leaves.append((value, slot.kind))
            continue
        below = _leaves(slot.kind, value)
        if below is None:
            return None
        leaves += below
    return leaves


def _made(name: str, cls: type[Any], values: list[str]) -> str:
    """Return the construction of a message; positional arguments are faster than named ones."""
    positions: tuple[str, ...] = cls.__struct_fields__
    if tuple(value.partition("=")[0] for value in values) == positions[: len(values)]:
        values = [value.partition("=")[2] for value in values]
    return f"{name}({', '.join(values)})"


def _has_wide_text(cls: type[Any]) -> bool:
    """Return whether a message has strings that ROS 1 does not have."""
    return any(
        slot.kind == "wstring" if isinstance(slot.kind, str) else _has_wide_text(slot.kind)
        for slot in ros1_fields(cls)
    )
