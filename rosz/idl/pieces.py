"""Gathers what an encoder writes: runs of fields, pieces for the join, the offset so far.

An offset is known as well as it can be when the code is generated (:class:`Phase`). Where that does
not settle the padding, the generated code looks the packer of a run up by the offset at run time,
and gets the offset behind the run with it, so that it never computes one.
"""

from __future__ import annotations

from rosz.idl.layout import Phase, size_of
from rosz.idl.names import Module

__all__ = ("HEADER", "Offset", "Pieces", "alignment_of", "merge")

HEADER = "256"
"""The bytes 00 01 00 00 of a CDR header, as a little-endian number."""


class Offset:
    """Where the next byte goes.

    Attributes:
        phase: What is known now.
        terms: Expression of the rest, nothing where all is known.
        constant: What is to be added to it.
        reduced: Whether the terms are a variable that is below the full modulus.
    """

    def __init__(self, phase: Phase, terms: str = "", *, reduced: bool = False) -> None:
        self.phase = phase
        self.terms = terms
        self.constant = 0 if terms else phase.rest
        self.reduced = reduced

    def copy(self) -> Offset:
        """Return one that does not move with this one."""
        twin = Offset(self.phase, self.terms, reduced=self.reduced)
        twin.constant = self.constant
        return twin

    def plus(self, size: int) -> None:
        """Move a number of bytes on."""
        self.phase = self.phase.plus(size)
        self.constant += size

    def align(self, alignment: int, full: int) -> None:
        """Move to an alignment; what is not known now is left to the template of the run."""
        padding = self.phase.padding(alignment)
        self.phase = self.phase.aligned(alignment)
        self.constant += padding or 0
        if self.phase.modulus >= full:
            self.terms, self.constant = "", self.phase.rest

    def plus_elements(self, count: str, size: int) -> None:
        """Move behind elements of which the code computes the number."""
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


class Pieces:
    """The statements of an encoder, and the pieces that its last one joins.

    Args:
        module: The module that the code will stand in.
        full: Largest alignment in the message: offsets matter modulo this.
    """

    def __init__(self, module: Module, full: int) -> None:
        self.module = module
        self.full = full
        self.lines: list[str] = []
        self.indent = ""
        self.offset = Offset(Phase(full, -4 % full))
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
        """Return what has gathered."""
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
        """Add bytes that are there already."""
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
        self.offset.align(alignment_of(code), self.full)
        self.offset.plus(size_of(code))

    def string(self, octets: str, length: str, *, repeating: bool) -> None:
        """Add the length and the bytes of a string to the run.

        Layouts are kept by the lengths of the strings in them, so few may stand in one run, and
        only one whose length is anything.
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
        """Make the run a piece."""
        if not self._run:
            return
        run, self._run = self._run, []
        values = ", ".join(value for _, value in run if value)
        lengths = [value.replace("b", "n", 1) for code, value in run if code[0] == "$"]
        known = max(alignment_of(code) for code, _ in run) <= self._start.phase.modulus
        if known and not lengths:
            pack = self.module.define("_p", f'_Struct("{self._format(run)}").pack')
        else:
            pack = self._template(run, lengths, known=known)
        self._pieces.append(f"{pack}({values})")

    def _format(self, run: list[tuple[str, str]]) -> str:
        phase = self._start.phase
        layout = ["<"]
        for code, _ in run:
            padding = phase.padding(alignment_of(code)) or 0
            one = "" if code[0] == "|" else code
            layout.append(f"{padding}x{one}" if padding else one)
            phase = phase.plus(padding + (size_of(code) if one else 0))
        return merge(layout)

    def _template(self, run: list[tuple[str, str]], lengths: list[str], *, known: bool) -> str:
        """Have the packer looked up by lengths, and by the offset where it is not known."""
        codes = " ".join("$" if code[0] == "$" else code for code, _ in run)
        followed = self.offset.phase.modulus < self.full
        known = known and not (followed and self._start.phase.modulus < self.full)
        start = str(self._start.phase.rest) if known else "None"
        if run[0] == ("I", HEADER):
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
        self.offset = Offset(self.offset.phase, offset, reduced=True)
        return pack


def alignment_of(code: str) -> int:
    """Return the alignment of a code of a run."""
    if code[0] == "|":
        return int(code[1:])
    return 1 if code[0] == "$" or code[-1] in "sx" else size_of(code)


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
