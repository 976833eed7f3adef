"""Makes ROS 1's names importable in scripts that are run directly: ``./talker.py``.

Python imports a module of this name by itself when it starts. All it does then is to stand last in
the line of finders: only a module that nobody else has makes it load anything of rosz. Where the
interpreter has no rosz, the module stays unknown.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

__all__ = ()


class _Last(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Have rosz look for a module, and for all others from now on."""
        if path is not None:
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


def _run_next() -> None:
    """Run the module of this name that Python would have found without this one."""
    here = Path(__file__).resolve().parent
    others = [folder for folder in sys.path if Path(folder).resolve() != here]
    spec = PathFinder.find_spec("sitecustomize", others)
    if spec is not None and spec.loader is not None:
        spec.loader.exec_module(module_from_spec(spec))


sys.meta_path.append(_Last())
_run_next()
