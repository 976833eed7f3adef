"""Writes the straight-line code that encodes one message type.

The fields, those of nested messages included, become *pieces* that one ``bytes.join`` puts together.
Fields of fixed size, counts and short strings gather in *runs*, each packed by one call of
``struct``. Numeric sequences are pieces of their own, handed to the join as buffers.
"""

from __future__ import annotations

from rosz.idl.catalog import Catalog
from rosz.idl.layout import ALIGNED, ARRAYS, CODES, OCTETS, Phase, fixed_layout, in_run, size_of
from rosz.idl.names import Locals, Module, attribute
from rosz.idl.spec import Field, FieldType, MessageSpec

__all__ = ("Encoder", "element_of", "merge")

_HEADER = 256  # the bytes 00 01 00 00 as a little-endian number
_MOST_STRINGS = 4
_LONG = 30

_REPEATING = frozenset(
    {
        "child_frame_id",
        "distortion_model",
        "encoding",
        "format",
        "frame_id",
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


class _Offset:
    """Where the next byte goes, modulo 8: what is known now, and how to compute the rest."""

    def __init__(self, phase: Phase, terms: str = "", constant: int = 0) -> None:
        self.phase = phase
        self.terms = terms
        self.constant = constant

    def copy(self) -> _Offset:
        return _Offset(self.phase, self.terms, self.constant)

    def _settle(self) -> None:
        if self.phase.modulus == ALIGNED:
            self.terms, self.constant = "", self.phase.rest

    def plus(self, size: int) -> None:
        self.phase = self.phase.plus(size)
        self.constant += size
        self._settle()

    def plus_term(self, term: str, size: int) -> None:
        self.phase = self.phase.plus_multiple(size)
        step = term if size == 1 else f"{term} * {size}"
        self.terms = f"{self.terms} + {step}" if self.terms else step
        self._settle()

    def plus_elements(self, count: str, size: int) -> None:
        if count.isdigit():
            self.plus(int(count) * size)
        else:
            self.plus_term(count, size)

    def align(self, alignment: int) -> None:
        padding = self.phase.padding(alignment)
        self.phase = self.phase.aligned(alignment)
        if padding is None:
            self.terms = f"({self.terms} + {self.constant + alignment - 1} & {-alignment})"
            self.constant = 0
        else:
            self.constant += padding
        self._settle()

    @property
    def value(self) -> str:
        """An expression for the offset modulo 8."""
        if not self.terms:
            return str(self.constant)
        constant = self.constant % ALIGNED
        return f"{self.terms} + {constant}" if constant else self.terms


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
        self._lines: list[str] = []
        self._indent = ""
        self._offset = _Offset(Phase(ALIGNED, -4 % ALIGNED))
        self._pieces: list[str] = []
        self._run: list[tuple[str, str]] = []
        self._start = self._offset.copy()
        self._listed = False
        self._numbers = 0
        self._memories = 0
        self._locals = Locals()

    def lines(self) -> list[str]:
        """Return the statements, without indentation."""
        self._scalar("I", str(_HEADER))
        self._message(self._spec, "m")
        self._flush()
        if self._listed:
            self._list_pieces()
            self._emit('return b"".join(out)')
        elif len(self._pieces) == 1:
            self._emit(f"return {self._pieces[0]}")
        else:
            self._emit(f'return b"".join(({", ".join(self._pieces)}))')
        return self._lines

    def _emit(self, line: str) -> None:
        self._lines.append(self._indent + line)

    def _place(self) -> str:
        """Name the next field of strings, counted as the decoder counts them."""
        self._memories += 1
        return f"{self._spec.name} {self._memories}"

    def _fresh(self, prefix: str) -> str:
        self._numbers += 1
        return f"{prefix}{self._numbers}"

    # Pieces and runs.

    def _piece(self, expression: str) -> None:
        self._flush()
        self._pieces.append(expression)

    def _list_pieces(self) -> None:
        """Move the pieces so far into the list ``out``, which loops append to."""
        if not self._listed:
            self._emit(f"out = [{', '.join(self._pieces)}]")
            self._listed = True
        elif len(self._pieces) == 1:
            self._emit(f"out.append({self._pieces[0]})")
        elif self._pieces:
            self._emit(f"out += ({', '.join(self._pieces)})")
        self._pieces.clear()

    def _begin(self) -> None:
        if not self._run:
            self._start = self._offset.copy()

    def _scalar(self, code: str, expression: str) -> None:
        self._begin()
        self._run.append((code, expression))
        if code[-1] not in "sx":
            self._offset.align(size_of(code))
        self._offset.plus(size_of(code))

    def _align_run(self, alignment: int) -> None:
        """End the run with padding."""
        if self._offset.phase.padding(alignment) == 0:
            return
        self._begin()
        self._run.append((f"|{alignment}", ""))
        self._offset.align(alignment)

    def _flush(self) -> None:
        if not self._run:
            return
        run, self._run = self._run, []
        values = [value for _, value in run if value]
        lengths = [value.replace("b", "n", 1) for code, value in run if code == "$"]
        alignments = [_alignment(code) for code, _ in run]
        known = max(alignments) <= self._start.phase.modulus
        if known and not lengths:
            pack = self._module.define("_p", f'_Struct("{self._format(run)}").pack')
        else:
            pack = self._template(run, lengths, known=known)
        self._pieces.append(f"{pack}({', '.join(values)})")

    def _format(self, run: list[tuple[str, str]]) -> str:
        phase = self._start.phase
        layout = ["<"]
        for code, _ in run:
            padding = phase.padding(_alignment(code)) or 0
            one = "" if code[0] == "|" else code
            layout.append(f"{padding}x{one}" if padding else one)
            phase = phase.plus(padding + (size_of(code) if one else 0))
        return merge(layout)

    def _template(self, run: list[tuple[str, str]], lengths: list[str], *, known: bool) -> str:
        codes = " ".join(code for code, _ in run)
        start = self._start.phase.rest if known else None
        if known and run[0] == ("I", str(_HEADER)):
            start = -4
        name = self._module.define("_t", f'{self._module.use("Template")}("{codes}", {start})')
        keys = lengths if known else [f"{self._start.value} & 7", *lengths]
        return f"{name}[{', '.join(keys)}]"

    def _settle(self) -> None:
        """Give a long expression of the offset a name."""
        if len(self._offset.terms) > _LONG:
            name = self._fresh("p")
            self._emit(f"{name} = {self._offset.value}")
            self._offset = _Offset(self._offset.phase, name)

    # Fields.

    def _message(self, spec: MessageSpec, owner: str) -> None:
        if not spec.fields:
            self._scalar("x", "")
        for field in spec.fields:
            self._field(field, f"{owner}.{attribute(field.name)}")

    def _field(self, field: Field, value: str) -> None:
        kind = field.type
        if kind.shape == "one":
            self._one(field, value)
        else:
            local = self._locals.name(field.name)
            if in_run(kind):
                self._octets_in_run(kind, value, local)
            elif kind.base == "string":
                self._strings(kind, value, local)
            elif kind.base in CODES:
                self._block(kind, value, local)
            else:
                self._elements(field, value, local)
        self._settle()

    def _one(self, field: Field, value: str) -> None:
        kind = field.type
        if kind.base in CODES:
            self._scalar(CODES[kind.base], value)
        elif kind.base == "string":
            self._string(kind, value, repeating=field.name in _REPEATING)
        elif kind.base == "wstring":
            self._wide(kind, value)
        elif "." in value:
            local = self._locals.name(field.name)
            self._emit(f"{local} = {value}")
            self._message(self._catalog.message(kind.base), local)
        else:
            self._message(self._catalog.message(kind.base), value)

    def _string(self, kind: FieldType, value: str, *, repeating: bool) -> None:
        if sum(code == "$" for code, _ in self._run) >= _MOST_STRINGS:
            self._flush()
        octets = self._fresh("b")
        length = octets.replace("b", "n", 1)
        if repeating:
            self._emit(f"{length}, {octets} = {self._module.use('texts')}[{value}]")
        else:
            self._emit(f"{octets} = {value}.encode()")
            self._emit(f"if 0 in {octets}: raise ValueError")
            self._emit(f"{length} = len({octets}) + 1")
        if kind.bound:
            self._emit(f"if {length} > {kind.bound + 1}: raise ValueError")
        self._scalar("I", length)
        self._run.append(("$", octets))
        self._offset.plus_term(length, 1)

    def _wide(self, kind: FieldType, value: str) -> None:
        octets = self._fresh("b")
        length = octets.replace("b", "n", 1)
        self._emit(f"{octets} = {self._module.use('pack_wide')}({value})")
        self._emit(f"{length} = len({octets}) >> 2")
        if kind.bound:
            self._emit(f"if {length} > {kind.bound}: raise ValueError")
        self._scalar("I", length)
        self._piece(octets)
        self._offset.plus_term(length, 4)

    def _octets_in_run(self, kind: FieldType, value: str, local: str) -> None:
        octets = self._module.use("octets")
        self._emit(f"{local} = {value}")
        self._emit(f"if type({local}) is not bytes or len({local}) != {kind.size}:")
        self._emit(f"    {local} = bytes({octets}({local}, {kind.size}))")
        self._scalar(f"{kind.size}s", local)

    def _count(self, kind: FieldType, value: str) -> str:
        """Put the number of elements into the run; return an expression of it."""
        if kind.shape == "fixed":
            return str(kind.size)
        count = self._fresh("n")
        self._emit(f"{count} = len({value})")
        if kind.shape == "bounded":
            self._emit(f"if {count} > {kind.size}: raise ValueError")
        self._scalar("I", count)
        return count

    def _block(self, kind: FieldType, value: str, local: str) -> None:
        """Write a sequence of numbers, which is a piece of its own."""
        self._emit(f"{local} = {value}")
        size = kind.size if kind.shape == "fixed" else 0
        wrong_size = f" or len({local}) != {size}" if size else ""
        more = f", {size}" if size else ""
        if kind.base == "bool":
            self._emit(f"{local} = {self._module.use('flags')}({local}{more})")
        elif kind.base in OCTETS:
            self._emit(f"if type({local}) is not bytes{wrong_size}:")
            self._emit(f"    {local} = {self._module.use('octets')}({local}{more})")
        else:
            code = ARRAYS[kind.base]
            self._emit(
                f'if type({local}) is not _array or {local}.typecode != "{code}"{wrong_size}:'
            )
            self._emit(f'    {local} = {self._module.use("numbers")}({local}, "{code}"{more})')
        count = self._count(kind, local)
        self._pad_elements(count, size_of(CODES[kind.base]))
        self._piece(local)
        self._offset.plus_elements(count, size_of(CODES[kind.base]))

    def _pad_elements(self, count: str, alignment: int) -> None:
        """Align elements, which happens only where there are some."""
        if count.isdigit():
            self._align_run(alignment)
            return
        padding = self._offset.phase.padding(alignment)
        if padding == 0:
            return
        self._flush()
        before = self._offset.copy()
        if padding is None:
            pads = f"{self._module.use('PADDING')}[-({before.value}) & {alignment - 1}]"
        else:
            pads = f"{self._module.use('PADDING')}[{padding}]"
        self._piece(f'({pads} if {count} else b"")')
        self._offset.align(alignment)
        # Without elements the offset stays where it was.
        phase = self._offset.phase.meet(before.phase)
        rest = self._offset.phase.rest
        aligned = rest if self._offset.phase.modulus == ALIGNED else f"({self._offset.value})"
        name = self._fresh("p")
        self._emit(f"{name} = {aligned} if {count} else {before.value}")
        self._offset = _Offset(phase, name)

    def _strings(self, kind: FieldType, value: str, local: str) -> None:
        memo = self._module.string_list(kind, self._place())
        self._align_run(4)
        self._emit(f"{local}, k = {value}, {memo}.written")
        octets = self._fresh("b")
        self._emit(f"{octets} = k[1] if {local} == k[0] else {memo}.put({local})")
        self._piece(octets)
        length = self._fresh("n")
        self._emit(f"{length} = len({octets})")
        self._offset.plus_term(length, 1)

    def _elements(self, field: Field, value: str, local: str) -> None:
        """Write a sequence of messages, or of wide strings."""
        kind = field.type
        self._emit(f"{local} = {value}")
        if kind.shape == "fixed":
            self._emit(f"if len({local}) != {kind.size}: raise ValueError")
        count = self._count(kind, local)
        if not kind.primitive:
            spec = self._catalog.message(kind.base)
            layout = fixed_layout(spec, self._catalog, self._offset.phase)
            if layout is not None:
                self._alike(local, count, *layout)
                return
        self._loop(field, local)

    def _alike(
        self,
        local: str,
        count: str,
        leaves: list[tuple[tuple[str, ...], str]],
        form: str,
        size: int,
    ) -> None:
        """Write elements that all have the same layout."""
        first = leaves[0][1] if leaves else "x"
        self._pad_elements(count, _alignment(first))
        pack = self._module.define("_p", f'_Struct("{merge([form])}").pack')
        outer: dict[tuple[str, ...], str] = {(): "e"}
        loops = [f"for e in {local}"]
        for leaf, _ in leaves:
            for depth in range(1, len(leaf)):
                if leaf[:depth] not in outer:
                    outer[leaf[:depth]] = "e_" + "_".join(leaf[:depth])
                    inner = f"{outer[leaf[: depth - 1]]}.{attribute(leaf[depth - 1])}"
                    loops.append(f"for {outer[leaf[:depth]]} in ({inner},)")
        values = ", ".join(f"{outer[leaf[:-1]]}.{attribute(leaf[-1])}" for leaf, _ in leaves)
        self._piece(f'b"".join([{pack}({values}) {" ".join(loops)}])')
        self._offset.plus_elements(count, size)

    def _loop(self, field: Field, local: str) -> None:
        """Write elements one by one."""
        self._flush()
        self._list_pieces()
        phase, name = self._steady(field), self._fresh("p")
        if phase.modulus < ALIGNED:
            self._emit(f"{name} = {self._offset.value}")
        element = self._locals.name(f"{field.name}_one")
        self._emit(f"for {element} in {local}:")
        outer = self._indent
        self._indent += "    "
        self._offset = _Offset(phase, name if phase.modulus < ALIGNED else "", phase.rest)
        if phase.modulus < ALIGNED:
            self._offset.constant = 0
        self._one(Field(field.name, element_of(field.type)), element)
        self._flush()
        self._list_pieces()
        if phase.modulus < ALIGNED:
            self._emit(f"{name} = {self._offset.value}")
        self._indent = outer
        self._offset = _Offset(phase, name if phase.modulus < ALIGNED else "", 0)
        if phase.modulus == ALIGNED:
            self._offset.constant = phase.rest

    def _steady(self, field: Field) -> Phase:
        """Find what is known at the head of a loop: both at first and after any element."""
        phase = self._offset.phase
        while True:
            trial = Encoder(self._spec, self._catalog, Module([]))
            trial._listed = True
            trial._offset = _Offset(phase, "p")
            trial._one(Field(field.name, element_of(field.type)), "e")
            met = phase.meet(trial._offset.phase)
            if met == phase:
                return phase
            phase = met


def element_of(kind: FieldType) -> FieldType:
    """Return the type of one element of a sequence."""
    return FieldType(kind.base, kind.bound)


def _alignment(code: str) -> int:
    if code[0] == "|":
        return int(code[1:])
    return 1 if code[-1] in "$sx" else size_of(code)


def merge(layout: list[str]) -> str:
    """Write equal neighbours of a format as a count: ``<ddd`` becomes ``<3d``."""
    merged: list[tuple[int, str]] = []
    for part in layout:
        number = ""
        for character in part:
            if character.isdigit():
                number += character
                continue
            count = int(number or 1)
            number = ""
            if merged and merged[-1][1] == character and character not in "sx<":
                merged[-1] = (merged[-1][0] + count, character)
            else:
                merged.append((count, character))
    return "".join(c if n == 1 and c != "s" else f"{n}{c}" for n, c in merged)
