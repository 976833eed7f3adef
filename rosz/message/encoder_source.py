"""Writes the straight-line code that encodes one message type in a byte layout.

The fields, those of nested messages included, become *pieces* that one ``bytes.join`` puts
together. Fields of fixed size, counts and strings gather in *runs*, each packed by one call of
``struct``. Numeric sequences are pieces of their own, handed to the join as buffers.

An offset is known as well as it can be when the code is generated (`Phase`). Where that does not
settle the padding, the generated code looks up the packer of a run by the offset at run time, and
gets the offset behind the run with it, so that it never computes one.
"""

from __future__ import annotations

from typing import Any

from rosz.message.layout import CDR
from rosz.message.offsets import (
    Elements,
    Phase,
    Walk,
    alignment_of,
    in_run,
    join_codes,
    size_of,
    widest,
)
from rosz.message.schema import ARRAY_CODES, OCTETS, SCALAR_CODES, Slot
from rosz.message.source_names import LocalNames, SourceNames


class _Offset:
    """The offset of the next byte.

    Attributes:
        phase: The part that is known now.
        terms: Expression of the part that only the run time knows; empty if there is none.
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
        """Advance to an alignment; the template of the run adds unknown padding."""
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
        self.phase = self.phase.plus_elements(count, size)
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
        names: Names of the module that the code will be part of.
        full: Largest alignment in the message: offsets matter modulo this.
    """

    def __init__(self, names: SourceNames, full: int) -> None:
        layout = names.layout
        self.names = names
        self.layout = layout
        self.full = full
        self.locals = LocalNames()
        self.lines: list[str] = []
        self.indent = ""
        self.offset = _Offset(Phase(full, -len(layout.header) % full))
        self._listed = False
        self._pieces: list[str] = []
        self._run: list[tuple[str, str]] = []
        self._start = self.offset.copy()
        self._header = str(int.from_bytes(layout.header, "little"))
        if layout.header:
            self.scalar("I", self._header)

    def emit(self, line: str) -> None:
        """Add a statement."""
        self.lines.append(self.indent + line)

    def finish(self) -> None:
        """Emit the return statement."""
        self.flush()
        if self._listed:
            self.list_pieces()
            self.emit('return b"".join(out)')
        elif not self._pieces:
            self.emit('return b""')
        elif len(self._pieces) == 1 and self._pieces[0].endswith(")"):  # a call, not a buffer
            self.emit(f"return {self._pieces[0]}")
        else:
            comma = "," * (len(self._pieces) == 1)
            self.emit(f'return b"".join(({", ".join(self._pieces)}{comma}))')

    # Pieces.

    def piece(self, expression: str) -> None:
        """Add an expression of bytes that are already encoded."""
        self.flush()
        self._pieces.append(expression)

    def list_pieces(self) -> None:
        """Move the pieces so far into the list ``out``, which loops append to."""
        self.flush()
        if not self._listed:
            self.emit(f"out = [{', '.join(self._pieces)}]")
            self._listed = True
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
        self.offset.align(alignment_of(code, self.layout), self.full)
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
        self.offset.phase = self.offset.phase.plus_elements(length, 1)

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
        aligned = (
            max(alignment_of(code, self.layout) for code, _ in run) <= self._start.phase.modulus
        )
        if aligned and not lengths:
            pack = self.names.define("_p", f'_Struct("{self._format(run)}").pack')
        else:
            pack = self._template(run, lengths, aligned=aligned)
        self._pieces.append(f"{pack}({values})")

    def _format(self, run: list[tuple[str, str]]) -> str:
        phase = self._start.phase
        codes = ["<"]
        for code, _ in run:
            padding = phase.padding(alignment_of(code, self.layout)) or 0
            bare = "" if code[0] == "|" else code
            codes.append(f"{padding}x{bare}" if padding else bare)
            phase = phase.plus(padding + (size_of(code) if bare else 0))
        return join_codes(codes)

    def _template(self, run: list[tuple[str, str]], lengths: list[str], *, aligned: bool) -> str:
        """Emit the look-up of a packer by lengths, and by the offset where it is not known."""
        codes = " ".join("$" if code[0] == "$" else code for code, _ in run)
        followed = self.offset.phase.modulus < self.full
        aligned = aligned and not (followed and self._start.phase.modulus < self.full)
        start = str(self._start.phase.rest) if aligned else "None"
        if run[0] == ("I", self._header):
            start = str(-len(self.layout.header))
        keys = ", ".join(lengths if aligned else [self._start.key(self.full), *lengths])
        most = "" if self.layout == CDR else f", most={self.layout.alignment}"
        if not followed:
            make = self.names.use("Template")
            name = self.names.define("_t", f'{make}("{codes}", {start}{most})')
            return f"{name}[{keys}]"
        make = self.names.use("Stride")
        name = self.names.define("_t", f'{make}("{codes}", {start}, {self.full})')
        pack, offset = self.locals.fresh("f"), self.locals.fresh("p")
        self.emit(f"{pack}, {offset} = {name}[{keys}]")
        self.offset = _Offset(self.offset.phase, offset, reduced=True)
        return pack


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


