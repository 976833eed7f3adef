"""Compares the md5 of each type with genpy's."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rosz.errors import RoszError
from rosz.packages import PackageIndex
from rosz.typestore import TypeStore

from .devel import Devel
from .packages import Corpus, Repository

__all__ = ("compare",)


def compare(
    corpus: Corpus, devel: Devel, repositories: list[Repository]
) -> Iterator[dict[str, Any]]:
    """Yield a row for each type: its name, both md5 sums or errors, and whether they are equal.

    A type that genpy refuses, too, is equal.
    """
    real = devel.build(repositories)
    with tempfile.TemporaryDirectory() as cache:
        for repository in repositories:
            roots = list(map(Path, corpus.path(repository, real=False).split(":")))
            store = TypeStore(PackageIndex(roots), Path(cache))
            for key, wanted in real.items():
                if not key.startswith(f"{repository.name}:"):
                    continue
                kind, name = key.partition(":")[2].split()
                ours = _md5(store, kind, name)
                failed = "error:" in ours and "error:" in wanted
                equal = failed or ours == wanted
                yield {"case": key, "rosz": ours, "ros1": wanted, "equal": equal}


def _md5(store: TypeStore, kind: str, name: str) -> str:
    try:
        found: Any = store.service(name) if kind == "srv" else store.message(name)
    except RoszError as error:
        return f"error: {error}"
    return str(found._md5sum)
