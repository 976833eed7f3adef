"""Finds the Python modules of a package by its setup.py.

catkin runs each setup.py when it builds a workspace. Nothing is built here: a setup.py is read
without running it where its values are plain, and runs in a process of its own where they are not.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeAlias

import msgspec

_SETUP = "setup.py"
_PROBE = Path(__file__).with_name("setup_probe.py")
_TIMEOUT = 20.0
"""Seconds that a setup.py may run."""
_BUILT = re.compile(r"^[^#\n]*\bcatkin_python_setup\s*\(", re.MULTILINE)
_WANTED = frozenset({"packages", "package_dir", "py_modules"})
_FINDERS = frozenset({"find_packages", "find_namespace_packages"})

_Folders: TypeAlias = list[tuple[str, list[str]]]
"""Folders of which all packages are offered, each with patterns of names that are not."""


def read_setup(folder: Path) -> tuple[dict[str, str], _Folders]:
    """Read the setup.py of a package; nothing is offered by one that fails.

    Args:
        folder: Folder of the package.

    Returns:
        Folders and files of modules by name, and folders of which all packages are offered.
    """
    try:
        tree = ast.parse((folder / _SETUP).read_bytes())
    except (OSError, SyntaxError, ValueError):
        return {}, []
    reader = _Reader()
    try:
        told = reader.read(tree)
    except _NotPlainError:
        told = _run(folder)
    return _locate(folder, told, reader.found)


def _locate(folder: Path, told: dict[str, Any], whole: _Folders) -> tuple[dict[str, str], _Folders]:
    """Return where modules are, by the rules of distutils."""
    places = {str(key): str(value) for key, value in (told.get("package_dir") or {}).items()}
    top = folder / places.get("", ".")

    def path_of(name: str) -> Path:
        return folder / places[name] if name in places else top / name

    packages = {str(name).partition(".")[0] for name in told.get("packages") or ()}
    files = {str(name).partition(".") for name in told.get("py_modules") or ()}
    modules = {name: str(path_of(name)) for name in packages}
    for name, dot, _ in files:
        modules.setdefault(name, str(top / name) if dot else f"{top / name}.py")
    return modules, [(str(folder / where), excluded) for where, excluded in whole]


def _run(folder: Path) -> dict[str, Any]:
    """Run a setup.py, if catkin would, and return the arguments of ``setup()``."""
    cmake = folder / "CMakeLists.txt"
    if cmake.is_file() and not _BUILT.search(cmake.read_text("utf-8", "replace")):
        return {}
    try:
        done = subprocess.run(
            # -I: no finder of rosz, which would look for modules here again.
            [sys.executable, "-I", "-B", str(_PROBE), str(folder)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_TIMEOUT,
            check=True,
        )
        told: dict[str, Any] = msgspec.json.decode(done.stdout, type=dict[str, Any])
    except (OSError, subprocess.SubprocessError, msgspec.DecodeError):
        return {}  # 'rosz pkg check' reports it
    return told


class _NotPlainError(Exception):
    """A value can be known only by running the file."""


class _Reader:
    """Reads the arguments of ``setup()`` in the syntax tree of a setup.py."""

    def __init__(self) -> None:
        self._names: dict[str, Any] = {}
        self.found: _Folders = []

    def read(self, tree: ast.Module) -> dict[str, Any]:
        """Return the arguments about modules.

        Raises:
            _NotPlainError: The file has to be run.
        """
        for statement in tree.body:
            match statement:
                case ast.Assign(targets=[ast.Name(id=name)], value=value):
                    self._names.pop(name, None)
                    with suppress(_NotPlainError):
                        self._names[name] = self._value(value)
                case ast.Assign(
                    targets=[ast.Subscript(ast.Name(name), ast.Constant(key))], value=value
                ) if isinstance(self._names.get(name), dict):
                    try:
                        self._names[name][key] = self._value(value)
                    except _NotPlainError:
                        if key in _WANTED:
                            del self._names[name]
                case ast.Expr(value=ast.Call() as call) if _called(call) == "setup":
                    return self._arguments(call)
                case (
                    ast.Import()
                    | ast.ImportFrom()
                    | ast.FunctionDef()
                    | ast.ClassDef()
                    | ast.Expr(value=ast.Constant())
                ):
                    pass
                case _:
                    self._forget(statement)
        raise _NotPlainError

    def _forget(self, statement: ast.stmt) -> None:
        """Forget the names in a statement, which may change their values."""
        for node in ast.walk(statement):
            if isinstance(node, ast.Name):
                self._names.pop(node.id, None)
            elif isinstance(node, ast.Call) and _called(node) == "setup":
                raise _NotPlainError

    def _arguments(self, call: ast.Call) -> dict[str, Any]:
        """Return the wanted ones of the named arguments of a call."""
        told: dict[str, Any] = {}
        for keyword in call.keywords:
            if keyword.arg is None:
                more = self._value(keyword.value)
                if not isinstance(more, dict):
                    raise _NotPlainError
                told.update(more)
            elif keyword.arg in _WANTED:
                told[keyword.arg] = self._value(keyword.value)
        return told

    def _value(self, node: ast.expr) -> Any:
        match node:
            case ast.Constant(value=value):
                return value
            case ast.Name(id=name) if name in self._names:
                return self._names[name]
            case ast.List(elts=items) | ast.Tuple(elts=items) | ast.Set(elts=items):
                return [self._value(item) for item in items]
            case ast.Dict(keys=keys, values=values):
                return self._dict(keys, values)
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                first, second = self._value(left), self._value(right)
                if type(first) is type(second) and isinstance(first, str | list):
                    return first + second
            case ast.Call():
                return self._call(node)
        raise _NotPlainError

    def _call(self, call: ast.Call) -> Any:
        if _called(call) in {"generate_distutils_setup", "dict"} and not call.args:
            return self._arguments(call)
        if _called(call) not in _FINDERS:
            raise _NotPlainError
        self._find(call)
        return []

    def _dict(self, keys: list[ast.expr | None], values: list[ast.expr]) -> dict[str, Any]:
        """Return a dict without the values that are not plain and not needed."""
        plain: dict[str, Any] = {}
        for key, value in zip(keys, values, strict=True):
            if key is None:
                raise _NotPlainError
            name = self._value(key)
            try:
                plain[name] = self._value(value)
            except _NotPlainError:
                if name in _WANTED:
                    raise
        return plain

    def _find(self, call: ast.Call) -> None:
        """Note the folder of ``find_packages``, whose packages are looked up when needed."""
        names = ("where", "exclude")
        given = dict(zip(names, call.args, strict=False))
        given |= {keyword.arg or "": keyword.value for keyword in call.keywords}
        if not given.keys() <= {*names}:
            raise _NotPlainError
        values = {name: self._value(value) for name, value in given.items()}
        where, exclude = values.get("where", "."), values.get("exclude", [])
        if not isinstance(where, str) or not isinstance(exclude, list):
            raise _NotPlainError
        self.found.append((where, [str(pattern) for pattern in exclude]))


def _called(call: ast.Call) -> str:
    """Return the last part of the name of a function that is called."""
    if isinstance(call.func, ast.Attribute):
        return call.func.attr
    return call.func.id if isinstance(call.func, ast.Name) else ""
