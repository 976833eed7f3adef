"""Makes ROS 1's names importable in scripts that are run directly: ``./talker.py``.

Python imports a module of this name when it starts. It only adds a finder at the end: rosz is
loaded when a module is imported that no other finder has. If the interpreter does not have rosz,
such a module stays unknown.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from types import FrameType, ModuleType

__all__ = ()

_NEEDED = sys.stdlib_module_names | {"msgspec", "rosz", "yaml", "zenoh"}
"""Modules that rosz itself needs."""


class _Last(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Install rosz's finders, and find the module with them.

        Do nothing while a module that rosz needs is being loaded: such a module tries to import
        modules of other systems (``_wmi``, ``msvcrt``), and rosz cannot load before it is complete.
        """
        if path is not None or not _NEEDED.isdisjoint(_loading()):
            return None
        sys.meta_path.remove(self)
        known = len(sys.meta_path)
        try:
            from rosz.ros1.importer import install
        except ImportError:
            return None
        install()
        added = [*sys.meta_path[: len(sys.meta_path) - known], *sys.meta_path[-1:]]
        found = (finder.find_spec(fullname, path, target) for finder in added)
        return next((spec for spec in found if spec is not None), None)


def _loading() -> Iterator[str]:
    """Yield the packages that this thread is loading."""
    frame: FrameType | None = sys._getframe()  # noqa: SLF001  # the public ways load modules
    while frame is not None:
        if frame.f_code.co_name == "<module>":
            yield str(frame.f_globals.get("__name__", "")).partition(".")[0]
        frame = frame.f_back


def _run_next() -> None:
    """Run the ``sitecustomize`` that Python would find without this one."""
    here = Path(__file__).resolve().parent
    others = [folder for folder in sys.path if Path(folder).resolve() != here]
    spec = PathFinder.find_spec("sitecustomize", others)
    if spec is not None and spec.loader is not None:
        spec.loader.exec_module(module_from_spec(spec))


sys.meta_path.append(_Last())
_run_next()
