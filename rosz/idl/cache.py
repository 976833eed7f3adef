"""A cache of generated sources in a folder, which other processes use too.

The name of a source is made of what it was generated from, so a cached source is never stale. Where
the folder cannot be written, the source stays in memory; tracebacks show its lines either way.
"""

from __future__ import annotations

import linecache
from importlib.abc import Loader
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any

__all__ = ("SourceCache",)


class SourceCache:
    """A folder of generated sources.

    Args:
        folder: The folder, made when needed; None to keep sources in memory only.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder

    def load(
        self, name: str, stem: str, namespace: dict[str, Any], members: list[str]
    ) -> ModuleType | None:
        """Run a cached source and return its module; None where there is none that works.

        Args:
            name: Name of the module.
            stem: Name of the source in the cache.
            namespace: Values that the source finds in its module.
            members: Names that the module must have afterwards.
        """
        file = self._folder / f"{stem}.py" if self._folder is not None else None
        if file is None or not file.is_file():
            return None
        try:
            module = _run(name, SourceFileLoader(name, str(file)), namespace)
        except Exception:  # noqa: BLE001  # a damaged file is generated again
            return None
        return module if all(hasattr(module, member) for member in members) else None

    def add(self, name: str, stem: str, namespace: dict[str, Any], source: str) -> ModuleType:
        """Run a source and keep it; arguments as `load`."""
        file = self._write(stem, source)
        loader = SourceFileLoader(name, str(file)) if file else _TextLoader(source, f"<{stem}>")
        return _run(name, loader, namespace)

    def _write(self, stem: str, source: str) -> Path | None:
        """Write a source atomically, since other processes may write the same one."""
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
    """Runs a source without a file; tracebacks find its lines in ``linecache``."""

    def __init__(self, source: str, name: str) -> None:
        self._source = source
        self._name = name

    def create_module(self, spec: ModuleSpec) -> None:
        """Let the import system make the module."""

    def exec_module(self, module: ModuleType) -> None:
        """Run the source in the module."""
        lines = self._source.splitlines(keepends=True)
        linecache.cache[self._name] = (len(self._source), None, lines, self._name)
        exec(compile(self._source, self._name, "exec"), module.__dict__)  # noqa: S102  # our own
