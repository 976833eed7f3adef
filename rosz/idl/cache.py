"""A cache of generated sources in a folder, which other processes use too.

The name of a source is a hash of its definitions and of the generator, so a cached source is never
stale. Where the folder cannot be written, the source stays in memory; tracebacks show its lines
either way.
"""

from __future__ import annotations

import linecache
from collections.abc import Callable
from importlib.machinery import SourceFileLoader
from importlib.util import cache_from_source, module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import Any


class SourceCache:
    """A folder of generated sources.

    Args:
        folder: The folder, made when needed; None to keep sources in memory only.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder

    def load(
        self,
        name: str,
        stem: str,
        namespace: dict[str, Any],
        members: list[str],
        write: Callable[[], str],
    ) -> ModuleType:
        """Run a source and return its module; write the source if there is none that works.

        Args:
            name: Name of the module.
            stem: Name of the source in the cache.
            namespace: Values that the source finds in its module.
            members: Names that the module must have afterwards.
            write: Function that generates the source.
        """
        file = self._folder / f"{stem}.py" if self._folder is not None else None
        if file is not None:
            try:
                module = _run(name, SourceFileLoader(name, str(file)), namespace)
                if all(hasattr(module, member) for member in members):
                    return module
            except Exception:  # noqa: BLE001, S110  # what is missing or damaged is generated
                pass
        source = write()
        if file is not None and _write(file, source):
            return _run(name, SourceFileLoader(name, str(file)), namespace)
        return _run(name, _TextLoader(source, f"<{stem}>"), namespace)


def _write(file: Path, source: str) -> bool:
    """Write a source atomically, since other processes may write the same one."""
    import tempfile

    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(
            "w", encoding="utf-8", dir=file.parent, suffix=".tmp", delete=False
        ) as temporary:
            temporary.write(source)
        Path(temporary.name).replace(file)
        # Python takes compiled code for that of a source of the same size and second.
        Path(cache_from_source(file)).unlink(missing_ok=True)
    except OSError:
        return False  # a read-only home: the source stays in memory
    return True


def _run(name: str, loader: Any, namespace: dict[str, Any]) -> ModuleType:
    spec = spec_from_loader(name, loader)
    if spec is None:
        raise ImportError(name)
    module = module_from_spec(spec)
    module.__dict__.update(namespace)
    loader.exec_module(module)
    return module


class _TextLoader:
    """Runs a source without a file; tracebacks find its lines in ``linecache``.

    It is none of `importlib.abc`, since importing that takes 3 ms and 0.3 MB.
    """

    def __init__(self, source: str, name: str) -> None:
        self._source = source
        self._name = name

    def create_module(self, _: object) -> None:
        """Let the module be an ordinary one."""

    def exec_module(self, module: ModuleType) -> None:
        """Run the source in the module."""
        lines = self._source.splitlines(keepends=True)
        linecache.cache[self._name] = (len(self._source), None, lines, self._name)
        exec(compile(self._source, self._name, "exec"), module.__dict__)  # noqa: S102  # our own
