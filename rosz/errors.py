"""The errors that rosz raises.

They have one root, so that ``except RoszError`` catches what rosz reports and nothing else::

    RoszError
    ├── UsageError                  a command or call was used wrongly (exit code 2)
    ├── InvalidName                 not a valid graph resource name (also ValueError)
    ├── SourceError                 an error in a text: path, line, column
    │   ├── DefinitionError         .msg, .srv
    │   ├── YamlError               YAML
    │   ├── LaunchFileError         launch XML, with the chain of includes
    │   └── PackageError            package.xml
    ├── NotFoundError               nothing has the requested name (also LookupError)
    │   ├── PackageNotFound
    │   ├── ExecutableNotFound
    │   ├── TypeNotFound            no such message or service type
    │   └── ParamNotFound           (also KeyError)
    ├── MessageError                a message does not fit its type (also ValueError)
    │   ├── EncodeError             a value does not fit its field
    │   └── DecodeError             received bytes are not a message of the type
    ├── TransportError              the session cannot open or communicate (also ConnectionError)
    │   ├── NoReplica               no process holds the parameter store
    │   └── PanicError              Zenoh panicked in an operation
    ├── ClosedError                 the object has been closed or shut down
    ├── TimeMovedBackwards          ROS time was set back during a sleep
    ├── WaitTimeout                 an event did not happen in time (also TimeoutError)
    ├── ServiceError                a service call failed
    │   └── ServiceNotFound
    ├── ActionError                 a goal was not reached, or nobody can say so
    │   ├── GoalRejected            the server did not take the goal
    │   ├── GoalFailed              the goal was aborted or canceled: status, result
    │   └── ServerSilent            the server does not answer: seconds
    ├── ParamError                  a parameter value or write is not allowed
    │   └── PartlyWritten           a write is not kept everywhere: holders, reasons, slow
    ├── StoreError                  a file of parameters cannot be used
    ├── BagError                    a bag cannot be read or written: path, offset
    │   └── BagUnindexed            a bag has no index
    ├── TransformError              a transform between two frames is not available
    │   ├── FrameNotFound           no such frame
    │   ├── FramesNotConnected      the frames belong to separate trees
    │   ├── ExtrapolationNeeded     the time is before or after all known transforms
    │   └── TransformArgument       not a valid frame or transform
    └── LaunchError                 a launch or a process in it failed

Texts are lower case, quote the wrong value, and say what was expected and what to do next.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

TYPE_CHECKING = False  # typing takes longer to import than everything else here
if TYPE_CHECKING:
    from typing import Any

__all__ = (
    "ActionError",
    "BagError",
    "BagUnindexed",
    "ClosedError",
    "DecodeError",
    "DefinitionError",
    "EncodeError",
    "ExecutableNotFound",
    "ExtrapolationNeeded",
    "FrameNotFound",
    "FramesNotConnected",
    "GoalFailed",
    "GoalRejected",
    "InvalidName",
    "LaunchError",
    "LaunchFileError",
    "MessageError",
    "NoReplica",
    "NotFoundError",
    "PackageError",
    "PackageNotFound",
    "PanicError",
    "ParamError",
    "ParamNotFound",
    "PartlyWritten",
    "RoszError",
    "ServerSilent",
    "ServiceError",
    "ServiceNotFound",
    "SourceError",
    "StoreError",
    "TimeMovedBackwards",
    "TransformArgument",
    "TransformError",
    "TransportError",
    "TypeNotFound",
    "UsageError",
    "WaitTimeout",
    "YamlError",
    "near_miss",
)

_SHOWN = 200
"""Characters of a name that an error shows, and of each end of a line."""


def near_miss(word: str, known: Iterable[str]) -> str:
    """Return a suggestion of the known word that is closest to a mistyped one.

    Args:
        word: The mistyped word.
        known: The valid words.

    Returns:
        ``"; did you mean 'x'?"``, or an empty string where no word is close.
    """
    from difflib import get_close_matches  # slow to load, and rarely needed

    close = get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f"; did you mean '{close[0]}'?" if close else ""


class RoszError(Exception):
    """Root of all errors that rosz raises."""


class UsageError(RoszError):
    """A command line or a call that is not valid; commands exit with code 2."""


class InvalidName(RoszError, ValueError):
    """A text that is not a valid graph resource name (ROS wiki, Names).

    Attributes:
        name: The text.
        reason: Reason why it is not valid.
    """

    def __init__(self, name: str, reason: str) -> None:
        self.name = name
        self.reason = reason
        shown = name if len(name) <= _SHOWN else f"{name[:_SHOWN]}…"
        super().__init__(f"'{shown}' is not a valid name: {reason}")


def _without_middle(line: str) -> str:
    """Return a line that does not repeat a value of many characters, such as one of a file."""
    return line if len(line) <= 3 * _SHOWN else f"{line[:_SHOWN]}…{line[-_SHOWN:]}"


class SourceError(RoszError):
    """An error in a text that a person wrote.

    Attributes:
        reason: Description of the error, what was expected, and what to do.
        path: Path of the file, or a name such as ``<string>``.
        line: Line, from 1; 0 if unknown.
        column: Column, from 1; 0 if unknown.
    """

    def __init__(self, reason: str, path: str = "<string>", line: int = 0, column: int = 0) -> None:
        self.reason: str = "\n".join(map(_without_middle, reason.split("\n")))
        self.path = path
        self.line = line
        self.column = column
        super().__init__(f"{self.place}: {self.reason}")

    @property
    def place(self) -> str:
        """``path:line:column``, as far as known."""
        if not self.line:
            return self.path
        return (
            f"{self.path}:{self.line}:{self.column}" if self.column else f"{self.path}:{self.line}"
        )


class DefinitionError(SourceError):
    """A definition that does not follow the grammar, or names an unknown type."""


class YamlError(SourceError):
    """A YAML text that cannot be read, or a value in it that is not allowed."""


class PackageError(SourceError):
    """A package.xml that cannot be read."""


class LaunchFileError(SourceError):
    """A launch file that cannot be read.

    Attributes:
        includes: Places of the ``<include>`` tags that led here, outermost first.
        plain_reason: The reason without these places.
    """

    def __init__(
        self,
        reason: str,
        path: str = "<string>",
        line: int = 0,
        column: int = 0,
        includes: tuple[str, ...] = (),
    ) -> None:
        self.includes = includes
        self.plain_reason = reason
        chain = "".join(f"\n  included from {place}" for place in reversed(includes))
        super().__init__(reason + chain, path, line, column)


class NotFoundError(RoszError, LookupError):
    """Nothing has the requested name."""


class PackageNotFound(NotFoundError):
    """No package on the package path has the requested name.

    Attributes:
        package: Name of the package.
    """

    def __init__(
        self, package: str, known: Iterable[str] = (), searched: Iterable[str] = ()
    ) -> None:
        self.package = package
        from rosz.replacements import instead_of  # rarely needed

        where = ", ".join(searched) or "nowhere: the package path is empty"
        instead = instead_of(package)
        hint = f"; rosz does not have it: {instead}" if instead else near_miss(package, known)
        hint = hint or (
            "; a package is a folder with a package.xml, below ROSZ_PACKAGE_PATH, ROS_PACKAGE_PATH"
            " or the 'src' of the workspace around the working folder"
        )
        super().__init__(f"package '{package}' not found (searched {where}){hint}")


class ExecutableNotFound(NotFoundError):
    """A package has no such executable, or the file is not executable."""


class TypeNotFound(NotFoundError):
    """No message or service type has the requested name.

    Attributes:
        type_name: Name of the type.
        reason: Why it is not known; empty if nothing is to be said.
    """

    def __init__(self, type_name: str, reason: str = "") -> None:
        self.type_name = type_name
        self.reason = reason
        super().__init__(f"type '{type_name}' is not known{': ' + reason if reason else ''}")


class ParamNotFound(NotFoundError, KeyError):
    """No parameter of the requested name is set.

    Attributes:
        name: Resolved name of the parameter.
    """

    def __init__(self, name: str, known: Iterable[str] = ()) -> None:
        self.name = name
        self._text = f"parameter '{name}' is not set{near_miss(name, known)}"
        super().__init__(self._text)

    def __str__(self) -> str:
        return self._text


class MessageError(RoszError, ValueError):
    """A message that does not fit its type."""


class EncodeError(MessageError):
    """A value that does not fit the type of its field.

    Attributes:
        type_name: Message type that is encoded.
        field: Path of the field, such as ``poses[3].position.x``.
        reason: Expected and given value.
    """

    def __init__(self, type_name: str, field: str, reason: str) -> None:
        self.type_name = type_name
        self.field = field
        self.reason = reason
        super().__init__(f"{type_name}{'.' + field if field else ''}: {reason}")


class DecodeError(MessageError):
    """Bytes that are not a valid message of the type.

    Attributes:
        type_name: Message type that is decoded.
        offset: Offset in bytes from the start of the payload, header included; -1 if unknown.
        reason: Expected and found bytes.
    """

    def __init__(self, type_name: str, offset: int, reason: str) -> None:
        self.type_name = type_name
        self.offset = offset
        self.reason = reason
        place = f" at byte {offset}" if offset >= 0 else ""
        super().__init__(f"{type_name}{place}: {reason}")


class TransportError(RoszError, ConnectionError):
    """The session cannot open, or cannot communicate."""


class NoReplica(TransportError):
    """No process on this network holds the parameter store."""


class PanicError(TransportError):
    """Zenoh panicked in an operation, which has not been performed."""


class ClosedError(RoszError):
    """The node, session, publisher or other object has been closed."""


class TimeMovedBackwards(RoszError):
    """ROS time was set back during a sleep, as by a simulation that restarts.

    Attributes:
        before: ROS time at the beginning of the sleep, in nanoseconds.
        after: ROS time that it was set back to, in nanoseconds.
    """

    def __init__(self, before: int, after: int) -> None:
        self.before = before
        self.after = after
        super().__init__(
            f"ROS time moved backwards by {(before - after) / 1e9:g} s during a sleep;"
            " sleep again, or use reset=True where a rate or timer should go on"
        )


class WaitTimeout(RoszError, TimeoutError):
    """An event did not happen in time.

    Attributes:
        what: Description of the event.
        seconds: Time limit in seconds.
    """

    def __init__(self, what: str, seconds: float, hint: str = "") -> None:
        self.what = what
        self.seconds = seconds
        super().__init__(f"no {what} within {seconds:g} s{'; ' + hint if hint else ''}")


class ServiceError(RoszError):
    """A service call failed; the text is the server's, or says why there was no response."""


