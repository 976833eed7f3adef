"""Writes the straight-line code that encodes one message type.

The fields, those of nested messages included, become *pieces* that one ``bytes.join`` puts
together. Fields of fixed size, counts and strings gather in *runs*, each packed by one call of
``struct``. Numeric sequences are pieces of their own, handed to the join as buffers.

An offset is known as well as it can be when the code is generated (:class:`Phase`). Where that does
not settle the padding, the generated code looks up the packer of a run by the offset at run time,
and gets the offset behind the run with it, so that it never computes one.
"""

from __future__ import annotations

from rosz.idl.catalog import Catalog
from rosz.idl.layout import Layout, Phase, in_run, join_codes, size_of, widest
from rosz.idl.names import LocalNames, ModuleNames, attribute
from rosz.idl.spec import Field, FieldType, MessageSpec, element_of
from rosz.message import ARRAY_CODES, OCTETS, SCALAR_CODES

__all__ = ("Encoder",)

_HEADER = "256"
"""The bytes 00 01 00 00 of a CDR header, as a little-endian number."""


class _Offset:
    """The offset of the next byte.

    Attributes:
        phase: What is known of it now.
        terms: Expression of what only the run time knows; empty where all is known.
        constant: Number to add to the terms.
        reduced: Whether the terms are a variable that is below the full modulus.
    """

    def __init__(self, phase: Phase, terms: str = "", *, reduced: bool = False) -> None:
        self.phase = phase
        self.terms = terms
        self.constant = 0 if terms else phase.rest
        self.reduced = reduced

    def copy(self) -> _Offset:
        """Return an independent copy."""
        twin = _Offset(self.phase, self.terms, reduced=self.reduced)
        twin.constant = self.constant
        return twin

    def plus(self, size: int) -> None:
        """Advance by a number of bytes."""
        self.phase = self.phase.plus(size)
        self.constant += size

    def align(self, alignment: int, full: int) -> None:
        """Advance to an alignment; the template of the run adds what is not known now."""
        padding = self.phase.padding(alignment)
        self.phase = self.phase.aligned(alignment)
        self.constant += padding or 0
        if self.phase.modulus >= full:
            self.terms, self.constant = "", self.phase.rest

    def plus_elements(self, count: str, size: int) -> None:
        """Advance behind elements whose number the generated code computes."""
        if count.isdigit():
            self.plus(int(count) * size)
            return
        self.phase = self.phase.plus_multiple(size)
        step = count if size == 1 else f"{count} * {size}"
        self.terms = f"{self.terms} + {step}" if self.terms else step
        self.reduced = False

    def value(self, full: int) -> str:
        """Return an expression for the offset, right modulo the full modulus."""
        if self.phase.modulus >= full:
            return str(self.phase.rest)
        constant = self.constant % full
        return f"{self.terms} + {constant}" if constant else self.terms

    def key(self, full: int) -> str:
        """Return an expression for the offset modulo the full modulus."""
        value = self.value(full)
        exact = value.isdigit() or (self.reduced and value == self.terms)
        return value if exact else f"{value} & {full - 1}"