class EncoderSource:
    """Writes the body of a function that returns the bytes of a message ``m``.

    Args:
        kind: The type of the message.
        names: Names of the module that the code will be part of.
    """

    def __init__(self, kind: Any, names: SourceNames) -> None:
        self._kind = kind
        self._names = names
        self._layout = names.layout
        self._full = self._layout.limit(max(widest(kind, names.fields), 4))  # 4: CDR's header
        self._out = _Pieces(names, self._full)
        self._locals = self._out.locals
        self._string_lists = 0

    def lines(self) -> list[str]:
        """Return the statements, without indentation."""
        self._message(self._kind, "m")
        self._out.finish()
        return self._out.lines

    def _message(self, kind: Any, owner: str) -> None:
        fields = self._names.fields(kind)
        if not fields and self._layout.empty:
            self._out.scalar("x", "")
        for slot in fields:
            value = f"{owner}.{slot.name}"
            if slot.shape == "one":
                self._one(slot, value)
            else:
                self._many(slot, value, self._locals.name(slot.name))

    def _one(self, slot: Slot, value: str) -> None:
        kind = slot.kind
        if not isinstance(kind, str):
            if "." in value:
                local = self._locals.name(slot.name)
                self._out.emit(f"{local} = {value}")
                value = local
            self._message(kind, value)
        elif kind == "string":
            self._string(slot, value)
        elif kind == "wstring":
            self._wide(slot, value)
        else:
            code = SCALAR_CODES[kind]
            self._out.scalar(code, self._scalar(code, value))

    def _scalar(self, code: str, value: str) -> str:
        """Return the expression of a primitive; ``struct`` takes any object for a bool."""
        return f"{self._names.use('TRUTH')}[{value}]" if code == "?" else value

    def _many(self, slot: Slot, value: str, local: str) -> None:
        if in_run(slot):
            self._octets_in_run(slot, value, local)
        elif slot.kind == "string":
            self._strings(slot, value, local)
        elif isinstance(slot.kind, str) and slot.kind in SCALAR_CODES:
            self._block(slot, slot.kind, value, local)
        else:
            self._elements(slot, value, local)

    def _string(self, slot: Slot, value: str) -> None:
        octets = self._locals.fresh("b")
        length = octets.replace("b", "n", 1)
        repeating = slot.name in _REPEATING
        zeros = self._layout.zeros
        if repeating:
            texts = self._names.use("texts" if self._layout == CDR else "ros1_texts")
            self._out.emit(f"{length}, {octets} = {texts}[{value}]")
        else:
            self._out.emit(f"{octets} = {value}.encode()")
            if zeros:
                self._out.emit(f"if 0 in {octets}: raise ValueError")
            self._out.emit(f"{length} = len({octets})" + f" + {zeros}" * bool(zeros))
        if slot.bound:
            self._out.emit(f"if {length} > {slot.bound + zeros}: raise ValueError")
        self._out.string(octets, length, repeating=repeating)

    def _wide(self, slot: Slot, value: str) -> None:
        octets = self._locals.fresh("b")
        length = octets.replace("b", "n", 1)
        self._out.emit(f"{octets} = {self._names.use('pack_wide')}({value})")
        self._out.emit(f"{length} = len({octets}) >> 2")
        if slot.bound:
            self._out.emit(f"if {length} > {slot.bound}: raise ValueError")
        self._out.scalar("I", length)
        self._out.piece(octets)
        self._out.offset.plus_elements(length, 4)

    def _octets_in_run(self, slot: Slot, value: str, local: str) -> None:
        octets = self._names.use("octets")
        self._out.emit(f"{local} = {value}")
        self._out.emit(f"if type({local}) is not bytes or len({local}) != {slot.size}:")
        self._out.emit(f"    {local} = bytes({octets}({local}, {slot.size}))")
        self._out.scalar(f"{slot.size}s", local)

    def _count(self, slot: Slot, value: str, number: str = "") -> str:
        """Add the number of elements, which `number` may name, to the run; return it."""
        if slot.shape == "fixed":
            return str(slot.size)
        count = number or self._locals.fresh("n")
        if not number:
            self._out.emit(f"{count} = len({value})")
        if slot.shape == "bounded":
            self._out.emit(f"if {count} > {slot.size}: raise ValueError")
        self._out.scalar("I", count)
        return count

    def _block(self, slot: Slot, kind: str, value: str, local: str) -> None:
        """Encode a sequence of numbers, which is a piece of its own."""
        self._out.emit(f"{local} = {value}")
        number = ""
        size = slot.size if slot.shape == "fixed" else 0
        wrong_size = f" or len({local}) != {size}" if size else ""
        more = f", {size}" if size else ""
        if kind == "bool":
            self._out.emit(f"{local} = {self._names.use('flags')}({local}{more})")
        elif kind in OCTETS:
            self._out.emit(f"if type({local}) is not bytes{wrong_size}:")
            self._out.emit(f"    {local} = {self._names.use('octets')}({local}{more})")
        else:
            code = ARRAY_CODES[kind]
            number = self._locals.fresh("n")
            wrong = f'type({local}) is not _array or {local}.typecode != "{code}"{wrong_size}'
            numbers = self._names.use("numbers")
            self._out.emit(f"if {wrong}:")
            self._out.emit(f'    {number}, {local} = {numbers}({local}, "{code}"{more})')
            if not size:
                self._out.emit("else:")
                self._out.emit(f"    {number} = len({local})")
        count = self._count(slot, local, number)
        code = SCALAR_CODES[kind]
        self._pad_elements(count, alignment_of(code, self._layout))
        self._out.piece(local)
        self._out.offset.plus_elements(count, size_of(code))

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
        self._out.piece(f'({self._names.use("PADDING")}[{pads}] if {count} else b"")')
        phase = before.phase.aligned(alignment)
        if phase.modulus == self._full:
            aligned = str(phase.rest)
        else:
            aligned = f"({before.value(self._full)} + {alignment - 1} & {-alignment})"
        name = self._locals.fresh("p")
        self._out.emit(f"{name} = {aligned} if {count} else {before.value(self._full)}")
        # Without elements the offset stays where it was.
        self._out.offset = _Offset(phase.common(before.phase), name)

    def _strings(self, slot: Slot, value: str, local: str) -> None:
        self._string_lists += 1
        place = f"{self._names.cls(self._kind)} {self._string_lists}"
        memo = self._names.string_list(slot, place)
        self._out.align(self._layout.limit(4))
        octets = self._locals.fresh("b")
        length = octets.replace("b", "n", 1)
        self._out.emit(f"{local}, k = {value}, {memo}.written")
        self._out.emit(f"{octets} = k[1] if {local} == k[0] else {memo}.put({local})")
        self._out.emit(f"{length} = len({octets})")
        self._out.piece(octets)
        self._out.offset.plus_elements(length, 1)

    def _elements(self, slot: Slot, value: str, local: str) -> None:
        """Encode a sequence of messages, or of wide strings."""
        self._out.emit(f"{local} = {value}")
        if slot.shape == "fixed":
            self._out.emit(f"if len({local}) != {slot.size}: raise ValueError")
        count = self._count(slot, local)
        phase = self._out.offset.phase
        alike = Elements.of(slot.kind, self._names.fields, self._layout, phase)
        if alike is None:
            self._loop(slot, local)
        else:
            self._alike(local, count, alike)

    def _alike(self, local: str, count: str, alike: Elements) -> None:
        """Encode elements that all have the same layout."""
        self._pad_elements(count, alike.alignment)
        pack = self._names.define("_p", f'_Struct("{alike.form}").pack')
        outer: dict[tuple[str, ...], str] = {(): "e"}
        loops = [f"for e in {local}"]
        for leaf, _ in alike.leaves:
            for depth in range(1, len(leaf)):
                if leaf[:depth] not in outer:
                    outer[leaf[:depth]] = "e_" + "_".join(leaf[:depth])
                    inner = f"{outer[leaf[: depth - 1]]}.{leaf[depth - 1]}"
                    loops.append(f"for {outer[leaf[:depth]]} in ({inner},)")
        values = ", ".join(
            self._scalar(code, f"{outer[leaf[:-1]]}.{leaf[-1]}") for leaf, code in alike.leaves
        )
        self._out.piece(f'b"".join([{pack}({values}) {" ".join(loops)}])')
        self._out.offset.plus_elements(count, alike.size)

    def _loop(self, slot: Slot, local: str) -> None:
        """Encode elements one by one."""
        out = self._out
        out.list_pieces()
        phase = Walk(self._names.fields, self._layout).steady(slot, out.offset.phase)
        offset = ""
        if phase.modulus < self._full:
            offset = self._locals.fresh("p")
            out.emit(f"{offset} = {out.offset.key(self._full)}")
        element = self._locals.name(f"{slot.name}_one")
        out.emit(f"for {element} in {local}:")
        outer = out.indent
        out.indent += "    "
        out.offset = _Offset(phase, offset, reduced=True)
        self._one(slot, element)
        out.list_pieces()
        if offset:
            out.emit(f"{offset} = {out.offset.key(self._full)}")
        out.indent = outer
        out.offset = _Offset(phase, offset, reduced=True)
