"""Runs a setup.py and prints the arguments of ``setup()`` about its modules, as JSON.

``python -I setup_probe.py FOLDER`` is run in a process of its own, without rosz. Nothing is built:
``setup()`` only records its arguments, and catkin_pkg and a missing setuptools are stood in for.
"""

from __future__ import annotations

import json
import os
import runpy
import sys
from contextlib import suppress
from importlib import import_module
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import MagicMock

_WANTED = ("packages", "package_dir", "py_modules")
_DEFAULTS = {"name": "package", "version": "0.0.0"}


def main(folder: str) -> None:
    """Run the setup.py of a folder, and print the arguments."""
    told: dict[str, Any] = {}

    def setup(**arguments: Any) -> None:
        told.update({name: arguments[name] for name in _WANTED if name in arguments})

    def generate_distutils_setup(package_xml_path: str = "", **arguments: Any) -> dict[str, Any]:  # noqa: ARG001
        return _DEFAULTS | arguments

    for name in ("setuptools", "distutils.core"):
        vars(_module(name))["setup"] = setup
    _stand_in("catkin_pkg")
    vars(_stand_in("catkin_pkg.python_setup"))["generate_distutils_setup"] = (
        generate_distutils_setup
    )
    os.environ.setdefault("ROS_VERSION", "1")
    os.chdir(folder)
    sys.path.insert(0, folder)
    sys.argv[:] = ["setup.py"]
    printed, sys.stdout = sys.stdout, sys.stderr
    runpy.run_path("setup.py", run_name="__main__")
    json.dump(told, printed, default=list)


def _module(name: str) -> ModuleType:
    """Return a module for building packages, or a replacement where it is missing."""
    with suppress(ImportError):
        return import_module(name)
    for parent in (name.partition(".")[0], name):
        if parent not in sys.modules:
            _stand_in(parent)
    module = sys.modules[name]
    vars(module)["find_packages"] = vars(module)["find_namespace_packages"] = _find_packages
    return module


def _stand_in(name: str) -> ModuleType:
    module = ModuleType(name)
    module.__spec__ = ModuleSpec(name, None, is_package=True)
    module.__path__ = []
    vars(module)["__getattr__"] = lambda attribute: MagicMock(name=attribute)
    sys.modules[name] = module
    return module


def _find_packages(where: str = ".", *_: Any, **__: Any) -> list[str]:
    return sorted(file.parent.name for file in Path(where).glob("*/__init__.py"))


if __name__ == "__main__":
    main(sys.argv[1])