class _Pieces:
    """The statements of an encoder, and the pieces that its last one joins.

    Args:
        module: Names of the module that the code will be part of.
        full: Largest alignment in the message: offsets matter modulo this.
    """

    def __init__(self, module: ModuleNames, full: int) -> None:
        self.module = module
        self.full = full
        self.lines: list[str] = []
        self.indent = ""
        self.offset = _Offset(Phase(full, -4 % full))
        self.listed = False
        self._pieces: list[str] = []
        self._run: list[tuple[str, str]] = []
        self._start = self.offset.copy()
        self._numbers = 0

    def emit(self, line: str) -> None:
        """Add a statement."""
        self.lines.append(self.indent + line)

    def fresh(self, prefix: str) -> str:
        """Return a name for a new variable."""
        self._numbers += 1
        return f"{prefix}{self._numbers}"

    def finish(self) -> None:
        """Emit the return statement."""
        self.flush()
        if self.listed:
            self.list_pieces()
            self.emit('return b"".join(out)')
        elif len(self._pieces) == 1:
            self.emit(f"return {self._pieces[0]}")
        else:
            self.emit(f'return b"".join(({", ".join(self._pieces)}))')

    # Pieces.

    def piece(self, expression: str) -> None:
        """Add an expression of bytes that are already encoded."""
        self.flush()
        self._pieces.append(expression)

    def list_pieces(self) -> None:
        """Move the pieces so far into the list ``out``, which loops append to."""
        if not self.listed:
            self.emit(f"out = [{', '.join(self._pieces)}]")
            self.listed = True
        elif len(self._pieces) == 1:
            self.emit(f"out.append({self._pieces[0]})")
        elif self._pieces:
            self.emit(f"out += ({', '.join(self._pieces)})")
        self._pieces.clear()

    # Runs.

    def _add(self, code: str, expression: str) -> None:
        if not self._run:
            self._start = self.offset.copy()
        self._run.append((code, expression))

    def scalar(self, code: str, expression: str) -> None:
        """Add a primitive to the run."""
        self._add(code, expression)
        self.offset.align(_alignment_of(code), self.full)
        self.offset.plus(size_of(code))

    def string(self, octets: str, length: str, *, repeating: bool) -> None:
        """Add the length and the bytes of a string to the run.

        Packers are cached by the lengths of the strings in a run, so a run holds few strings, and
        only one of arbitrary length.
        """
        strings = [code for code, _ in self._run if code[0] == "$"]
        if "$" in strings or len(strings) > 1:
            self.flush()
        self.scalar("I", length)
        self._add("$r" if repeating else "$", octets)
        self.offset.phase = self.offset.phase.plus_multiple(1)

    def align(self, alignment: int) -> None:
        """End the run with padding."""
        if self.offset.phase.padding(alignment) != 0:
            self._add(f"|{alignment}", "")
            self.offset.align(alignment, self.full)

    def flush(self) -> None:
        """Turn the run into a piece."""
        if not self._run:
            return
        run, self._run = self._run, []
        values = ", ".join(value for _, value in run if value)
        lengths = [value.replace("b", "n", 1) for code, value in run if code[0] == "$"]
        known = max(_alignment_of(code) for code, _ in run) <= self._start.phase.modulus
        if known and not lengths:
            pack = self.module.define("_p", f'_Struct("{self._format(run)}").pack')
        else:
            pack = self._template(run, lengths, known=known)
        self._pieces.append(f"{pack}({values})")

    def _format(self, run: list[tuple[str, str]]) -> str:
        phase = self._start.phase
        layout = ["<"]
        for code, _ in run:
            padding = phase.padding(_alignment_of(code)) or 0
            one = "" if code[0] == "|" else code
            layout.append(f"{padding}x{one}" if padding else one)
            phase = phase.plus(padding + (size_of(code) if one else 0))
        return join_codes(layout)

    def _template(self, run: list[tuple[str, str]], lengths: list[str], *, known: bool) -> str:
        """Emit the look-up of a packer by lengths, and by the offset where it is not known."""
        codes = " ".join("$" if code[0] == "$" else code for code, _ in run)
        followed = self.offset.phase.modulus < self.full
        known = known and not (followed and self._start.phase.modulus < self.full)
        start = str(self._start.phase.rest) if known else "None"
        if run[0] == ("I", _HEADER):
            start = "-4"
        keys = ", ".join(lengths if known else [self._start.key(self.full), *lengths])
        if not followed:
            make = self.module.use("Template")
            name = self.module.define("_t", f'{make}("{codes}", {start})')
            return f"{name}[{keys}]"
        make = self.module.use("Stride")
        name = self.module.define("_t", f'{make}("{codes}", {start}, {self.full})')
        pack, offset = self.fresh("f"), self.fresh("p")
        self.emit(f"{pack}, {offset} = {name}[{keys}]")
        self.offset = _Offset(self.offset.phase, offset, reduced=True)
        return pack


def _alignment_of(code: str) -> int:
    """Return the alignment of a code of a run."""
    if code[0] == "|":
        return int(code[1:])
    return 1 if code[0] == "$" or code[-1] in "sx" else size_of(code)


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
"""Names of string fields whose values repeat, so that their bytes are cached."""


