"""Running a Python script as the interpreter itself would, in a process that knows ROS 1's names.

The script is ``__main__``: its arguments, its folder in front of the module path, its tracebacks
without a trace of rosz, its exit code.
"""

from __future__ import annotations

import builtins
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType, TracebackType

from rosz.errors import NotFoundError, RoszError
from rosz.ros1.python2 import explain, hint

__all__ = ("Script",)

_Hook = Callable[[type[BaseException], BaseException, TracebackType | None], object]


class Script:
    """A script, read and compiled.

    Args:
        path: The script.

    Raises:
        NotFoundError: It cannot be read.
        SourceError: It is written in Python 2.
        SyntaxError: It is not Python.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        self._file = Path(path).absolute()
        self._main = ModuleType("__main__")
        self._main.__dict__.update(
            __file__=str(self._file),
            __builtins__=builtins,
            __cached__=None,
            __loader__=SourceFileLoader("__main__", str(self._file)),
        )
        if "__annotations__" in vars(sys.modules["__main__"]):  # up to Python 3.13
            self._main.__annotations__ = {}
        with _shown_without_rosz(self._main):
            self._code = _compile(self._file)

    def run(self, arguments: Sequence[str]) -> None:
        """Run it as the main module of this process; it may raise or exit as it likes.

        Args:
            arguments: What it finds behind its name in ``sys.argv``.
        """
        sys.argv[:] = [self._path, *arguments]
        folder = str(self._file.resolve().parent)
        if sys.flags.safe_path:
            sys.path.insert(0, folder)
        else:
            sys.path[0] = folder
        sys.modules["__main__"] = self._main
        with _shown_without_rosz(self._main):
            exec(self._code, self._main.__dict__)  # noqa: S102  # the user's own program


def _compile(file: Path) -> CodeType:
    try:
        source = file.read_bytes()
    except OSError as error:
        raise NotFoundError(f"cannot run '{file}': {error.strerror}") from error
    try:
        return compile(source, str(file), "exec", dont_inherit=True)
    except SyntaxError as error:
        plain = explain(error, str(file))
        if plain is None:
            raise
        raise plain from None


@contextmanager
def _shown_without_rosz(main: ModuleType) -> Iterator[None]:
    """Have an exception that nobody catches shown from the script's first line on."""
    try:
        yield
    except BaseException:
        sys.excepthook = _trimming(sys.excepthook, main)
        raise


def _trimming(show: _Hook, main: ModuleType) -> _Hook:
    """Return a hook that shows an uncaught exception from the script's first line on."""

    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        while trace is not None and trace.tb_frame.f_globals is not main.__dict__:
            trace = trace.tb_next
        if isinstance(error, KeyboardInterrupt) and _is_importing(trace, main):
            return  # Ctrl-C while modules load: where it hit tells nobody anything
        if isinstance(error, RoszError):
            # It says all there is to say but where the script stood.
            sys.stderr.write(f"rosz: {_place(trace, main)}{error}\n")
            return
        show(kind, error.with_traceback(trace), trace)
        advice = hint(error)
        if advice:
            sys.stderr.write(f"rosz: {advice}\n")

    return hook


def _is_importing(trace: TracebackType | None, main: ModuleType) -> bool:
    """Tell whether a module was being looked for, or begun, other than the script."""
    while trace is not None:
        code = trace.tb_frame.f_code
        if code.co_filename.startswith("<frozen importlib"):
            return True
        if code.co_name == "<module>" and trace.tb_frame.f_globals is not main.__dict__:
            return True
        trace = trace.tb_next
    return False


def _place(trace: TracebackType | None, main: ModuleType) -> str:
    """Return ``file:line: `` of the innermost frame that is of the script itself."""
    place = ""
    while trace is not None:
        if trace.tb_frame.f_globals is main.__dict__:
            place = f"{trace.tb_frame.f_code.co_filename}:{trace.tb_lineno}: "
        trace = trace.tb_next
    return place
