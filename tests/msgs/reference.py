"""A plain, slow CDR codec: the rules of XCDR1 written down once more, one primitive at a time.

It works from the definitions, not from the generated classes, on dicts, lists and bytes, and shares
nothing with the code under test but the parsed specs.
"""

from __future__ import annotations

import struct
from typing import Any

from rosz.idl import Catalog, FieldType, MessageSpec

CODES = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
OCTETS = ("byte", "char", "uint8")


class Writer:
    def __init__(self, catalog: Catalog, order: str = "<") -> None:
        self.catalog = catalog
        self.order = order
        self.body = bytearray()

    def primitive(self, code: str, value: Any) -> None:
        packed = struct.pack(self.order + code, value)
        while len(self.body) % len(packed):
            self.body.append(0)
        self.body += packed

    def single(self, kind: FieldType, value: Any) -> None:
        if kind.base == "string":
            octets = value.encode() + b"\0"
            self.primitive("I", len(octets))
            self.body += octets
        elif kind.base == "wstring":
            units = value.encode("utf-16-le")
            self.primitive("I", len(units) // 2)
            for at in range(0, len(units), 2):
                self.primitive("I", int.from_bytes(units[at : at + 2], "little"))
        elif kind.primitive:
            self.primitive(CODES[kind.base], value)
        else:
            self.message(self.catalog.message(kind.base), value)

    def message(self, spec: MessageSpec, value: dict[str, Any]) -> None:
        for field in spec.fields:
            member = value[field.name]
            if field.type.shape == "one":
                self.single(field.type, member)
                continue
            if field.type.counted:
                self.primitive("I", len(member))
            for element in member:
                self.single(field.type, element)
        if not spec.fields:
            self.body.append(0)


class Reader:
    def __init__(self, catalog: Catalog, body: bytes, order: str) -> None:
        self.catalog = catalog
        self.order = order
        self.body = body
        self.at = 0

    def primitive(self, code: str) -> Any:
        size = struct.calcsize(code)
        while self.at % size:
            self.at += 1
        (value,) = struct.unpack_from(self.order + code, self.body, self.at)
        self.at += size
        return value

    def single(self, kind: FieldType) -> Any:
        if kind.base == "string":
            length = self.primitive("I")
            octets = self.body[self.at : self.at + length]
            self.at += length
            return octets[:-1].decode()
        if kind.base == "wstring":
            units = [self.primitive("I") for _ in range(self.primitive("I"))]
            return b"".join(unit.to_bytes(2, "little") for unit in units).decode("utf-16-le")
        if kind.primitive:
            return self.primitive(CODES[kind.base])
        return self.message(self.catalog.message(kind.base))

    def message(self, spec: MessageSpec) -> dict[str, Any]:
        value: dict[str, Any] = {}
        for field in spec.fields:
            kind = field.type
            if kind.shape == "one":
                value[field.name] = self.single(kind)
                continue
            count = self.primitive("I") if kind.counted else kind.size
            elements = [self.single(kind) for _ in range(count)]
            value[field.name] = bytes(elements) if kind.base in OCTETS else elements
        if not spec.fields:
            self.at += 1
        return value


def encode(catalog: Catalog, spec: MessageSpec, value: dict[str, Any], order: str = "<") -> bytes:
    writer = Writer(catalog, order)
    writer.message(spec, value)
    return (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") + writer.body


def decode(catalog: Catalog, spec: MessageSpec, data: bytes) -> dict[str, Any]:
    return Reader(catalog, data[4:], "<" if data[1] else ">").message(spec)
