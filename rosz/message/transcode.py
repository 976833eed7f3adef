"""From ROS 1's layout to CDR and back, without making messages.

Both layouts have the same fields in the same order. CDR aligns each number to its size, ends
strings with a zero, and has no sequence number in headers. So most bytes can be copied in runs. The
function that does it is compiled for each type.
"""

from __future__ import annotations

from collections.abc import Callable
from struct import Struct, error
from typing import Any, NamedTuple, TypeAlias

from rosz.message.base import Message
from rosz.message.layout import CDR, ros1_fields
from rosz.message.runtime import PADDING
from rosz.message.schema import SCALAR_SIZES, SEQ, Slot, slots

_Data: TypeAlias = bytes | bytearray | memoryview


def compile_transcoder(
    cls: type[Message], plainly: Callable[[_Data], bytes]
) -> Callable[[_Data], bytes]:
    """Return the function that makes CDR with its header of messages in ROS 1's layout.

    Bytes behind a message are left out, as genpy ignores them. Text is not checked.

    Args:
        cls: The class of the messages.
        plainly: Function that does the same; it is called for bytes that do not fit the type, and
            is returned for types that are not the same fields in both layouts.
    """
    if not _is_alike(cls):
        return plainly
    made: Callable[[_Data], bytes] = _compile(_TO_CDR, cls, plainly)
    return made


def compile_from_cdr(
    cls: type[Message], plainly: Callable[[bytes, bytes], bytes]
) -> Callable[[bytes, bytes], list[_Data]]:
    """Return the function that makes ROS 1's layout of messages in CDR with its header.

    Its second argument is the sequence number for the headers, as four bytes. Text is not checked.
    It returns the bytes in parts, most of which are views of its argument: an image is not copied.

    Args:
        cls: The class of the messages.
        plainly: Function that does the same in one part; it is called for bytes that do not fit
            the type or are big-endian, and for types that are not the same fields in both layouts.
    """

    def whole(data: bytes, seq: bytes) -> list[_Data]:
        return [plainly(data, seq)]

    if not _is_alike(cls):
        return whole
    made: Callable[[bytes, bytes], list[_Data]] = _compile(_FROM_CDR, cls, whole)
    return made


def _compile(direction: _Statements, cls: type[Any], plainly: Callable[..., Any]) -> Any:
    copier = _Copier(direction)
    copier.message(cls)
    copier.flush()
    space: dict[str, Any] = {
        "HEADER": CDR.header,
        "PAD": PADDING,
        "error": error,
        "length": Struct("<I").unpack_from,
        "pack": Struct("<I").pack,
        "plainly": plainly,
    }
    source = "\n".join([*direction.head, *copier.lines, *direction.end])
    exec(source, space)  # noqa: S102  # the text is made of numbers and constant names
    return space["code"]


def _is_alike(cls: type[Any]) -> bool:
    """Return whether a type has fields, the same in both layouts, and none with bounds."""
    here = ros1_fields(cls)
    if not here or len(here) != len(slots(cls)) + (here[0] == SEQ and cls._sequenced):
        return False
    return all(
        not slot.bound
        and slot.shape != "bounded"
        and (
            slot.kind in SCALAR_SIZES or slot.kind == "string"
            if isinstance(slot.kind, str)
            else _is_alike(slot.kind)
        )
        for slot in here
    )


class _Statements(NamedTuple):
    """The statements that differ between the two directions.

    ``p`` is the position in the data, behind CDR's header; ``o`` is the position in the CDR that is
    made.

    Attributes:
        head: The beginning of the function.
        align: Skips or adds the padding before numbers, where ``{mask}`` is their size less one.
        copy: Copies ``{size}`` bytes.
        text: Copies a string.
        seq: Leaves out or adds the sequence number of a header.
        end: The end of the function.
    """

    head: tuple[str, ...]
    align: tuple[str, ...]
    copy: tuple[str, ...]
    text: tuple[str, ...]
    seq: str
    end: tuple[str, ...]


