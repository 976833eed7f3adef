"""``rosz bag``: the commands of rosbag."""

from rosz.cli.bag import edit, info, play, record, repair, show
from rosz.cli.bag.source import app

__all__ = ("app", "edit", "info", "play", "record", "repair", "show")
