"""Writes the straight-line code that encodes one message type.

The fields, those of nested messages included, become *pieces* that one ``bytes.join`` puts
together. Fields of fixed size, counts and strings gather in *runs*, each packed by one call of
``struct``. Numeric sequences are pieces of their own, handed to the join as buffers.
"""

from __future__ import annotations

from rosz.idl.catalog import Catalog
from rosz.idl.layout import ARRAYS, CODES, OCTETS, Layout, Phase, in_run, size_of, widest
from rosz.idl.names import Locals, Module, attribute
from rosz.idl.pieces import HEADER, Offset, Pieces, alignment_of, merge
from rosz.idl.spec import Field, FieldType, MessageSpec, element_of

__all__ = ("Encoder",)

_REPEATING = frozenset(
    {
        "child_frame_id",
        "distortion_model",
        "encoding",
        "file",
        "format",
        "frame_id",
        "function",
        "hardware_id",
        "joint_name",
        "key",
        "label",
        "name",
        "node",
        "ns",
        "source_frame",
        "target_frame",
    }
)
"""Names of string fields whose values come again and again, so that their bytes are kept."""


class Encoder:
    """The body of one ``_encode``.

    Args:
        spec: The message.
        catalog: Where the types in it are.
        module: The module that the code will stand in.
    """

    def __init__(self, spec: MessageSpec, catalog: Catalog, module: Module) -> None:
        self._spec = spec
        self._catalog = catalog
        self._module = module
        self._full = max(widest(spec, catalog), 4)  # the header is a word
        self._out = Pieces(module, self._full)
        self._memories = 0
        self._locals = Locals()

    def lines(self) -> list[str]:
        """Return the statements, without indentation."""
        self._out.scalar("I", HEADER)
        self._message(self._spec, "m")
        self._out.finish()
        return self._out.lines

    def _message(self, spec: MessageSpec, owner: str) -> None:
        if not spec.fields:
            self._out.scalar("x", "")
        for field in spec.fields:
            value = f"{owner}.{attribute(field.name)}"
            if field.type.shape == "one":
                self._one(field, value)
            else:
                self._many(field, value, self._locals.name(field.name))

    def _one(self, field: Field, value: str) -> None:
        kind = field.type
        if kind.base in CODES:
            self._out.scalar(CODES[kind.base], value)
        elif kind.base == "string":
            self._string(kind, value, repeating=field.name in _REPEATING)
        elif kind.base == "wstring":
            self._wide(kind, value)
        elif "." in value:
            local = self._locals.name(field.name)
            self._out.emit(f"{local} = {value}")
            self._message(self._catalog.message(kind.base), local)
        else:
            self._message(self._catalog.message(kind.base), value)

    def _many(self, field: Field, value: str, local: str) -> None:
        kind = field.type
        if in_run(kind):
            self._octets_in_run(kind, value, local)
        elif kind.base == "string":
            self._strings(kind, value, local)
        elif kind.base in CODES:
            self._block(kind, value, local)
        else:
            self._elements(field, value, local)

    def _string(self, kind: FieldType, value: str, *, repeating: bool) -> None:
        octets = self._out.fresh("b")
        length = octets.replace("b", "n", 1)
        if repeating:
            self._out.emit(f"{length}, {octets} = {self._module.use('texts')}[{value}]")
        else:
            self._out.emit(f"{octets} = {value}.encode()")
            self._out.emit(f"if 0 in {octets}: raise ValueError")
            self._out.emit(f"{length} = len({octets}) + 1")
        if kind.bound:
            self._out.emit(f"if {length} > {kind.bound + 1}: raise ValueError")
        self._out.string(octets, length, repeating=repeating)

    def _wide(self, kind: FieldType, value: str) -> None:
        octets = self._out.fresh("b")
        length = octets.replace("b", "n", 1)
        self._out.emit(f"{octets} = {self._module.use('pack_wide')}({value})")
        self._out.emit(f"{length} = len({octets}) >> 2")
        if kind.bound:
            self._out.emit(f"if {length} > {kind.bound}: raise ValueError")
        self._out.scalar("I", length)
        self._out.piece(octets)
        self._out.offset.plus_elements(length, 4)

    def _octets_in_run(self, kind: FieldType, value: str, local: str) -> None:
        octets = self._module.use("octets")
        self._out.emit(f"{local} = {value}")
        self._out.emit(f"if type({local}) is not bytes or len({local}) != {kind.size}:")
        self._out.emit(f"    {local} = bytes({octets}({local}, {kind.size}))")
        self._out.scalar(f"{kind.size}s", local)

    def _count(self, kind: FieldType, value: str) -> str:
        """Put the number of elements into the run; return an expression of it."""
        if kind.shape == "fixed":
            return str(kind.size)
        count = self._out.fresh("n")
        self._out.emit(f"{count} = len({value})")
        if kind.shape == "bounded":
            self._out.emit(f"if {count} > {kind.size}: raise ValueError")
        self._out.scalar("I", count)
        return count

    def _block(self, kind: FieldType, value: str, local: str) -> None:
        """Write a sequence of numbers, which is a piece of its own."""
        self._out.emit(f"{local} = {value}")
        size = kind.size if kind.shape == "fixed" else 0
        wrong_size = f" or len({local}) != {size}" if size else ""
        more = f", {size}" if size else ""
        if kind.base == "bool":
            self._out.emit(f"{local} = {self._module.use('flags')}({local}{more})")
        elif kind.base in OCTETS:
            self._out.emit(f"if type({local}) is not bytes{wrong_size}:")
            self._out.emit(f"    {local} = {self._module.use('octets')}({local}{more})")
        else:
            code = ARRAYS[kind.base]
            wrong = f'type({local}) is not _array or {local}.typecode != "{code}"{wrong_size}'
            numbers = self._module.use("numbers")
            self._out.emit(f"if {wrong}:")
            self._out.emit(f'    {local} = {numbers}({local}, "{code}"{more})')
        count = self._count(kind, local)
        self._pad_elements(count, size_of(CODES[kind.base]))
        self._out.piece(local)
        self._out.offset.plus_elements(count, size_of(CODES[kind.base]))

    def _pad_elements(self, count: str, alignment: int) -> None:
        """Align elements, which happens only where there are some."""
        padding = self._out.offset.phase.padding(alignment)
        if padding == 0:
            return
        if count.isdigit():
            self._out.align(alignment)
            return
        self._out.flush()
        before = self._out.offset
        pads = f"-({before.value(self._full)}) & {alignment - 1}" if padding is None else padding
        self._out.piece(f'({self._module.use("PADDING")}[{pads}] if {count} else b"")')
        phase = before.phase.aligned(alignment)
        if phase.modulus == self._full:
            aligned = str(phase.rest)
        else:
            aligned = f"({before.value(self._full)} + {alignment - 1} & {-alignment})"
        name = self._out.fresh("p")
        self._out.emit(f"{name} = {aligned} if {count} else {before.value(self._full)}")
        # Without elements the offset stays where it was.
        self._out.offset = Offset(phase.meet(before.phase), name)

    def _strings(self, kind: FieldType, value: str, local: str) -> None:
        self._memories += 1
        memory = self._module.string_list(kind, f"{self._spec.name} {self._memories}")
        self._out.align(4)
        octets = self._out.fresh("b")
        length = octets.replace("b", "n", 1)
        self._out.emit(f"{local}, k = {value}, {memory}.written")
        self._out.emit(f"{octets} = k[1] if {local} == k[0] else {memory}.put({local})")
        self._out.emit(f"{length} = len({octets})")
        self._out.piece(octets)
        self._out.offset.plus_elements(length, 1)

    def _elements(self, field: Field, value: str, local: str) -> None:
        """Write a sequence of messages, or of wide strings."""
        kind = field.type
        self._out.emit(f"{local} = {value}")
        if kind.shape == "fixed":
            self._out.emit(f"if len({local}) != {kind.size}: raise ValueError")
        count = self._count(kind, local)
        layout = None
        if not kind.primitive:
            spec = self._catalog.message(kind.base)
            layout = Layout.of(spec, self._catalog, self._out.offset.phase)
        if layout is None:
            self._loop(field, local)
        else:
            self._alike(local, count, layout)

    def _alike(self, local: str, count: str, layout: Layout) -> None:
        """Write elements that all have the same layout."""
        self._pad_elements(count, alignment_of(layout.leaves[0][1]) if layout.leaves else 1)
        pack = self._module.define("_p", f'_Struct("{merge([layout.form])}").pack')
        outer: dict[tuple[str, ...], str] = {(): "e"}
        loops = [f"for e in {local}"]
        for leaf, _ in layout.leaves:
            for depth in range(1, len(leaf)):
                if leaf[:depth] not in outer:
                    outer[leaf[:depth]] = "e_" + "_".join(leaf[:depth])
                    inner = f"{outer[leaf[: depth - 1]]}.{attribute(leaf[depth - 1])}"
                    loops.append(f"for {outer[leaf[:depth]]} in ({inner},)")
        values = ", ".join(f"{outer[leaf[:-1]]}.{attribute(leaf[-1])}" for leaf, _ in layout.leaves)
        self._out.piece(f'b"".join([{pack}({values}) {" ".join(loops)}])')
        self._out.offset.plus_elements(count, layout.size)

    def _loop(self, field: Field, local: str) -> None:
        """Write elements one by one."""
        out = self._out
        out.flush()
        out.list_pieces()
        phase = self._steady(field)
        offset = ""
        if phase.modulus < self._full:
            offset = out.fresh("p")
            out.emit(f"{offset} = {out.offset.key(self._full)}")
        element = self._locals.name(f"{field.name}_one")
        out.emit(f"for {element} in {local}:")
        outer = out.indent
        out.indent += "    "
        out.offset = Offset(phase, offset, reduced=True)
        self._one(Field(field.name, element_of(field.type)), element)
        out.flush()
        out.list_pieces()
        if offset:
            out.emit(f"{offset} = {out.offset.key(self._full)}")
        out.indent = outer
        out.offset = Offset(phase, offset, reduced=True)

    def _steady(self, field: Field) -> Phase:
        """Find what is known at the head of a loop: both at first and after any element."""
        phase = self._out.offset.phase
        while True:
            trial = Encoder(self._spec, self._catalog, Module([]))
            trial._out.listed = True
            trial._out.offset = Offset(phase, "p")
            trial._one(Field(field.name, element_of(field.type)), "e")
            trial._out.flush()
            met = phase.meet(trial._out.offset.phase)
            if met == phase:
                return phase
            phase = met
