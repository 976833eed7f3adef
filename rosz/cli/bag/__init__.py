"""``rosz bag``: the commands of rosbag."""

from rosz.cli.bag import repair
from rosz.cli.bag.group import app

__all__ = ("app", "repair")
