"""Runs ``.cfg`` files, and makes of each the module that catkin would have generated from it.

A file runs in this process, as a main program of its own: what it prints goes to stderr, and its
``exit`` ends nothing but itself.
"""

from __future__ import annotations

import builtins
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, ModuleType, TracebackType
from typing import Any, NoReturn, TextIO

from rosz.errors import RoszError, SourceError
from rosz.reconfigure import Description, Group, Setting
from rosz.ros1.dynamic_reconfigure.encoding import extract_params
from rosz.ros1.dynamic_reconfigure.parameter_generator_catkin import Generated, results
from rosz.ros1.python2 import explain, hint

__all__ = ("build", "describe", "load", "run")

_SUFFIX = "Config"


def run(path: Path) -> list[Generated]:
    """Run a file, and return what it describes.

    Args:
        path: The file.

    Raises:
        SourceError: It cannot be read, is no Python 3, fails, or describes nothing; the message
            names the line.
    """
    code = _compile(path)
    # site's own exit() would close the standard input of this process.
    tools = vars(builtins) | {"exit": _exit, "quit": _exit, "print": _tell}
    names = {"__name__": "__main__", "__file__": str(path), "__builtins__": tools}
    found: list[Generated] = []
    token = results.set(found)
    try:
        with _folder_first(path):
            exec(code, names)  # noqa: S102  # what it is for
    except SystemExit as error:
        if error.code not in {None, 0} or not found:
            reason = f"it exits with {error.code!r} before it has generated anything"
            raise SourceError(reason, str(path), _line(error.__traceback__, path)) from None
    except RoszError as error:
        raise SourceError(str(error), str(path), _line(error.__traceback__, path)) from error
    except Exception as error:
        reason = "; ".join(filter(None, (f"{type(error).__name__}: {error}", hint(error))))
        raise SourceError(reason, str(path), _line(error.__traceback__, path)) from error
    finally:
        results.reset(token)
    if not found:
        reason = "it describes nothing; expected gen.generate(PACKAGE, NODE, NAME) at its end"
        raise SourceError(reason, str(path))
    return found


def load(module: str, files: Sequence[Path]) -> ModuleType:
    """Return the module that catkin would have generated.

    Args:
        module: Its full name, ``my_pkg.cfg.TutorialsConfig``.
        files: The files of the package. The one called as the module is tried first; what a file
            passes to ``generate`` is what counts.

    Raises:
        SourceError: The file of that name fails.
        ModuleNotFoundError: None of the files is it.
    """
    wanted = module.rpartition(".")[2].removesuffix(_SUFFIX)
    others: list[str] = []
    for path in sorted(files, key=lambda file: file.stem != wanted):
        try:
            generated = run(path)
        except SourceError as error:
            if path.stem == wanted:
                raise
            others.append(str(error))
            continue
        for one in generated:
            if one.name == wanted:
                return build(module, path, one)
        others.append(f"{path} generates {', '.join(one.name + _SUFFIX for one in generated)}")
    raise ModuleNotFoundError(f"no module named '{module}': {'; '.join(others)}", name=module)


def build(module: str, path: Path, generated: Generated) -> ModuleType:
    """Return the module of what a file describes.

    Args:
        module: Its full name.
        path: The file.
        generated: What it describes.
    """
    made = ModuleType(module, f"Made of {path}.")
    parameters = extract_params(generated.description)
    made.__dict__.update(
        __file__=str(path),
        extract_params=extract_params,
        inf=float("inf"),
        config_description=generated.description,
        all_level=0,
        **{
            column: {one["name"]: one[key] for one in parameters}
            for column, key in (
                ("min", "min"),
                ("max", "max"),
                ("defaults", "default"),
                ("level", "level"),
                ("type", "type"),
            )
        },
        **{f"{generated.name}_{name}": value for name, value in generated.constants.items()},
    )
    for one in parameters:
        made.__dict__["all_level"] |= one["level"]
    return made


def describe(config_description: dict[str, Any]) -> Description:
    """Return the description that a generated module has.

    Args:
        config_description: The root group, as generated modules have it.

    Raises:
        ParamError: It contradicts itself.
    """
    return Description(root=_group(config_description))


def _group(given: dict[str, Any]) -> Group:
    return Group(
        name=given["name"],
        settings=tuple(_setting(one) for one in given["parameters"]),
        groups=tuple(_group(one) for one in given["groups"]),
        type=given["type"],
        state=bool(given.get("state", True)),
        id=given["id"],
    )


def _setting(given: dict[str, Any]) -> Setting:
    return Setting(
        name=given["name"],
        default=given["default"],
        description=given["description"],
        level=given["level"],
        min=given["min"],
        max=given["max"],
        edit_method=given["edit_method"],
        kind=given["type"],
    )


def _compile(path: Path) -> CodeType:
    try:
        return compile(path.read_bytes(), str(path), "exec", dont_inherit=True)
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror}", str(path)) from error
    except SyntaxError as error:
        plain = explain(error, str(path))
        raise (
            plain or SourceError(error.msg, str(path), error.lineno or 0, error.offset or 0)
        ) from error
    except ValueError as error:  # null bytes
        raise SourceError(str(error), str(path)) from error


@contextmanager
def _folder_first(path: Path) -> Iterator[None]:
    """Let a file import what lies beside it, as a program can; what it adds itself goes with it."""
    before = list(sys.path)
    sys.path.insert(0, str(path.resolve().parent))
    try:
        yield
    finally:
        sys.path[:] = before


def _line(trace: TracebackType | None, path: Path) -> int:
    """Return the innermost line of a file that an exception passed through; 0 if none."""
    line = 0
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(path):
            line = trace.tb_lineno
        trace = trace.tb_next
    return line


def _exit(code: object = None) -> NoReturn:
    raise SystemExit(code)


def _tell(
    *words: object,
    sep: str | None = None,
    end: str | None = None,
    file: TextIO | None = None,
    **_flush: object,
) -> None:
    """Stand in for ``print``: what a file says must not get among a program's output."""
    text = (" " if sep is None else sep).join(map(str, words))
    (file or sys.stderr).write(text + ("\n" if end is None else end))
