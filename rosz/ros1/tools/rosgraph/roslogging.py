"""rosgraph.roslogging: a log file for programs that are not nodes.

Nodes have logs of their own. As in ROS 1, the handlers go to Python's root logger.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping
from logging.handlers import RotatingFileHandler
from pathlib import Path

from rosz.ros1.tools.rospkg import get_log_dir

_FORMAT = "[%(name)s][%(levelname)s] %(asctime)s: %(message)s"
# Both as in ROS 1's python_logging.conf.
_MAX_BYTES = 50_000_000
_BACKUPS = 4


class LoggingException(Exception):
    """A log file cannot be written."""


def makedirs_with_parent_perms(p: str) -> None:
    """Create a folder, and those above it, with the permissions of the first one that exists."""
    folder = Path(p).absolute()
    above = next(up for up in folder.parents if up.exists())
    folder.mkdir(parents=True, exist_ok=True)
    mode = above.stat().st_mode
    made = folder
    while made != above:
        made.chmod(mode)
        made = made.parent


def renew_latest_logdir(logfile_dir: str) -> bool:
    """Link ``latest``, beside a log folder, to it; return False if it is a real file or folder."""
    latest = Path(logfile_dir).parent / "latest"
    if latest.exists() and not latest.is_symlink():
        return False
    latest.unlink(missing_ok=True)
    latest.symlink_to(logfile_dir)
    return True


def configure_logging(
    logname: str,
    level: int = logging.INFO,
    filename: str | None = None,
    env: Mapping[str, str] | None = None,
) -> str:
    """Log to a file from now on, and return its path.

    Args:
        logname: Name of the program.
        level: Least severity.
        filename: Name of the file; that of the program and its process id when not given.
        env: Environment variables; those of the process when not given.

    Raises:
        LoggingException: The file cannot be written.
    """
    file = Path(get_log_dir(env), filename or f"{logname}-{os.getpid()}.log")
    try:
        makedirs_with_parent_perms(str(file.parent))
        handler = RotatingFileHandler(file, maxBytes=_MAX_BYTES, backupCount=_BACKUPS)
    except OSError as error:
        raise LoggingException(f"cannot write log file '{file}': {error.strerror}") from error
    handler.setFormatter(logging.Formatter(_FORMAT))
    handler.setLevel(level)
    root = logging.getLogger()
    root.setLevel(min(level, root.level or level))
    root.addHandler(handler)
    return str(file)
