"""Runs a Python script as the interpreter does, with ROS 1's names importable.

The script is ``__main__``, has its own ``sys.argv`` and exit code, and its folder is first on
``sys.path``. Its tracebacks do not show rosz.
"""

from __future__ import annotations

import builtins
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from pathlib import Path
from traceback import walk_tb
from types import CodeType, ModuleType, TracebackType

from rosz.errors import NotFoundError, RoszError
from rosz.ros1.python2 import explain, hint

_Hook = Callable[[type[BaseException], BaseException, TracebackType | None], object]


class Script:
    """A compiled script.

    Args:
        path: Path of the script, or of a module with a function to call: ``demo/talker.py:main``.

    Raises:
        NotFoundError: The file cannot be read.
        SourceError: The script is Python 2.
        SyntaxError: The script is not valid Python.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        self._file = Path(path).absolute()
        self._folder = self._file.resolve().parent
        entry = None if self._file.exists() else _entry(self._file)
        if entry is not None:
            self._folder, source = entry
        self._main = ModuleType("__main__")
        self._main.__dict__.update(
            __file__=str(self._file),
            __builtins__=builtins,
            __cached__=None,
            __loader__=SourceFileLoader("__main__", str(self._file)),
        )
        if "__annotations__" in vars(sys.modules["__main__"]):  # up to Python 3.13
            self._main.__annotations__ = {}
        with _trimmed_tracebacks(self._main):
            if entry is None:
                self._code = _compile(self._file)
            else:
                self._code = compile(source, str(self._file), "exec", dont_inherit=True)

    @property
    def folder(self) -> str:
        """The folder that its modules are imported from first."""
        return str(self._folder)

    @property
    def variables(self) -> dict[str, object]:
        """The variables of the script as a module."""
        return self._main.__dict__

    def execute(self) -> None:
        """Run the script and leave the process as it is; whatever it raises is passed on."""
        exec(self._code, self._main.__dict__)  # noqa: S102  # the user's own program

    def report(self, error: BaseException) -> None:
        """Show an exception of `execute` as the interpreter shows an uncaught one."""
        _excepthook(sys.__excepthook__, self._main)(type(error), error, error.__traceback__)

    def run(self, arguments: Sequence[str]) -> None:
        """Run the script as the main module of this process; whatever it raises is passed on."""
        sys.argv[:] = [self._path, *arguments]
        folder = str(self._folder)
        if sys.flags.safe_path:
            sys.path.insert(0, folder)
        else:
            sys.path[0] = folder
        sys.modules["__main__"] = self._main
        with _trimmed_tracebacks(self._main):
            self.execute()


def _entry(path: Path) -> tuple[Path, str] | None:
    """Return the folder to import from and the source that calls an entry point, if it is one."""
    name, _, function = path.name.partition(":")
    module = path.resolve().with_name(name)
    if not function or not module.is_file():
        return None
    folder, names = module.parent, [module.stem] if module.stem != "__init__" else []
    while (folder / "__init__.py").is_file():
        folder, names = folder.parent, [folder.name, *names]
    first = function.partition(".")[0]
    dotted = ".".join(names)
    return folder, f"import sys\nfrom {dotted} import {first}\nsys.exit({function}())\n"


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
def _trimmed_tracebacks(main: ModuleType) -> Iterator[None]:
    """Show an uncaught exception without the frames before the script."""
    try:
        yield
    except BaseException:
        sys.excepthook = _excepthook(sys.excepthook, main)
        raise


def _excepthook(show: _Hook, main: ModuleType) -> _Hook:
    """Return an ``excepthook`` that removes the frames before the script."""

    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        while trace is not None and trace.tb_frame.f_globals is not main.__dict__:
            trace = trace.tb_next
        if isinstance(error, KeyboardInterrupt) and _is_importing(trace, main):
            return  # Ctrl-C during an import, where a traceback does not help
        if isinstance(error, RoszError):
            # Its text needs no traceback, only the place in the script.
            sys.stderr.write(f"ERROR: {_place(trace, main)}{error}\n")
            return
        show(kind, error.with_traceback(trace), trace)
        advice = hint(error) or _opencv_hint(error)
        if advice:
            sys.stderr.write(f"ERROR: {advice}\n")

    return hook


def _opencv_hint(error: BaseException) -> str:
    """Return the extra with the OpenCV that fits this machine; empty for other errors."""
    if type(error).__module__ == "cv2" and "Rebuild the library" in str(error):
        have, want = "-headless", "vision"
    elif (
        isinstance(error, ImportError)
        and "libGL.so" in str(error)
        and any("cv2" in frame.f_code.co_filename for frame, _ in walk_tb(error.__traceback__))
    ):
        have, want = "", "vision-headless"
    else:
        return ""
    return (
        f"opencv-python{have} does not fit this machine; run: pip uninstall -y opencv-python{have}"
        f" && pip install 'rosz[{want}]'"
    )


def _is_importing(trace: TracebackType | None, main: ModuleType) -> bool:
    """Return whether another module than the script was being imported."""
    return any(
        frame.f_code.co_filename.startswith("<frozen importlib")
        or (frame.f_code.co_name == "<module>" and frame.f_globals is not main.__dict__)
        for frame, _ in walk_tb(trace)
    )


def _place(trace: TracebackType | None, main: ModuleType) -> str:
    """Return ``file:line: `` of the innermost frame of the script."""
    place = ""
    for frame, line in walk_tb(trace):
        if frame.f_globals is main.__dict__:
            place = f"{frame.f_code.co_filename}:{line}: "
    return place
