"""Writes the straight-line code that decodes one message type.

``p`` is the position in the bytes, header included; where it is constant there is no variable.
Fields of fixed size, counts and lengths gather in *runs*, each unpacked by one call of ``struct``.
A slice does not fail at the end of damaged bytes, so the position is compared with their length
once, at the end.
"""

from __future__ import annotations

from rosz.idl.catalog import Catalog
from rosz.idl.layout import MAX_ALIGNMENT, Layout, Phase, in_run, join_codes, size_of
from rosz.idl.names import LocalNames, ModuleNames
from rosz.idl.spec import Field, FieldType, MessageSpec, element_of
from rosz.message import ARRAY_CODES, OCTETS, SCALAR_CODES

__all__ = ("Decoder",)

_STAMPED = "std_msgs/msg/Header"
"""Its first field is a sequence number that is not sent."""

_HEADER = 256
_HEADER_SIZE = 4
_LARGE = 8192


class Decoder:
    """Writes the body of one ``_decode``.

    Args:
        spec: The message.
        catalog: Specs of the types in it.
        module: Names of the module that the code will be part of.
    """

    def __init__(self, spec: MessageSpec, catalog: Catalog, module: ModuleNames) -> None:
        self._spec = spec
        self._catalog = catalog
        self._module = module
        self._lines: list[str] = []
        self._indent = ""
        self._phase = Phase(MAX_ALIGNMENT, -_HEADER_SIZE % MAX_ALIGNMENT)
        self._base = ""
        self._constant = 0
        self._run: list[tuple[str, str]] = []
        self._layout: list[str] = []
        self._size = 0
        self._numbers = 0
        self._string_lists = 0
        self._locals = LocalNames()
        self._sliced = False
        self._checked = False

    def lines(self) -> list[str]:
        """Return the statements, without indentation."""
        self._scalar("I", "h")
        value = self._message(self._spec)
        self._flush()
        self._lines.insert(1, f"if h != {_HEADER}: raise ValueError")  # after what unpacks it
        if self._sliced:
            self._emit(f"if {self._at()} > len(data): raise ValueError")
        self._emit(f"return {value}")
        return self._lines

    def _emit(self, line: str) -> None:
        self._lines.append(self._indent + line)

    def _place(self) -> str:
        """Return a key of the next field of strings, counted as the encoder counts them."""
        self._string_lists += 1
        return f"{self._spec.name} {self._string_lists}"

    def _fresh(self, prefix: str) -> str:
        self._numbers += 1
        return f"{prefix}{self._numbers}"

    def _at(self, more: int = 0) -> str:
        """Return an expression of the position, plus a number of bytes."""
        constant = self._constant + more
        if not self._base:
            return str(constant)
        return f"p + {constant}" if constant else "p"

    # Runs.

    def _scalar(self, code: str, name: str) -> None:
        alignment = 1 if code[-1] in "sx" else size_of(code)
        padding = self._phase.padding(alignment)
        if padding is None:
            self._flush()
            self._align(alignment)
            padding = 0
        if padding:
            self._layout.append(f"{padding}x")
        self._layout.append(code)
        if name:
            self._run.append((code, name))
        self._size += padding + size_of(code)
        self._phase = self._phase.plus(padding + size_of(code))

    def _flush(self) -> None:
        """Emit the unpacking of the run."""
        if not self._layout:
            return
        names = [name for _, name in self._run]
        if self._layout == ["B"] and names:
            self._emit(f"{names[0]} = data[{self._at()}]")
        elif names:
            form = join_codes(["<", *self._layout])
            unpack = self._module.define("_u", f'_Struct("{form}").unpack_from')
            where = self._at()
            targets = f"({names[0]},)" if len(names) == 1 else ", ".join(names)
            self._emit(f"{targets} = {unpack}(data{'' if where == '0' else f', {where}'})")
        self._sliced = not names
        self._checked |= bool(names)
        self._constant += self._size
        self._run, self._layout, self._size = [], [], 0

    def _align(self, alignment: int) -> None:
        """Advance to an alignment where the padding depends on the position."""
        self._emit(f"p = {self._aligned(alignment)}")
        self._base, self._constant = "p", 0
        self._phase = Phase(alignment, 0)

    def _aligned(self, alignment: int) -> str:
        if alignment == MAX_ALIGNMENT:  # counted from behind the header: 4, 12, 20, …
            return f"({self._at(3)} | 7) - 3"
        return f"{self._at(alignment - 1)} & {-alignment}"

    def _skip(self, start: str, size: str) -> None:
        """Advance behind bytes whose size is known at run time."""
        self._emit(f"p = {start} + {size}" if start != "0" else f"p = {size}")
        self._base, self._constant = "p", 0
        self._sliced = True

    # Fields: each method returns the expression of a value, or stores it in a local.

    def _message(self, spec: MessageSpec) -> str:
        if not spec.fields:
            self._scalar("x", "")
        return self._made(spec, [self._field(field) for field in spec.fields])

    def _made(self, spec: MessageSpec, values: list[str]) -> str:
        """Return the expression of a message, by the expressions of its fields."""
        unsent = ["0"] if spec.name == _STAMPED else []
        return f"{self._module.cls(spec.name)}({', '.join(unsent + values)})"

    def _field(self, field: Field) -> str:
        kind = field.type
        if kind.shape == "one":
            return self._one(kind, field.name)
        local = self._locals.name(field.name)
        if in_run(kind):
            self._scalar(f"{kind.size}s", local)
        elif kind.base == "string":
            self._strings(kind, local)
        elif kind.base in SCALAR_CODES:
            self._block(kind, local)
        else:
            self._elements(kind, local)
        return local

    def _one(self, kind: FieldType, name: str) -> str:
        if not kind.primitive:
            return self._message(self._catalog.message(kind.base))
        local = self._locals.name(name)
        if kind.base == "string":
            self._string(kind, local)
        elif kind.base == "wstring":
            self._wide(kind, local)
        else:
            self._scalar(SCALAR_CODES[kind.base], local)
        return local

    def _string(self, kind: FieldType, local: str) -> None:
        count = self._length(kind.bound + 1 if kind.bound else 0)
        start = self._start()
        self._skip(start, count)
        self._emit(f"{local} = data[{start} : p - 1].decode()")
        self._phase = Phase(1, 0)

    def _wide(self, kind: FieldType, local: str) -> None:
        count = self._length(kind.bound)
        start = self._start()
        self._skip(start, f"{count} * 4")
        self._emit(f"{local} = {self._module.use('read_wide')}(data[{start} : p])")
        self._phase = self._phase.plus_multiple(4)

    def _length(self, most: int) -> str:
        """Read a count or a length, and refuse one above the limit unless that is 0."""
        count = self._fresh("n")
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

    def _count(self, kind: FieldType) -> str:
        if kind.shape == "fixed":
            self._flush()
            return str(kind.size)
        return self._length(kind.size if kind.shape == "bounded" else 0)

    def _start_of_elements(self, count: str, alignment: int) -> str:
        """Return an expression of the start of elements; without any there is no padding."""
        padding = self._phase.padding(alignment)
        before = self._phase
        if padding == 0:
            return self._start()
        aligned = self._aligned(alignment) if padding is None else self._at(padding)
        self._phase = self._phase.aligned(alignment)
        if count.isdigit():
            self._emit(f"q = {aligned}")
        else:
            self._emit(f"q = {aligned} if {count} else {self._at()}")
            self._phase = self._phase.common(before)
        return "q"

    def _skip_elements(self, start: str, count: str, size: int) -> None:
        if count.isdigit():
            self._phase = self._phase.plus(int(count) * size)
            self._skip(start, str(int(count) * size))
        else:
            self._phase = self._phase.plus_multiple(size)
            self._skip(start, f"{count} * {size}" if size > 1 else count)

    def _block(self, kind: FieldType, local: str) -> None:
        count = self._count(kind)
        size = size_of(SCALAR_CODES[kind.base])
        start = self._start_of_elements(count, size)
        self._skip_elements(start, count, size)
        block = f"data[{start} : p]"
        if kind.base == "bool":
            self._emit(f"{local} = {self._module.use('read_flags')}({block})")
        elif kind.base in OCTETS:
            self._emit(f"{local} = {block}")
        else:
            code = ARRAY_CODES[kind.base]
            small = f'_array("{code}", {block})'
            if not count.isdigit():
                large = f'{self._module.use("read_block")}("{code}", data, {start}, p)'
                small += f" if {count} < {_LARGE} else {large}"
            self._emit(f"{local} = {small}")

    def _strings(self, kind: FieldType, local: str) -> None:
        self._flush()
        memo = self._module.string_list(kind, self._place())
        if self._phase.padding(4) is None:
            self._align(4)
        else:
            self._constant += self._phase.padding(4) or 0
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

    def _elements(self, kind: FieldType, local: str) -> None:
        """Read a sequence of messages, or of wide strings."""
        count = self._count(kind)
        if not kind.primitive:
            spec = self._catalog.message(kind.base)
            layout = Layout.of(spec, self._catalog, self._phase)
            if layout is not None:
                self._alike(spec, local, count, layout)
                return
        self._loop(kind, local, count)

    def _alike(self, spec: MessageSpec, local: str, count: str, layout: Layout) -> None:
        """Read elements that all have the same layout."""
        alignment = size_of(layout.leaves[0][1]) if layout.leaves else 1
        start = self._start_of_elements(count, alignment)
        self._skip_elements(start, count, layout.size)
        unpack = self._module.define("_i", f'_Struct("{join_codes([layout.form])}").iter_unpack')
        elements = f"{unpack}(data[{start} : p])"
        if all(len(leaf) == 1 for leaf, _ in layout.leaves):
            self._emit(f"{local} = list(_starmap({self._module.cls(spec.name)}, {elements}))")
            return
        names = ["_".join(("e", *leaf)) for leaf, _ in layout.leaves]
        targets = ", ".join(names) + "," * (len(names) == 1)
        self._emit(f"{local} = [{self._nested(spec, 'e')} for {targets} in {elements}]")

    def _nested(self, spec: MessageSpec, local: str) -> str:
        values = [
            f"{local}_{field.name}"
            if field.type.primitive
            else self._nested(self._catalog.message(field.type.base), f"{local}_{field.name}")
            for field in spec.fields
        ]
        return self._made(spec, values)

    def _loop(self, kind: FieldType, local: str, count: str) -> None:
        """Read elements one by one."""
        phase = self._steady(kind)
        self._emit(f"{local} = []")
        if self._at() != "p":
            self._emit(f"p = {self._at()}")
        self._emit(f"for _ in range({count}):")
        outer = self._indent
        self._indent += "    "
        self._base, self._constant, self._phase = "p", 0, phase
        outside, self._checked = self._checked, False
        value = self._one(element_of(kind), f"{local}_one")
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

    def _steady(self, kind: FieldType) -> Phase:
        """Return what is known at the head of a loop, before the first and after any element."""
        phase = self._phase
        while True:
            trial = Decoder(self._spec, self._catalog, ModuleNames([]))
            trial._base, trial._phase = "p", phase
            trial._one(element_of(kind), "e")
            met = phase.common(trial._phase)
            if met == phase:
                return phase
            phase = met
