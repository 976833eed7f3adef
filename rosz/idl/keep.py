"""Runs generated sources, and keeps them in a folder for other processes.

A source lies there under a name made of what it was generated from, so it never goes stale under
its name. Where the folder cannot be written, the source lives in memory; tracebacks show its lines
either way.
"""

from __future__ import annotations

import linecache
from importlib.abc import Loader
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any

__all__ = ("Keep",)


class Keep:
    """A folder of generated sources.

    Args:
        folder: The folder, made when it is needed; nothing is kept when not given.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder

    def find(
        self, name: str, stem: str, namespace: dict[str, Any], members: list[str]
    ) -> ModuleType | None:
        """Run a kept source, if there is one and it does.

        Args:
            name: Name for the module.
            stem: What the source is kept as.
            namespace: What the source finds in its module.
            members: What must be in the module afterwards.
        """
        file = self._folder / f"{stem}.py" if self._folder is not None else None
        if file is None or not file.is_file():
            return None
        try:
            module = _run(name, SourceFileLoader(name, str(file)), namespace)
        except Exception:  # noqa: BLE001  # whatever ails a kept file, it is generated anew
            return None
        return module if all(hasattr(module, member) for member in members) else None

    def run(self, name: str, stem: str, namespace: dict[str, Any], source: str) -> ModuleType:
        """Keep a source and run it; arguments as :meth:`find`."""
        file = self._write(stem, source)
        loader = SourceFileLoader(name, str(file)) if file else _TextLoader(source, f"<{stem}>")
        return _run(name, loader, namespace)

    def _write(self, stem: str, source: str) -> Path | None:
        """Write a source, whole or not at all: others may do so at the same time."""
        if self._folder is None:
            return None
        import tempfile

        file = self._folder / f"{stem}.py"
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile(
                "w", encoding="utf-8", dir=self._folder, suffix=".tmp", delete=False
            ) as temporary:
                temporary.write(source)
            Path(temporary.name).replace(file)
        except OSError:
            return None  # a read-only home: the source stays in memory
        return file


def _run(name: str, loader: Loader, namespace: dict[str, Any]) -> ModuleType:
    spec = spec_from_loader(name, loader)
    if spec is None:
        raise ImportError(name)
    module = module_from_spec(spec)
    module.__dict__.update(namespace)
    loader.exec_module(module)
    return module


class _TextLoader(Loader):
    """Runs a source that has no file; tracebacks find its lines in ``linecache``."""

    def __init__(self, source: str, name: str) -> None:
        self._source = source
        self._name = name

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave the making of the module to the import system."""

    def exec_module(self, module: ModuleType) -> None:
        """Run the source in the module."""
        lines = self._source.splitlines(keepends=True)
        linecache.cache[self._name] = (len(self._source), None, lines, self._name)
        exec(compile(self._source, self._name, "exec"), module.__dict__)  # noqa: S102  # our own
