"""Makes ROS 1's names importable in scripts that are run directly: ``./talker.py``.

Python imports a module of this name when it starts. It only adds a finder at the end: rosz is
loaded when a module is imported that no other finder has. If the interpreter does not have rosz,
such a module stays unknown.
"""

# Only what Python has loaded by now, as Ctrl-C may come during an import: not even __future__.
import _signal as signal  # type: ignore[import-not-found]  # it has no stubs
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from importlib.machinery import ModuleSpec
    from types import FrameType, ModuleType


class _Silence:
    """A context in which Ctrl-C ends the process at once, without a traceback.

    Python calls it a fatal error if this module fails.
    """

    def __enter__(self) -> None:
        """Replace Python's own handler, unless there is another one."""
        self._set(signal.default_int_handler, signal.SIG_DFL)

    def __exit__(self, *_: object) -> None:
        """Set it again."""
        self._set(signal.SIG_DFL, signal.default_int_handler)

    def _set(self, before: object, after: object) -> None:
        if signal.getsignal(signal.SIGINT) is before:
            try:
                signal.signal(signal.SIGINT, after)
            except ValueError:  # not the main thread
                return


_silence = _Silence()
_silence.__enter__()
_NEEDED = sys.stdlib_module_names | {"msgspec", "rosz", "yaml", "zenoh"}
"""Modules that rosz itself needs."""


class _Last:
    def find_spec(
        self, fullname: str, path: "Sequence[str] | None", target: "ModuleType | None" = None
    ) -> "ModuleSpec | None":
        """Install rosz's finders, and find the module with them.

        Do nothing while a module that rosz needs is being loaded: such a module tries to import
        modules of other systems (``_wmi``, ``msvcrt``), and rosz cannot load before it is complete.
        """
        if path is not None or not _NEEDED.isdisjoint(_loading()):
            return None
        sys.meta_path.remove(self)
        before = len(sys.meta_path)
        try:
            with _Silence():
                from rosz.interrupts import InterruptDeferral
            with InterruptDeferral():
                from rosz.ros1.importer import install

                install()
        except ImportError:
            return None
        added = [*sys.meta_path[: len(sys.meta_path) - before], *sys.meta_path[-1:]]
        specs = (finder.find_spec(fullname, path, target) for finder in added)
        return next((spec for spec in specs if spec is not None), None)


def _loading() -> "Iterator[str]":
    """Yield the packages that this thread is loading."""
    frame: FrameType | None = sys._getframe()  # noqa: SLF001  # the public ways load modules
    while frame is not None:
        if frame.f_code.co_name == "<module>":
            yield str(frame.f_globals.get("__name__", "")).partition(".")[0]
        frame = frame.f_back


def _run_next() -> None:
    """Run the ``sitecustomize`` that Python would find without this one."""
    from importlib.machinery import PathFinder
    from os.path import realpath, split

    done = {*_done, realpath(split(__file__)[0])}
    others = [folder for folder in sys.path if realpath(folder) not in done]
    spec = PathFinder.find_spec("sitecustomize", others)
    if spec is not None and spec.loader is not None:
        module = type(sys)("sitecustomize")
        module.__file__, module.__spec__ = spec.origin, spec
        vars(module)["_done"] = done
        spec.loader.exec_module(module)


_done: "set[str]" = globals().get("_done", set())
"""Folders whose ``sitecustomize`` has run this one: those of other installations of rosz."""

try:
    if not _done:
        sys.meta_path.append(_Last())
    _run_next()
finally:
    _started = " ".join(sys.orig_argv[1:4])
    # A command wants it so from its start.
    if _started != "-P -m rosz" and not _started.partition(" ")[0].endswith("/bin/rosz"):
        _silence.__exit__()
