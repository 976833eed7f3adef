"""Writes the straight-line code that decodes one message type from a byte layout.

``p`` is the position in the bytes, counted from the header. A constant position needs no variable.
Fields of fixed size, counts and lengths gather in *runs*, each unpacked by one call of ``struct``.
A slice does not fail at the end of damaged bytes, so the position is compared with their length
once, at the end.
"""

from __future__ import annotations

from typing import Any

from rosz.message.offsets import Elements, Phase, Walk, alignment_of, in_run, join_codes, size_of
from rosz.message.schema import ARRAY_CODES, OCTETS, SCALAR_CODES, Slot
from rosz.message.source_names import LocalNames, SourceNames

_LARGE = 8192  # elements, from which the copy that read_block saves costs more than its call


class DecoderSource:
    """Writes the body of a function that returns the message in the bytes ``data``.

    Args:
        kind: The type of the message.
        names: Names of the module that the code will be part of.
    """

    def __init__(self, kind: Any, names: SourceNames) -> None:
        self._kind = kind
        self._names = names
        self._layout = names.layout
        self._lines: list[str] = []
        self._indent = ""
        alignment = self._layout.alignment
        self._phase = Phase(alignment, -len(self._layout.header) % alignment)
        self._base = ""
        self._constant = 0
        self._run: list[tuple[str, str]] = []
        self._codes: list[str] = []
        self._size = 0
        self._string_lists = 0
        self._locals = LocalNames()
        self._sliced = False
        self._checked = False

    def lines(self) -> list[str]:
        """Return the statements, without indentation."""
        header = self._layout.header
        if header:
            self._scalar("I", "h")
        value = self._message(self._kind)
        self._flush()
        if header:  # after the statement that unpacks it
            wrong = f"if h != {int.from_bytes(header, 'little')}: raise ValueError"
            self._lines.insert(1, wrong)
        if self._sliced:
            self._emit(f"if {self._at()} > len(data): raise ValueError")
        self._emit(f"return {value}")
        return self._lines

    def _emit(self, line: str) -> None:
        self._lines.append(self._indent + line)

    def _at(self, more: int = 0) -> str:
        """Return an expression of the position, plus a number of bytes."""
        constant = self._constant + more
        if not self._base:
            return str(constant)
        return f"p + {constant}" if constant else "p"

    # Runs.

    def _scalar(self, code: str, name: str) -> None:
        alignment = alignment_of(code, self._layout)
        padding = self._phase.padding(alignment)
        if padding is None:
            self._flush()
            self._align(alignment)
            padding = 0
        if padding:
            self._codes.append(f"{padding}x")
        self._codes.append(code)
        if name:
            self._run.append((code, name))
        self._size += padding + size_of(code)
        self._phase = self._phase.plus(padding + size_of(code))

    def _flush(self) -> None:
        """Emit the unpacking of the run."""
        if not self._codes:
            return
        names = [name for _, name in self._run]
        if self._codes == ["B"] and names:
            self._emit(f"{names[0]} = data[{self._at()}]")
        elif names:
            form = join_codes(["<", *self._codes])
            unpack = self._names.define("_u", f'_Struct("{form}").unpack_from')
            where = self._at()
            targets = f"({names[0]},)" if len(names) == 1 else ", ".join(names)
            self._emit(f"{targets} = {unpack}(data{'' if where == '0' else f', {where}'})")
        self._sliced = not names
        self._checked |= bool(names)
        self._constant += self._size
        self._run, self._codes, self._size = [], [], 0

    def _align(self, alignment: int) -> None:
        """Advance to an alignment where the padding depends on the position."""
        self._emit(f"p = {self._aligned(alignment)}")
        self._base, self._constant = "p", 0
        self._phase = Phase(alignment, 0)

    def _aligned(self, alignment: int) -> str:
        header = len(self._layout.header) % alignment
        if header:  # alignment is counted from behind it: 4, 12, 20, …
            return f"({self._at(alignment - 1 - header)} | {alignment - 1}) - {header - 1}"
        return f"{self._at(alignment - 1)} & {-alignment}"

    def _skip(self, start: str, size: str) -> None:
        """Advance behind bytes whose size is known at run time."""
        self._emit(f"p = {start} + {size}" if start != "0" else f"p = {size}")
        self._base, self._constant = "p", 0
        self._sliced = True

    # Fields: each method returns the expression of a value, or stores it in a local.

    def _message(self, kind: Any) -> str:
        fields = self._names.fields(kind)
        if not fields and self._layout.empty:
            self._scalar("x", "")
        return self._names.make(kind, [self._field(slot) for slot in fields])

    def _field(self, slot: Slot) -> str:
        if slot.shape == "one":
            return self._one(slot, slot.name)
        local = self._locals.name(slot.name)
        if in_run(slot):
            self._scalar(f"{slot.size}s", local)
        elif slot.kind == "string":
            self._strings(slot, local)
        elif isinstance(slot.kind, str) and slot.kind in SCALAR_CODES:
            self._block(slot, slot.kind, local)
        else:
            self._elements(slot, local)
        return local

    def _one(self, slot: Slot, name: str) -> str:
        if not isinstance(slot.kind, str):
            return self._message(slot.kind)
        local = self._locals.name(name)
        if slot.kind == "string":
            self._string(slot, local)
        elif slot.kind == "wstring":
            self._wide(slot, local)
        else:
            self._scalar(SCALAR_CODES[slot.kind], local)
        return local

    def _string(self, slot: Slot, local: str) -> None:
        zeros = self._layout.zeros
        count = self._length(slot.bound + zeros if slot.bound else 0)
        start = self._start()
        self._skip(start, count)
        end = f"p - {zeros}" if zeros else "p"
        self._emit(f"{local} = data[{start} : {end}].decode()")
        self._phase = self._phase.plus_elements(count, 1)

    def _wide(self, slot: Slot, local: str) -> None:
        count = self._length(slot.bound)
        start = self._start()
        self._skip(start, f"{count} * 4")
        self._emit(f"{local} = {self._names.use('read_wide')}(data[{start} : p])")
        self._phase = self._phase.plus_elements(count, 4)

    def _length(self, most: int) -> str:
        """Read a count or a length, and refuse one above the limit unless that is 0."""
        count = self._locals.fresh("n")
        self._scalar("I", count)
        self._flush()
        if most:
            self._emit(f"if {count} > {most}: raise ValueError")
        return count

    def _start(self) -> str:
        """Return an expression of the position that stays valid when ``p`` changes."""
        where = self._at()
        if not self._base:
            return where
        self._emit(f"q = {where}")
        return "q"

    def _count(self, slot: Slot) -> str:
        if slot.shape == "fixed":
            self._flush()
            return str(slot.size)
        return self._length(slot.size if slot.shape == "bounded" else 0)

    def _skip_elements(self, count: str, size: int, alignment: int) -> str:
        """Advance behind elements, and return an expression of their start.

        An empty sequence has no padding.
        """
        padding = self._phase.padding(alignment)
        before = self._phase
        if padding == 0:
            start = self._start()
        else:
            start = "q"
            aligned = self._aligned(alignment) if padding is None else self._at(padding)
            self._phase = self._phase.aligned(alignment)
            if count.isdigit():
                self._emit(f"q = {aligned}")
            else:
                self._emit(f"q = {aligned} if {count} else {self._at()}")
                self._phase = self._phase.common(before)
        self._phase = self._phase.plus_elements(count, size)
        if count.isdigit():
            self._skip(start, str(int(count) * size))
        else:
            self._skip(start, f"{count} * {size}" if size > 1 else count)
        return start

    def _block(self, slot: Slot, kind: str, local: str) -> None:
        count = self._count(slot)
        code = SCALAR_CODES[kind]
        start = self._skip_elements(count, size_of(code), alignment_of(code, self._layout))
        block = f"data[{start} : p]"
        if kind == "bool":
            self._emit(f"{local} = {self._names.use('read_flags')}({block})")
        elif kind in OCTETS:
            self._emit(f"{local} = {block}")
        else:
            code = ARRAY_CODES[kind]
            small = f'_array("{code}", {block})'
            if not count.isdigit():
                large = f'{self._names.use("read_block")}("{code}", data, {start}, p)'
                small += f" if {count} < {_LARGE} else {large}"
            self._emit(f"{local} = {small}")

    def _strings(self, slot: Slot, local: str) -> None:
        self._flush()
        self._string_lists += 1  # counted as the encoder counts them
        place = f"{self._names.cls(self._kind)} {self._string_lists}"
        memo = self._names.string_list(slot, place)
        alignment = self._layout.limit(4)
        if self._phase.padding(alignment) is None:
            self._align(alignment)
        else:
            self._constant += self._phase.padding(alignment) or 0
        where = self._at()
        self._emit(f"k, {local} = {memo}.read")
        self._emit(f"if data.startswith(k, {where}):")
        self._emit(f"    p = {where} + len(k)" if where != "0" else "    p = len(k)")
        self._emit(f"    {local} = {local}[:]")
        self._emit("else:")
        self._emit(f"    {local}, p = {memo}.take(data, {where})")
        self._checked = True
        self._base, self._constant = "p", 0
        self._phase = Phase(1, 0)

    def _elements(self, slot: Slot, local: str) -> None:
        """Read a sequence of messages, or of wide strings."""
        count = self._count(slot)
        alike = Elements.of(slot.kind, self._names.fields, self._layout, self._phase)
        if alike is not None and alike.size:
            self._alike(slot.kind, local, count, alike)
        else:
            self._loop(slot, local, count)

    def _alike(self, kind: Any, local: str, count: str, alike: Elements) -> None:
        """Read elements that all have the same layout."""
        start = self._skip_elements(count, alike.size, alike.alignment)
        unpack = self._names.define("_i", f'_Struct("{alike.form}").iter_unpack')
        elements = f"{unpack}(data[{start} : p])"
        names = ["_".join(("e", *leaf)) for leaf, _ in alike.leaves]
        value = self._nested(kind, "e")
        if value == f"{self._names.cls(kind)}({', '.join(names)})":
            self._emit(f"{local} = list(_starmap({self._names.cls(kind)}, {elements}))")
        else:
            targets = ", ".join(names) + "," * (len(names) == 1)
            self._emit(f"{local} = [{value} for {targets} in {elements}]")

    def _nested(self, kind: Any, local: str) -> str:
        values = [
            f"{local}_{slot.name}"
            if isinstance(slot.kind, str)
            else self._nested(slot.kind, f"{local}_{slot.name}")
            for slot in self._names.fields(kind)
        ]
        return self._names.make(kind, values)

    def _loop(self, slot: Slot, local: str, count: str) -> None:
        """Read elements one by one."""
        phase = Walk(self._names.fields, self._layout).steady(slot, self._phase)
        self._emit(f"{local} = []")
        if self._at() != "p":
            self._emit(f"p = {self._at()}")
        if not self._layout.empty:  # elements without bytes do not advance the position
            self._emit(f"if {count} > len(data): raise ValueError")
        self._emit(f"for _ in range({count}):")
        outer = self._indent
        self._indent += "    "
        self._base, self._constant, self._phase = "p", 0, phase
        outside, self._checked = self._checked, False
        value = self._one(slot, f"{local}_one")
        self._flush()
        if self._constant:
            self._emit(f"p += {self._constant}")
        if not self._checked:  # a damaged count must not keep the loop busy
            self._emit("if p > len(data): raise ValueError")
        self._checked = outside
        self._emit(f"{local}.append({value})")
        self._indent = outer
        self._base, self._constant, self._phase = "p", 0, phase
        self._sliced = True
