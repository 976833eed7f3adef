"""``python -m rosz.script --container NAME [OPTIONS] PROGRAM...``: several nodes, one process.

Each PROGRAM is a `rosz.program.ProgramSpec` as JSON. All programs share one session, and so the
graph, the parameters and the link to others. Each has a thread of its own, on which its script runs
as ``__main__`` with its own ``sys.argv``, and its own node of rospy or context of rclpy.

A program that ends leaves the others alone, unless it is required. One that is to be respawned runs
again in the same process: its publishers and other entities are closed by then. Its modules stay
loaded, and threads that it left behind go on with a node that is shut down.
"""

from __future__ import annotations

import builtins
import ctypes
import faulthandler
import io
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Any, TextIO

import msgspec

from rosz import names
from rosz.errors import RoszError
from rosz.node import Context, LocalDelivery, Node, handle_signals
from rosz.program import Program, ProgramSpec, current, separate_programs, within
from rosz.ros1.importer import install
from rosz.ros1.script import Script
from rosz.ros1.state import separate_states

_BY_REFERENCE = "--by-reference"
_NODE = "--node"
_SLICE = 0.5
"""Seconds between two looks at the shutdown, so that Python notices signals."""
# As in a launch: a script that fails at once must not keep the processor busy.
_MIN_RESPAWN = 0.1
# With the two times below, less than the 15 seconds after which a launch sends SIGTERM.
_HOOKS_TIMEOUT = 10.0
_RETURN_TIMEOUT = 1.0
"""Seconds that programs have to return after the shutdown, before they are interrupted."""
_END_TIMEOUT = 2.0
"""Seconds that they have after that."""
_EXIT_USAGE = 2