class ServiceNotFound(ServiceError):
    """No node serves a service of the requested name."""


class ActionError(RoszError):
    """A goal of an action was not reached, or it is not known what became of it."""


class GoalRejected(ActionError):
    """The server of an action did not accept a goal."""


class GoalFailed(ActionError):
    """A goal of an action was aborted or canceled.

    Attributes:
        status: Final status of the goal.
        result: Result that the server sent.
    """

    def __init__(self, text: str, status: int, result: Any) -> None:
        self.status = status
        self.result = result
        super().__init__(text)


class ServerSilent(ActionError):
    """The server of an action does not answer; its goals may go on, and are followed.

    Attributes:
        action: Full name of the action.
        seconds: Seconds since the server answered last.
    """

    def __init__(self, action: str, seconds: float) -> None:
        self.action = action
        self.seconds = seconds
        super().__init__(
            f"the server of action '{action}' has not answered for {seconds:.1f} s; the goal may"
            " go on: wait again, or cancel it"
        )


class ParamError(RoszError):
    """A parameter value or write that is not allowed."""


class PartlyWritten(ParamError):
    """A write that stands, but that some processes refuse or cannot store.

    It is not undone: what others wrote meanwhile may build on it.

    Attributes:
        what: The parameters, as shown to users.
        holders: Number of other processes that acknowledged it.
        reasons: Reason of each process that does not keep it, as shown to users.
        slow: Processes that did not answer in time, as shown to users.
    """

    def __init__(
        self, what: str, holders: int, reasons: Mapping[str, str], slow: Iterable[str] = ()
    ) -> None:
        self.what: str = what
        self.holders: int = holders
        self.reasons: dict[str, str] = dict(reasons)
        self.slow: tuple[str, ...] = tuple(slow)
        where = "; ".join(f"not kept at {who}: {why}" for who, why in sorted(reasons.items()))
        super().__init__(f"{what} is written, but {where}")


class StoreError(RoszError):
    """A file of parameters that is damaged, in use, or cannot be read or written."""


class BagError(RoszError):
    """A bag that is damaged, or cannot be read or written.

    Attributes:
        reason: Description of the error, what was expected, and what to do.
        path: Path of the bag.
        offset: Offset in bytes from the start of the file; -1 if unknown.
    """

    def __init__(self, reason: str, path: str, offset: int = -1) -> None:
        self.reason = reason
        self.path = path
        self.offset = offset
        place = f" at byte {offset}" if offset >= 0 else ""
        super().__init__(f"{path}{place}: {reason}")


class BagUnindexed(BagError):
    """A bag without an index, as a recorder leaves it that was killed."""


class TransformError(RoszError):
    """A transform between two coordinate frames is not available."""


class FrameNotFound(TransformError):
    """No known transform has a frame of the requested name."""


class FramesNotConnected(TransformError):
    """Two frames that belong to separate trees."""


class ExtrapolationNeeded(TransformError):
    """A transform at a time before or after all known transforms."""


class TransformArgument(TransformError):
    """An argument that is not a valid frame name or transform."""


class LaunchError(RoszError):
    """A launch, or a process in it, failed."""
