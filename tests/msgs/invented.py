"""Packages of random message definitions, compiled."""

from __future__ import annotations

import random
from types import ModuleType
from typing import Any

from rosz.errors import TypeNotFound
from rosz.idl import Catalog, Definition
from rosz.idl.generate import message_module, shipped_module
from rosz.message import Message
from rosz.typestore import TypeStore

STORE = TypeStore()

PRIMITIVES = (
    *("bool", "byte", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32"),
    *("int64", "uint64", "float32", "float64", "float64", "string", "string", "string"),
    *("wstring", "string<=5", "wstring<=3", "uint8", "uint8"),
)
NAMES = ("x", "data", "name", "list", "type", "flags", "p", "header", "from", "key", "Value")


def definition(rng: random.Random, below: list[str]) -> str:
    lines = []
    for number in range(rng.choice((0, 1, 1, 2, 3, 4, 6))):
        kind = rng.choice(below) if below and rng.random() < 0.4 else rng.choice(PRIMITIVES)
        suffix = rng.choice(("", "", "", "", "[]", "[]", "[3]", "[<=4]"))
        lines.append(f"{kind}{suffix} {rng.choice(NAMES)}{number}")
    return "\n".join(lines) + "\n"


class Invented:
    """A package of random messages that build on each other."""

    def __init__(self, rng: random.Random, count: int) -> None:
        self.texts: dict[str, str] = {}
        for number in range(count):
            below = [name.rpartition("/")[2] for name in list(self.texts)[-4:]]
            self.texts[f"invented/msg/M{number}"] = definition(rng, below)
        self.catalog = Catalog(self._find)
        specs = [self.catalog.message(name) for name in self.texts]
        self.source = message_module(specs, self.catalog, lambda _: None, "invented")
        self.module: Any = ModuleType("invented")
        exec(compile(self.source, "<invented>", "exec"), self.module.__dict__)

    def _find(self, name: str) -> Definition:
        if name not in self.texts:
            raise TypeNotFound(name)
        return Definition(self.texts[name], name)

    def cls(self, name: str) -> type[Message]:
        found: type[Message] = getattr(self.module, name.rpartition("/")[2])
        return found


class Written:
    """The class of one message written down in a test.

    Args:
        text: Its definition.
        below: Definitions of types of the same package in it, by name.
    """

    def __init__(self, text: str, **below: str) -> None:
        texts = {"written/msg/It": text, **{f"written/msg/{k}": v for k, v in below.items()}}

        def find(name: str) -> Definition:
            return Definition(texts[name], name) if name in texts else STORE.definition(name)

        catalog = Catalog(find)
        specs = [catalog.message(name) for name in texts]
        source = message_module(specs, catalog, shipped_module, "written")
        self.module: Any = ModuleType("written")
        exec(compile(source, "<written>", "exec"), self.module.__dict__)

    def below(self, name: str) -> Any:
        """Return the class of a type in it."""
        return getattr(self.module, name)

    def __call__(self, *members: Any) -> Any:
        """Make a message."""
        return self.module.It(*members)
