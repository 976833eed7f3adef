"""Runs the tests of one file, on the interpreter of either side.

``python unit.py FILE RESULTS`` writes one line of JSON for each test: its name, ``passed``,
``failed`` or ``skipped``, and the traceback. Test cases of unittest are run, and so are functions
whose names begin with ``test``, as nose does.
"""

from __future__ import annotations

import inspect
import json
import os
import sys
import unittest
from collections.abc import Iterator
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import IO, Any


class _Result(unittest.TestResult):
    def __init__(self, out: IO[str]) -> None:
        super().__init__()
        self._out = out

    def _put(self, test: Any, outcome: str, text: str = "") -> None:
        name = test.id() if hasattr(test, "id") else str(test)
        self._out.write(json.dumps([name, outcome, text]) + "\n")
        self._out.flush()

    def addSuccess(self, test: Any) -> None:  # noqa: N802  # unittest's
        self._put(test, "passed")

    def addError(self, test: Any, err: Any) -> None:  # noqa: N802
        self._put(test, "failed", self._exc_info_to_string(err, test))  # type: ignore[attr-defined]

    def addFailure(self, test: Any, err: Any) -> None:  # noqa: N802
        self._put(test, "failed", self._exc_info_to_string(err, test))  # type: ignore[attr-defined]

    def addSkip(self, test: Any, reason: str) -> None:  # noqa: N802
        self._put(test, "skipped", reason)

    def addExpectedFailure(self, test: Any, err: Any) -> None:  # noqa: ARG002, N802
        self._put(test, "passed")

    def addUnexpectedSuccess(self, test: Any) -> None:  # noqa: N802
        self._put(test, "failed", "it was expected to fail")


def _load(path: Path) -> ModuleType:
    """Import the file; as a submodule if its folder is a Python package."""
    root, name = path.parent, path.stem
    while (root / "__init__.py").exists():
        root, name = root.parent, f"{root.name}.{name}"
    sys.path.insert(0, str(root))
    if "." in name:
        if name.partition(".")[0] == "test":  # the interpreter has a package of this name
            sys.modules.pop("test", None)
        return import_module(name)
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def _tests(module: ModuleType) -> Iterator[Any]:
    yield unittest.defaultTestLoader.loadTestsFromModule(module)
    set_up, tear_down = (getattr(module, name, None) for name in ("setup", "teardown"))
    for name, value in vars(module).items():
        if not name.startswith("test") or not inspect.isfunction(value):
            continue
        if not inspect.signature(value).parameters and value.__module__ == module.__name__:
            yield unittest.FunctionTestCase(value, set_up, tear_down, f"{module.__name__}.{name}")


def main(file: str, results: str) -> None:
    """Run the tests of a file."""
    # The name of the function, in place of that of the class.
    setattr(unittest.FunctionTestCase, "id", unittest.FunctionTestCase.shortDescription)  # noqa: B010
    sys.argv = [file]
    with open(results, "w", encoding="utf-8") as out:  # noqa: PTH123
        result = _Result(out)
        for test in _tests(_load(Path(file).absolute())):
            test.run(result)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)  # threads of a test may still run


if __name__ == "__main__":
    main(*sys.argv[1:])
