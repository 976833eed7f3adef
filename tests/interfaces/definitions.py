"""Read the definition files the plain way, without the parser under test elsewhere."""

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2] / "interfaces"
PRIMITIVES = frozenset(
    [
        "bool",
        "byte",
        "char",
        "int8",
        "uint8",
        "int16",
        "uint16",
        "int32",
        "uint32",
        "int64",
        "uint64",
        "float32",
        "float64",
        "string",
        "wstring",
    ]
)
KINDS = {"msg": 1, "srv": 2, "action": 3}  # sections of a file of each kind


@dataclass(frozen=True)
class Field:
    """A field line: its type without bounds and array marks, its name, its default as text."""

    type: str
    name: str
    default: str


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
    def sections(self) -> list[str]:
        """The message texts that the file holds."""
        return re.split(r"^---$", self.text, flags=re.MULTILINE)

    @cached_property
    def fields(self) -> list[Field]:
        """The fields of all sections, without constants."""
        found = []
        for line in self.text.splitlines():
            words = line.partition("#")[0].split(maxsplit=2)
            if len(words) < 2 or "=" in words[1] or (words[2:3] and words[2].startswith("=")):
                continue
            base = re.match(r"[\w/]+", words[0])
            assert base, f"{self}: {line!r} has no type"
            found.append(Field(base[0], words[1], words[2].strip() if words[2:] else ""))
        return found

    @cached_property
    def references(self) -> set[str]:
        """The messages that the fields refer to, as package/msg/Name."""
        found = set()
        for field in self.fields:
            if field.type in {"time", "duration"}:
                found.add(f"builtin_interfaces/msg/{field.type.capitalize()}")
            elif field.type not in PRIMITIVES:
                package, _, name = field.type.rpartition("/")
                found.add(f"{package or self.package}/msg/{name}")
        return found


def read() -> list[Definition]:
    """Return every definition file, ordered by path."""
    return [
        Definition(path, path.parts[-3], path.parts[-2], path.stem, path.read_text("utf-8"))
        for path in sorted(ROOT.glob("*/*/*"))
    ]


DEFINITIONS = read()
