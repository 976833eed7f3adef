"""Every error that rosz raises on purpose.

One root, so that ``except RoszError`` catches all that rosz reports and nothing else::

    RoszError
    ├── UsageError                  a command or call was used wrongly (exit code 2)
    ├── InvalidName                 no valid graph resource name (also ValueError)
    ├── SourceError                 something in a file: path, line, column
    │   ├── DefinitionError         .msg, .srv
    │   ├── YamlError               YAML
    │   ├── LaunchFileError         launch XML, with the chain of includes
    │   └── PackageError            package.xml
    ├── NotFoundError               a thing that was asked for by name (also LookupError)
    │   ├── PackageNotFound
    │   ├── ExecutableNotFound
    │   ├── TypeNotFound            no such message or service type
    │   └── ParamNotFound           (also KeyError)
    ├── MessageError                a message is not as its type wants it (also ValueError)
    │   ├── EncodeError             a value of ours does not fit its type
    │   └── DecodeError             bytes of theirs are damaged
    ├── TransportError              the session cannot do what was asked (also ConnectionError)
    │   └── NoReplica               nobody holds the parameter store
    ├── ClosedError                 the thing used has been closed or shut down
    ├── TimeMovedBackwards          ROS time was set back during a sleep
    ├── WaitTimeout                 a wait ended without its event (also TimeoutError)
    ├── ServiceError                a service answered with an error, or nobody serves it
    │   └── ServiceNotFound
    ├── ParamError                  a parameter value or write is not acceptable
    ├── StoreError                  a file of parameters cannot be used
    ├── TransformError              a transform between two frames cannot be given
    │   ├── FrameNotFound           no such frame
    │   ├── FramesNotConnected      the frames belong to separate trees
    │   ├── ExtrapolationNeeded     nothing is known that early or that late
    │   └── TransformArgument       what is no frame, or no transform
    └── LaunchError                 a launch or a process in it failed

Texts are lower case, quote the offending value, say what was expected and what to do next.
"""

from __future__ import annotations

from collections.abc import Iterable

