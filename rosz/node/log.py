"""A node's log: to the console, a file and ``/rosout``, in a tree of loggers of its own.

The tree is not the process-wide one, so nothing here touches the root logger, or the level,
handlers or flags of any logger of the program. ``logging.disable`` and a ``dictConfig`` of the
program, which by default disables all loggers that it does not name, do not change the log of a
node. Two nodes of one name, in two domains, have a log each.
"""

from __future__ import annotations

import logging
from pathlib import Path

from rosz.errors import NotFoundError, near_miss
from rosz.node.clock import Clock
from rosz.node.log_handlers import (
    BACKUPS,
    DEFAULT_FORMAT,
    MAX_BYTES,
    ConsoleHandler,
    FileHandler,
    PublishLine,
    RosoutHandler,
    log_file_name,
)
from rosz.node.logger import LoggerTree, NodeLogger, parse_severity, severity_name

__all__ = ("DEFAULT_FORMAT", "NodeLog")

_BASE = "rosout"


class NodeLog(NodeLogger):
    """The log of a node: a logger that writes to console, file and ``/rosout``.

    Its name in records is ``rosout``, as in ROS 1, and that of a child ``rosout.child``.

    Args:
        node: Full name of the node.
        clock: Clock of the node.
        log_dir: Folder for the log file; no file when not given.
        file_name: Log file to use instead of one named after the node in `log_dir`.
        console: Whether to write to the console.
        console_format: Format of a line, as in ``ROSCONSOLE_FORMAT``.
        color: Whether to use colours on terminals.
        rosout: Whether to keep lines for ``/rosout``.
        level: Lowest level that is logged.
        max_bytes: Largest size of a log file in bytes.
        backups: Number of full log files to keep.
    """

    def __init__(
        self,
        node: str,
        *,
        clock: Clock,
        log_dir: Path | None = None,
        file_name: str = "",
        console: bool = True,
        console_format: str = DEFAULT_FORMAT,
        color: bool = True,
        rosout: bool = True,
        level: int = logging.INFO,
        max_bytes: int = MAX_BYTES,
        backups: int = BACKUPS,
    ) -> None:
        super().__init__(_BASE, level)
        self.manager = LoggerTree(self, clock)
        self.node = node
        self._ros_name = node.strip("/").replace("/", ".")
        self._file: FileHandler | None = None
        self._rosout: RosoutHandler | None = None
        self.addHandler(logging.NullHandler())
        report = self.manager.problems.append
        if console:
            self.addHandler(
                ConsoleHandler(node, clock, report, text_format=console_format, color=color)
            )
        path = Path(file_name).absolute() if file_name else None
        if path is None and log_dir is not None:
            path = log_dir / log_file_name(node)
        if path is not None:
            self._file = FileHandler(path, report, max_bytes=max_bytes, backups=backups)
            self.addHandler(self._file)
        if rosout:
            self._rosout = RosoutHandler(
                self._ros_name, _BASE, clock, lambda text: self.warning("%s", text)
            )
            self.addHandler(self._rosout)

    @property
    def file(self) -> Path | None:
        """The log file, which is made with the first message; None without one."""
        return None if self._file is None else self._file.path

    def publish_to(self, publish: PublishLine) -> None:
        """Begin to publish on ``/rosout``, with what was logged so far; once only.

        Args:
            publish: Function called on a thread of the log, one line at a time, with severity
                (the number in rcl_interfaces/Log), name of the logger as in ROS 2, message, file,
                function, line, and ROS time in nanoseconds. It may block, and log.
        """
        if self._rosout is not None:
            self._rosout.publish_to(publish)

    def flush(self) -> None:
        """Wait, for a second at most, until what was logged is published on ``/rosout``."""
        if self._rosout is not None:
            self._rosout.flush()

    def get_levels(self) -> dict[str, str]:
        """Return the level in effect, such as ``INFO``, of each logger of the node."""
        return {
            name: severity_name(logger.getEffectiveLevel())
            for name, logger in sorted(self._loggers().items())
        }

    def set_level(self, name: str, level: str) -> None:
        """Set the level of a logger of the node, and of its children that have none of their own.

        Args:
            name: ``rosout``, as in ROS 1, an empty text, or the node's name with dots, as in ROS 2,
                for the node itself; ``rosout.child``, ``node.child`` or ``child`` for a part of it.
            level: ``DEBUG``, ``INFO``, ``WARN``, ``ERROR`` or ``FATAL``, in any case.

        Raises:
            NotFoundError: The node has no such logger.
            UsageError: There is no such level.
        """
        loggers = self._loggers()
        local = name.removeprefix(self._ros_name).strip(".") if self._is_ros_name(name) else name
        logger = loggers.get(local or _BASE) or loggers.get(f"{_BASE}.{local}")
        if logger is None:
            known = ", ".join(sorted(loggers))
            hint = near_miss(name, loggers)
            raise NotFoundError(
                f"{self.node} has no logger '{name}': expected one of {known}{hint}"
            )
        logger.setLevel(parse_severity(level))

    def close(self) -> None:
        """Publish the rest, for a second at most, and close the file; the console stays open."""
        if self._rosout is not None:
            self.removeHandler(self._rosout)
            self._rosout.stop()
        if self._file is not None:
            self.removeHandler(self._file)
            self._file.close()

    def _is_ros_name(self, name: str) -> bool:
        return f"{name}.".startswith(f"{self._ros_name}.")

    def _loggers(self) -> dict[str, logging.Logger]:
        return {
            name: logger
            for name, logger in list(self.manager.loggerDict.items())
            if isinstance(logger, logging.Logger)
        }
