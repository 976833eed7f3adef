"""``rosz bag``: the commands of rosbag."""

from rosz.cli.bag import play, record, repair
from rosz.cli.bag.group import app

__all__ = ("app", "play", "record", "repair")