class Container:
    """The programs of one process.

    Args:
        name: Name of the container, for messages.
        specs: The programs.
        by_reference: Whether nodes of rospy pass on messages themselves rather than copies.
        node: Whether the container is a node of its name too, as a manager of nodelets is. The
            container ends with that node.

    Raises:
        TransportError: The session cannot be opened.
        UsageError: A variable of the environment has an invalid value.
    """

    def __init__(
        self,
        name: str,
        specs: Sequence[ProgramSpec],
        *,
        by_reference: bool = False,
        node: bool = False,
    ) -> None:
        self.name = name
        self._specs = specs
        separate_programs()
        separate_states()
        install()
        # Each program imports modules beside its script before those on sys.path.
        sys.meta_path.insert(sys.meta_path.index(PathFinder), _Siblings())
        self._context = Context()
        self._context.local_delivery = LocalDelivery(by_reference=by_reference)
        self._context.cooperative = True
        handle_signals(self._context)
        # Now, so that its threads belong to no program.
        self._context.params  # noqa: B018
        self._context.on_shutdown(self._end_programs)
        if node:
            own = Node(names.basename(name), namespace=names.namespace(name), context=self._context)
            own.on_shutdown(lambda _: self._begin_end())
        self._lock = threading.Lock()
        self._running: dict[str, tuple[threading.Thread, Program | None]] = {}
        self._folders: dict[str, str] = {}
        self._code = 0
        self._has_node = node

    def run(self) -> int:
        """Run the programs until all have ended, or the process is asked to end.

        Returns:
            The exit code: that of the first program that failed, or 0.
        """
        threading.excepthook = self._report_thread
        # A crash in C ends all nodes: the stack of its thread tells which one was at fault.
        faulthandler.enable(all_threads=False)
        sys.stdout, sys.stderr = _WholeLines(sys.stdout), _WholeLines(sys.stderr)
        for spec in self._specs:
            thread = threading.Thread(
                target=self._supervise, args=(spec,), name=f"rosz-program{spec.name}", daemon=True
            )
            self._running[spec.name] = thread, None
        for thread, _ in list(self._running.values()):
            thread.start()
        while not self._context.wait_for_shutdown(_SLICE):
            pass
        self._context.close()  # waits for the thread that does so
        self._await_programs()
        return self._code

    def _supervise(self, spec: ProgramSpec) -> None:
        """Run a program as often as it is to run, and end the container with it if need be."""
        starts, again = 0, True
        while again:
            code = self._run_once(spec)
            starts += 1
            limit = spec.respawn_max
            again = spec.respawn and (limit is None or starts <= limit)
            again = again and not self._context.wait_for_shutdown(
                max(spec.respawn_delay, _MIN_RESPAWN)
            )
            if again:
                self._say(f"[{spec.name}] restarting in container '{self.name}'")
        with self._lock:
            self._code = self._code or code
            del self._running[spec.name]
            over = not self._running and not self._has_node
        if spec.required and not self._context.is_shutdown:
            self._say(f"REQUIRED node '{spec.name}' has ended: container '{self.name}' ends")
        if over or spec.required:
            self._begin_end()

    def _begin_end(self) -> None:
        """End everything, on another thread: this one may be among those that the end waits for."""
        threading.Thread(target=self._context.close, name="rosz-container-end").start()

    def _run_once(self, spec: ProgramSpec) -> int:
        """Run a program to its end, and return its exit code."""
        program = Program(spec.name, [spec.script, *spec.arguments], self._context)
        with self._lock:
            self._running[spec.name] = threading.current_thread(), program
        script = None
        with within(program):
            try:
                script = Script(spec.script)
                program.folder = script.folder
                self._folders.setdefault(script.folder, spec.name)
                script.variables["__builtins__"] = _builtins(script.folder, self._folders)
                script.execute()
                _join(program)
                code, problem = 0, ""
            except SystemExit as error:
                _join(program)
                code, problem = _exit_code(error)
            except BaseException as error:  # noqa: BLE001  # the boundary of the user's program
                code, problem = self._failed(script, error)
        program.end()
        for stream in (sys.stdout, sys.stderr):
            stream.flush()  # the end of a line that it has not completed
        self._report_end(spec, code, problem)
        return code

    def _failed(self, script: Script | None, error: BaseException) -> tuple[int, str]:
        """Show an exception that a program did not catch; return its exit code and the reason."""
        if isinstance(error, KeyboardInterrupt) and self._context.is_shutdown:
            return 0, ""
        if script is not None:
            script.report(error)
        elif not isinstance(error, RoszError):
            # It cannot be compiled: a traceback would show nothing of it.
            sys.__excepthook__(type(error), error.with_traceback(None), None)
        return 1, f"{type(error).__name__}: {error}"

    def _report_end(self, spec: ProgramSpec, code: int, problem: str) -> None:
        if self._context.is_shutdown and not code:
            return
        what = f"node '{spec.name}' ({spec.script}) of container '{self.name}'"
        if code:
            reason = f": {problem}" if problem else ""
            self._say(f"ERROR: {what} has died, exit code {code}{reason}")
        else:
            self._say(f"{what} has finished cleanly")

    def _report_thread(self, args: threading.ExceptHookArgs) -> None:
        """Name the program of a thread that an exception has ended."""
        program = current()
        threading.__excepthook__(args)
        if program is not None and args.exc_type is not SystemExit:
            self._say(
                f"ERROR: a thread of node '{program.name}' of container '{self.name}' has died:"
                f" {args.exc_type.__name__}: {args.exc_value}"
            )

    def _end_programs(self, reason: str) -> None:
        """Shut the nodes of all programs down, at the same time."""
        with self._lock:
            programs = [program for _, program in self._running.values() if program is not None]
        threads = [
            threading.Thread(target=program.end, args=(reason,), daemon=True)
            for program in programs
        ]
        for thread in threads:
            thread.start()
        deadline = time.monotonic() + _HOOKS_TIMEOUT
        for thread in threads:
            thread.join(max(0.0, deadline - time.monotonic()))

    def _await_programs(self) -> None:
        """Wait until the programs return; interrupt those that do not ask for the shutdown."""
        for thread in self._left(_RETURN_TIMEOUT).values():
            _interrupt(thread)
        left = self._left(_END_TIMEOUT)
        frames = sys._current_frames()  # noqa: SLF001  # documented
        for name, thread in left.items():
            frame = frames.get(thread.ident or 0)
            where = f", it is at {frame.f_code.co_filename}:{frame.f_lineno}" if frame else ""
            self._say(f"node '{name}' of container '{self.name}' does not end{where}")

    def _left(self, seconds: float) -> dict[str, threading.Thread]:
        """Wait until all programs have ended, and return the threads of those that have not."""
        deadline = time.monotonic() + seconds
        with self._lock:
            threads = {name: thread for name, (thread, _) in self._running.items()}
        for thread in threads.values():
            thread.join(max(0.0, deadline - time.monotonic()))
        return {name: thread for name, thread in threads.items() if thread.is_alive()}

    @staticmethod
    def _say(line: str) -> None:
        sys.stderr.write(f"{line}\n")
        sys.stderr.flush()


