"""Playing bags. May import nodes and what edits bags."""

from rosz.bags.play.options import PlayOptions, Progress
from rosz.bags.play.player import Player

__all__ = ("PlayOptions", "Player", "Progress")