__all__ = (
    "ClosedError",
    "DecodeError",
    "DefinitionError",
    "EncodeError",
    "ExecutableNotFound",
    "ExtrapolationNeeded",
    "FrameNotFound",
    "FramesNotConnected",
    "InvalidName",
    "LaunchError",
    "LaunchFileError",
    "MessageError",
    "NoReplica",
    "NotFoundError",
    "PackageError",
    "PackageNotFound",
    "ParamError",
    "ParamNotFound",
    "RoszError",
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


def near_miss(word: str, known: Iterable[str]) -> str:
    """Suggest the known word closest to a mistyped one.

    Args:
        word: What was written.
        known: What would have been right.

    Returns:
        ``"; did you mean 'x'?"``, or an empty text where nothing is close.
    """
    from difflib import get_close_matches  # which takes its time, and mostly nothing is wrong

    close = get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f"; did you mean '{close[0]}'?" if close else ""


class RoszError(Exception):
    """Root of all errors that rosz raises on purpose."""


class UsageError(RoszError):
    """A command line or a call that cannot mean anything; exit code 2."""


class InvalidName(RoszError, ValueError):
    """A text that is no valid graph resource name (ROS wiki, Names).

    Attributes:
        name: The text.
        reason: What is wrong with it.
    """

    def __init__(self, name: str, reason: str) -> None:
        self.name = name
        self.reason = reason
        super().__init__(f"'{name}' is not a valid name: {reason}")


class SourceError(RoszError):
    """Something wrong in a text that a person wrote.

    Attributes:
        reason: What is wrong, what was expected, what to do.
        path: The file, or a name such as ``<string>`` for a text without one.
        line: 1-based line, 0 where unknown.
        column: 1-based column, 0 where unknown.
    """

    def __init__(self, reason: str, path: str = "<string>", line: int = 0, column: int = 0) -> None:
        self.reason = reason
        self.path = path
        self.line = line
        self.column = column
        super().__init__(f"{self.place}: {reason}")

    @property
    def place(self) -> str:
        """``path:line:column``, as far as known."""
        if not self.line:
            return self.path
        return (
            f"{self.path}:{self.line}:{self.column}" if self.column else f"{self.path}:{self.line}"
        )


class DefinitionError(SourceError):
    """A .msg or .srv text that does not follow the grammar, or names an unknown type."""


class YamlError(SourceError):
    """A YAML text that cannot be read, or a value in it that has no meaning here."""


class PackageError(SourceError):
    """A package.xml that cannot be read."""


class LaunchFileError(SourceError):
    """A launch file that cannot be read.

    Attributes:
        includes: Places of the ``<include>`` tags that led here, outermost first.
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
        chain = "".join(f"\n  included from {place}" for place in reversed(includes))
        super().__init__(reason + chain, path, line, column)


class NotFoundError(RoszError, LookupError):
    """A thing asked for by name that is not there."""


class PackageNotFound(NotFoundError):
    """No package of that name on the package path.

    Attributes:
        package: The name.
    """

    def __init__(
        self, package: str, known: Iterable[str] = (), searched: Iterable[str] = ()
    ) -> None:
        self.package = package
        where = ", ".join(searched) or "nowhere: the package path is empty"
        hint = near_miss(package, known) or "; add its folder to ROSZ_PACKAGE_PATH"
        super().__init__(f"package '{package}' not found (searched {where}){hint}")


class ExecutableNotFound(NotFoundError):
    """A package has no such executable, or it may not be executed."""


class TypeNotFound(NotFoundError):
    """No message or service type of that name is known.

    Attributes:
        type_name: The name that was asked for.
    """

    def __init__(self, type_name: str, reason: str = "") -> None:
        self.type_name = type_name
        super().__init__(f"type '{type_name}' is not known{': ' + reason if reason else ''}")


class ParamNotFound(NotFoundError, KeyError):
    """No parameter of that name is set.

    Attributes:
        name: The resolved name.
    """

    def __init__(self, name: str, known: Iterable[str] = ()) -> None:
        self.name = name
        self._text = f"parameter '{name}' is not set{near_miss(name, known)}"
        super().__init__(self._text)

    def __str__(self) -> str:
        return self._text


class MessageError(RoszError, ValueError):
    """A message that is not as its type wants it."""


class EncodeError(MessageError):
    """A value that does not fit the type of its field.

    Attributes:
        type_name: The message type being encoded.
        field: Path of the field, such as ``poses[3].position.x``.
        reason: What was expected against what was given.
    """

    def __init__(self, type_name: str, field: str, reason: str) -> None:
        self.type_name = type_name
        self.field = field
        self.reason = reason
        super().__init__(f"{type_name}{'.' + field if field else ''}: {reason}")


class DecodeError(MessageError):
    """Bytes that are no valid message of the type.

    Attributes:
        type_name: The message type being decoded.
        offset: Offset in bytes from the start of the payload, header included; -1 where unknown.
        reason: What was expected against what was there.
    """

    def __init__(self, type_name: str, offset: int, reason: str) -> None:
        self.type_name = type_name
        self.offset = offset
        self.reason = reason
        place = f" at byte {offset}" if offset >= 0 else ""
        super().__init__(f"{type_name}{place}: {reason}")


class TransportError(RoszError, ConnectionError):
    """The session cannot open, or cannot do what was asked of it."""


class NoReplica(TransportError):
    """Nobody on this network holds the parameter store."""


class ClosedError(RoszError):
    """The node, session or endpoint has been closed."""


class TimeMovedBackwards(RoszError):
    """ROS time was set back, as by a simulation that starts over, during a sleep.

    Attributes:
        before: ROS time when the sleep began, in nanoseconds.
        after: ROS time that it was set back to.
    """

    def __init__(self, before: int, after: int) -> None:
        self.before = before
        self.after = after
        super().__init__(
            f"ROS time moved backwards by {(before - after) / 1e9:g} s during a sleep;"
            " sleep again, or use reset=True where a rate or timer should go on"
        )


class WaitTimeout(RoszError, TimeoutError):
    """A wait ended without its event.

    Attributes:
        what: What was waited for.
        seconds: How long, in seconds.
    """

    def __init__(self, what: str, seconds: float, hint: str = "") -> None:
        self.what = what
        self.seconds = seconds
        super().__init__(f"no {what} within {seconds:g} s{'; ' + hint if hint else ''}")


class ServiceError(RoszError):
    """A service call that failed: the server's own text, or why there was no answer."""


class ServiceNotFound(ServiceError):
    """Nobody serves that name."""


class ParamError(RoszError):
    """A parameter value or write that is not acceptable."""


class StoreError(RoszError):
    """A file of parameters that is damaged, in use, or cannot be read or written."""


class TransformError(RoszError):
    """A transform between two coordinate frames that cannot be given."""


class FrameNotFound(TransformError):
    """No transform has told of a frame of that name."""


class FramesNotConnected(TransformError):
    """Two frames that belong to separate trees."""


class ExtrapolationNeeded(TransformError):
    """A transform at a time that is before or after all that is known."""


class TransformArgument(TransformError):
    """What is no name of a frame, or no transform."""


class LaunchError(RoszError):
    """A launch, or a process in it, failed."""
