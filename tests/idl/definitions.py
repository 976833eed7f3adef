"""Catalogs over texts, and over what is installed."""

from __future__ import annotations

from pathlib import Path

from rosz.errors import TypeNotFound
from rosz.idl import Catalog, Definition

INTERFACES = Path(__file__).parents[2] / "interfaces"


def catalog_of(texts: dict[str, str]) -> Catalog:
    """Return a catalog of the given texts by full name."""

    def find(name: str) -> Definition:
        if name not in texts:
            raise TypeNotFound(name, "nobody wrote it")
        return Definition(texts[name], f"{name.replace('/msg/', '/')}.msg")

    return Catalog(find)


def shipped() -> Catalog:
    """Return a catalog of the definitions that come with rosz."""

    def find(name: str) -> Definition:
        package, kind, base = name.split("/")
        file = INTERFACES / package / kind / f"{base}.{kind}"
        if not file.is_file():
            raise TypeNotFound(name)
        return Definition(file.read_text("utf-8"), str(file))

    return Catalog(find)


def names(kind: str) -> list[str]:
    """Return the full names of all shipped types of a kind."""
    return sorted(
        f"{file.parts[-3]}/{kind}/{file.stem}" for file in INTERFACES.glob(f"*/{kind}/*.{kind}")
    )