class Encoder:
    """Writes the body of one ``_encode``.

    Args:
        spec: The message.
        catalog: Specs of the types in it.
        module: Names of the module that the code will be part of.
    """

    def __init__(self, spec: MessageSpec, catalog: Catalog, module: ModuleNames) -> None:
        self._spec = spec
        self._catalog = catalog
        self._module = module
        self._full = max(widest(spec, catalog), 4)  # the header is aligned to 4
        self._out = _Pieces(module, self._full)
        self._string_lists = 0
        self._locals = LocalNames()

    def lines(self) -> list[str]:
        """Return the statements, without indentation."""
        self._out.scalar("I", _HEADER)
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
        if kind.base in SCALAR_CODES:
            code = SCALAR_CODES[kind.base]
            self._out.scalar(code, self._scalar(code, value))
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

    def _scalar(self, code: str, value: str) -> str:
        """Return the expression of a primitive; ``struct`` takes any object for a bool."""
        return f"{self._module.use('TRUTH')}[{value}]" if code == "?" else value

    def _many(self, field: Field, value: str, local: str) -> None:
        kind = field.type
        if in_run(kind):
            self._octets_in_run(kind, value, local)
        elif kind.base == "string":
            self._strings(kind, value, local)
        elif kind.base in SCALAR_CODES:
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

    def _count(self, kind: FieldType, value: str, found: str = "") -> str:
        """Add the number of elements to the run, and return an expression of it.

        Args:
            kind: Type of the sequence.
            value: Expression of the sequence.
            found: Variable that has the number already; empty if there is none.
        """
        if kind.shape == "fixed":
            return str(kind.size)
        count = found or self._out.fresh("n")
        if not found:
            self._out.emit(f"{count} = len({value})")
        if kind.shape == "bounded":
            self._out.emit(f"if {count} > {kind.size}: raise ValueError")
        self._out.scalar("I", count)
        return count

    def _block(self, kind: FieldType, value: str, local: str) -> None:
        """Encode a sequence of numbers, which is a piece of its own."""
        self._out.emit(f"{local} = {value}")
        found = ""
        size = kind.size if kind.shape == "fixed" else 0
        wrong_size = f" or len({local}) != {size}" if size else ""
        more = f", {size}" if size else ""
        if kind.base == "bool":
            self._out.emit(f"{local} = {self._module.use('flags')}({local}{more})")
        elif kind.base in OCTETS:
            self._out.emit(f"if type({local}) is not bytes{wrong_size}:")
            self._out.emit(f"    {local} = {self._module.use('octets')}({local}{more})")
        else:
            code = ARRAY_CODES[kind.base]
            found = self._out.fresh("n")
            wrong = f'type({local}) is not _array or {local}.typecode != "{code}"{wrong_size}'
            numbers = self._module.use("numbers")
            self._out.emit(f"if {wrong}:")
            self._out.emit(f'    {found}, {local} = {numbers}({local}, "{code}"{more})')
            if not size:
                self._out.emit("else:")
                self._out.emit(f"    {found} = len({local})")
        count = self._count(kind, local, found)
        self._pad_elements(count, size_of(SCALAR_CODES[kind.base]))
        self._out.piece(local)
        self._out.offset.plus_elements(count, size_of(SCALAR_CODES[kind.base]))

    def _pad_elements(self, count: str, alignment: int) -> None:
        """Align elements; without any there is no padding."""
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
        self._out.offset = _Offset(phase.common(before.phase), name)

    def _strings(self, kind: FieldType, value: str, local: str) -> None:
        self._string_lists += 1
        memo = self._module.string_list(kind, f"{self._spec.name} {self._string_lists}")
        self._out.align(4)
        octets = self._out.fresh("b")
        length = octets.replace("b", "n", 1)
        self._out.emit(f"{local}, k = {value}, {memo}.written")
        self._out.emit(f"{octets} = k[1] if {local} == k[0] else {memo}.put({local})")
        self._out.emit(f"{length} = len({octets})")
        self._out.piece(octets)
        self._out.offset.plus_elements(length, 1)

    def _elements(self, field: Field, value: str, local: str) -> None:
        """Encode a sequence of messages, or of wide strings."""
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
        """Encode elements that all have the same layout."""
        self._pad_elements(count, _alignment_of(layout.leaves[0][1]) if layout.leaves else 1)
        pack = self._module.define("_p", f'_Struct("{join_codes([layout.form])}").pack')
        outer: dict[tuple[str, ...], str] = {(): "e"}
        loops = [f"for e in {local}"]
        for leaf, _ in layout.leaves:
            for depth in range(1, len(leaf)):
                if leaf[:depth] not in outer:
                    outer[leaf[:depth]] = "e_" + "_".join(leaf[:depth])
                    inner = f"{outer[leaf[: depth - 1]]}.{attribute(leaf[depth - 1])}"
                    loops.append(f"for {outer[leaf[:depth]]} in ({inner},)")
        values = ", ".join(
            self._scalar(code, f"{outer[leaf[:-1]]}.{attribute(leaf[-1])}")
            for leaf, code in layout.leaves
        )
        self._out.piece(f'b"".join([{pack}({values}) {" ".join(loops)}])')
        self._out.offset.plus_elements(count, layout.size)

    def _loop(self, field: Field, local: str) -> None:
        """Encode elements one by one."""
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
        out.offset = _Offset(phase, offset, reduced=True)
        self._one(Field(field.name, element_of(field.type)), element)
        out.flush()
        out.list_pieces()
        if offset:
            out.emit(f"{offset} = {out.offset.key(self._full)}")
        out.indent = outer
        out.offset = _Offset(phase, offset, reduced=True)

    def _steady(self, field: Field) -> Phase:
        """Return what is known at the head of a loop, before the first and after any element."""
        phase = self._out.offset.phase
        while True:
            trial = Encoder(self._spec, self._catalog, ModuleNames([]))
            trial._out.listed = True
            trial._out.offset = _Offset(phase, "p")
            trial._one(Field(field.name, element_of(field.type)), "e")
            trial._out.flush()
            met = phase.common(trial._out.offset.phase)
            if met == phase:
                return phase
            phase = met
