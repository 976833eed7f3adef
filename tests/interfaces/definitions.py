"""Read the definition files the plain way, without the parser under test elsewhere."""

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2] / "interfaces"
KINDS = {"msg": 1, "srv": 2, "action": 3}  # sections of a file of each kind

# Primitive types and the numbers that a type hash gives them.
PRIMITIVES = {
    "int8": 2,
    "uint8": 3,
    "char": 3,
    "int16": 4,
    "uint16": 5,
    "int32": 6,
    "uint32": 7,
    "int64": 8,
    "uint64": 9,
    "float32": 10,
    "float64": 11,
    "bool": 15,
    "byte": 16,
    "string": 17,
    "wstring": 18,
}
TIMES = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}


@dataclass(frozen=True)
class Field:
    """A field line: the type as it is written, the name, the default as text."""

    spelling: str
    name: str
    default: str

    @property
    def base(self) -> str:
        """The type without bounds and array marks."""
        return re.split(r"[\[<]", self.spelling, maxsplit=1)[0]


@dataclass(frozen=True)
class Constant:
    """A constant line."""

    type: str
    name: str
    value: str


@dataclass(frozen=True)
class Section:
    """The text of one message, which is a whole file or a part of one."""

    package: str
    text: str

    @cached_property
    def lines(self) -> list[Field | Constant]:
        """The fields and constants in their order."""
        found: list[Field | Constant] = []
        for line in self.text.splitlines():
            code = line.partition("#")[0].strip()
            if constant := re.fullmatch(r"(\S+)\s+(\w+)\s*=\s*(.*)", code):
                found.append(Constant(*constant.groups()))
            elif code:
                spelling, name, *default = code.split(maxsplit=2)
                found.append(Field(spelling, name, "".join(default)))
        return found

    @property
    def fields(self) -> list[Field]:
        """The fields without the constants."""
        return [line for line in self.lines if isinstance(line, Field)]

    def message(self, field: Field) -> str:
        """Return the message that a field refers to, as package/msg/Name, or nothing."""
        if field.base in PRIMITIVES:
            return ""
        package, _, name = TIMES.get(field.base, field.base).rpartition("/")
        return f"{package or self.package}/msg/{name}"


@dataclass(frozen=True)
class Definition:
    """One definition file."""

    path: Path
    package: str
    kind: str
    name: str
    text: str

    def __str__(self) -> str:
        return f"{self.package}/{self.kind}/{self.name}"

    @cached_property
    def sections(self) -> list[Section]:
        """The messages that the file holds."""
        texts = re.split(r"^---$", self.text, flags=re.MULTILINE)
        return [Section(self.package, text) for text in texts]

    @cached_property
    def references(self) -> set[str]:
        """The messages that the fields refer to, as package/msg/Name."""
        found = {part.message(field) for part in self.sections for field in part.fields}
        return found - {""}


def read() -> list[Definition]:
    """Return every definition file, ordered by path."""
    return [
        Definition(path, path.parts[-3], path.parts[-2], path.stem, path.read_text("utf-8"))
        for path in sorted(ROOT.glob("*/*/*"))
    ]


DEFINITIONS = read()
