"""``ros2``: the command line of ROS 2, over what the commands of rosz use.

``table`` declares the commands with their options, ``line`` reads a command line and runs it.
``graph`` asks the network who is there, ``listing`` prints it; ``topics``, ``calls`` and ``params``
speak with nodes; ``packages`` is about files. ``messages`` prints and fills messages as ROS 2 does.
Options, output and exit codes are those of ROS 2's own commands, whose errors have no prefix.
"""

from rosz.cli.ros2.line import main, words_after

__all__ = ("main", "words_after")