_TO_CDR = _Statements(
    head=(
        "def code(data):",
        "    try:",
        "        p = o = 0",
        "        out = [HEADER]",
        "        add = out.append",
    ),
    align=("k = -o & {mask}", "if k: add(PAD[k]); o += k"),
    copy=("add(data[p:p + {size}])", "p += {size}", "o += {size}"),
    text=(
        "n, = length(data, p)",
        "p += 4",
        "add(pack(n + 1))",
        "add(data[p:p + n])",
        'add(b"\\0")',
        "p += n",
        "o += n + 5",
    ),
    seq="p += 4",
    end=(
        "        if p > len(data): raise ValueError",
        "    except (error, ValueError):",
        "        return plainly(data)",
        '    return b"".join(out)',
    ),
)

_FROM_CDR = _Statements(
    head=(
        "def code(whole, seq):",
        "    try:",
        "        if whole[1] != 1: raise ValueError",  # little-endian
        "        data = memoryview(whole)[4:]",
        "        p = 0",
        "        out = []",
        "        add = out.append",
    ),
    align=("p += -p & {mask}",),
    copy=("add(data[p:p + {size}])", "p += {size}"),
    text=("n, = length(data, p)", "p += 4", "add(pack(n - 1))", "add(data[p:p + n - 1])", "p += n"),
    seq="add(seq)",
    end=(
        "        if p > len(data): raise ValueError",
        "    except (error, ValueError, IndexError):",
        "        return plainly(whole, seq)",
        "    return out",
    ),
)


class _Copier:
    """Writes the statements that copy a message.

    A run is a number of bytes that are copied as they are, since they need no padding within.
    """

    def __init__(self, direction: _Statements) -> None:
        self.lines: list[str] = []
        self._direction = direction
        self._indent = " " * 8
        self._alignment = 0
        self._size = 0
        self._depth = 0

    def _emit(self, *lines: str) -> None:
        self.lines += [self._indent + line for line in lines]

    def _align(self, size: int) -> None:
        if size > 1:
            self._emit(*(line.format(mask=size - 1) for line in self._direction.align))

    def _copy(self, size: str) -> None:
        self._emit(*(line.format(size=size) for line in self._direction.copy))

    def _take(self, size: int) -> None:
        """Add a number to the run, or begin another one where it would need padding."""
        if self._size and (size > self._alignment or self._size % size):
            self.flush()
        if not self._size:
            self._alignment = size
        self._size += size

    def flush(self) -> None:
        """Emit the copying of the run."""
        if self._size:
            self._align(self._alignment)
            self._copy(str(self._size))
            self._size = 0

    def message(self, cls: type[Any]) -> None:
        """Copy the fields of a message."""
        fields = ros1_fields(cls)
        if fields[0] == SEQ and cls._sequenced:
            self.flush()
            self._emit(self._direction.seq)
            fields = fields[1:]
        for slot in fields:
            self._field(slot)

    def _field(self, slot: Slot) -> None:
        if slot.shape == "one":
            self._one(slot.kind)
            return
        size = SCALAR_SIZES.get(slot.kind, 0) if isinstance(slot.kind, str) else 0
        if slot.shape == "fixed" and size:
            for _ in range(slot.size):
                self._take(size)
            return
        count = str(slot.size)
        if slot.shape == "sequence":
            self._take(4)
            self.flush()
            self._depth += 1
            count = f"n{self._depth}"
            self._emit(f"{count}, = length(data, p - 4)")
        self.flush()
        if size:
            self._emit(f"if {count}:")
            self._indent += "    "
            self._align(size)
            self._emit(f"k = {count} * {size}")
            self._copy("k")
        else:
            self._emit(f"if {count} > len(data): raise ValueError", f"for _ in range({count}):")
            self._indent += "    "
            self._one(slot.kind)
            self.flush()
        self._indent = self._indent[:-4]

    def _one(self, kind: Any) -> None:
        if not isinstance(kind, str):
            self.message(kind)
        elif kind == "string":
            self.flush()
            self._align(4)
            self._emit(*self._direction.text)
        else:
            self._take(SCALAR_SIZES[kind])