class _WholeLines(io.TextIOBase):
    """A text stream that keeps the lines of several threads apart."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._local = threading.local()

    def write(self, text: str) -> int:
        """Write the lines that are complete; keep the rest until it is, or until `flush`."""
        waiting = getattr(self._local, "text", "") + text
        lines, newline, self._local.text = waiting.rpartition("\n")
        if newline:
            self._stream.write(lines + newline)
            self._stream.flush()
        return len(text)

    def flush(self) -> None:
        """Write the line that this thread has not completed."""
        waiting, self._local.text = getattr(self._local, "text", ""), ""
        if waiting:
            self._stream.write(waiting)
        self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def isatty(self) -> bool:
        return self._stream.isatty()

    def fileno(self) -> int:
        return self._stream.fileno()


def _join(program: Program) -> None:
    """Wait for the threads of a program as the interpreter does: for those that are no daemons."""
    for thread in list(program.threads):
        if not thread.daemon and thread is not threading.current_thread():
            thread.join()


def _interrupt(thread: threading.Thread) -> None:
    """Raise `KeyboardInterrupt` on a thread once it runs Python code."""
    ident = thread.ident
    if ident is not None and thread.is_alive():
        raised = ctypes.py_object(KeyboardInterrupt)
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(ident), raised)


def _exit_code(error: SystemExit) -> tuple[int, str]:
    """Return the exit code of ``sys.exit``, and its text if it has one."""
    code = error.code
    if code is None or isinstance(code, int):
        return code or 0, ""
    return 1, str(code)


class _Siblings(MetaPathFinder):
    """Finds the modules beside the script of the current program."""

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None = None,
        target: ModuleType | None = None,  # noqa: ARG002  # the signature of a finder
    ) -> ModuleSpec | None:
        program = current()
        if program is None or path is not None or not program.folder:
            return None
        return PathFinder.find_spec(fullname, [program.folder])


def _builtins(own: str, folders: Mapping[str, str]) -> dict[str, Any]:
    """Return builtins for a script whose ``import`` refuses modules of other scripts' folders.

    Modules are shared by all programs, so two scripts with different modules of one name beside
    them cannot both have theirs. The folders of all scripts have the name of a program of each.
    """
    beside = {path.stem for path in Path(own).iterdir() if path.suffix in {"", ".py"}}

    def import_module(name: str, *args: Any, **kwargs: Any) -> ModuleType:
        module = builtins.__import__(name, *args, **kwargs)
        top = name.partition(".")[0]
        if top in beside:
            file = Path(getattr(sys.modules.get(top), "__file__", None) or "")
            folder = file.parent.parent if file.name == "__init__.py" else file.parent
            other = folders.get(str(folder), "")
            if other and str(folder) != own:
                raise ImportError(
                    f"module '{top}' is '{file}' here, which node '{other}' of this container has"
                    f" imported, and not the one in '{own}': run one of the two in another process"
                )
        return module

    return {**vars(builtins), "__import__": import_module}


def main(argv: Sequence[str], begin: Callable[[], object] | None) -> int:
    """Run a container.

    Args:
        argv: Command line: name, options and programs.
        begin: Function to call right before signals are handled.

    Returns:
        The exit code.
    """
    words = [word for word in argv if word not in {_BY_REFERENCE, _NODE}]
    try:
        name, *texts = words
        if begin is not None:
            begin()
        specs = [msgspec.json.decode(text, type=ProgramSpec) for text in texts]
        container = Container(name, specs, by_reference=_BY_REFERENCE in argv, node=_NODE in argv)
    except (ValueError, msgspec.MsgspecError) as error:
        sys.stderr.write(f"ERROR: expected a name and programs as JSON: {error}\n")
        return _EXIT_USAGE
    except RoszError as error:
        sys.stderr.write(f"ERROR: {error}\n")
        return 1
    return container.run()
