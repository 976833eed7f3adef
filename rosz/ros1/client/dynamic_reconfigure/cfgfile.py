"""Running ``.cfg`` files, and building the modules that catkin would generate from them.

A file runs in this process as a main program of its own: its output goes to stderr, and its
``exit`` ends only the file.
"""

from __future__ import annotations

import builtins
import sys
from collections.abc import Sequence
from pathlib import Path
from traceback import walk_tb
from types import CodeType, ModuleType, TracebackType
from typing import NoReturn, TextIO

from rosz.errors import RoszError, SourceError
from rosz.reconfigure.messages import extract_params
from rosz.ros1.client.dynamic_reconfigure.parameter_generator_catkin import Generated, results
from rosz.ros1.python2 import explain, hint

_SUFFIX = "Config"


def run(path: Path) -> list[Generated]:
    """Run a file, and return its descriptions.

    Raises:
        SourceError: The file cannot be read, is not Python 3, fails, or describes nothing; the
            message names the line.
    """
    code = _compile(path)
    # site's own exit() would close the standard input of this process.
    tools = vars(builtins) | {"exit": _exit, "quit": _exit, "print": _print}
    names = {"__name__": "__main__", "__file__": str(path), "__builtins__": tools}
    described: list[Generated] = []
    token = results.set(described)
    before = list(sys.path)
    try:
        # A file may import modules beside it.
        sys.path.insert(0, str(path.resolve().parent))
        exec(code, names)  # noqa: S102  # the purpose of this function
    except SystemExit as error:
        if error.code not in {None, 0} or not described:
            reason = f"it exits with {error.code!r} before it has generated anything"
            raise SourceError(reason, str(path), _line(error.__traceback__, path)) from None
    except RoszError as error:
        raise SourceError(str(error), str(path), _line(error.__traceback__, path)) from error
    except Exception as error:
        reason = "; ".join(filter(None, (f"{type(error).__name__}: {error}", hint(error))))
        raise SourceError(reason, str(path), _line(error.__traceback__, path)) from error
    finally:
        sys.path[:] = before
        results.reset(token)
    if not described:
        reason = "it describes nothing; expected gen.generate(PACKAGE, NODE, NAME) at its end"
        raise SourceError(reason, str(path))
    return described


def load(module: str, files: Sequence[Path]) -> ModuleType:
    """Return the module that catkin would have generated.

    The file with the name of the module is tried first, but the name that a file passes to
    ``generate`` decides.

    Raises:
        SourceError: The file with the name of the module fails.
        ModuleNotFoundError: No file generates the module.
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
        for candidate in generated:
            if candidate.name == wanted:
                return build(module, path, candidate)
        others.append(
            f"{path} generates {', '.join(candidate.name + _SUFFIX for candidate in generated)}"
        )
    raise ModuleNotFoundError(f"no module named '{module}': {'; '.join(others)}", name=module)


def build(module: str, path: Path, generated: Generated) -> ModuleType:
    """Return the module of a full name for a description."""
    made = ModuleType(module, f"Made of {path}.")
    parameters = extract_params(generated.description)
    made.__dict__.update(
        __file__=str(path),
        extract_params=extract_params,
        inf=float("inf"),
        config_description=generated.description,
        all_level=0,
        **{
            key: {parameter["name"]: parameter[key] for parameter in parameters}
            for key in ("min", "max", "level", "type")
        },
        defaults={parameter["name"]: parameter["default"] for parameter in parameters},
        **{f"{generated.name}_{name}": value for name, value in generated.constants.items()},
    )
    for parameter in parameters:
        made.__dict__["all_level"] |= parameter["level"]
    return made


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


def _line(trace: TracebackType | None, path: Path) -> int:
    """Return the innermost line of a file in a traceback; 0 if there is none."""
    lines = [at for frame, at in walk_tb(trace) if frame.f_code.co_filename == str(path)]
    return lines[-1] if lines else 0


def _exit(code: object = None) -> NoReturn:
    raise SystemExit(code)


def _print(
    *words: object,
    sep: str | None = None,
    end: str | None = None,
    file: TextIO | None = None,
    **_flush: object,
) -> None:
    """Replace ``print``, because the output of a file must not mix with that of the program."""
    text = (" " if sep is None else sep).join(map(str, words))
    (file or sys.stderr).write(text + ("\n" if end is None else end))
