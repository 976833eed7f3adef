"""Messages as drawings in space; nothing here imports NiceGUI.

A `Display` receives messages while it is shown, and draws the newest one in the coordinates of the
fixed frame when a browser asks for it. Needs numpy.
"""

from rosz.web.scene.display import DRAWN_TYPES, Display, FrameDisplay, GridDisplay, TopicDisplay
from rosz.web.scene.setup import (
    DEFAULT,
    GRID,
    ROBOT,
    TF,
    Look,
    Setup,
    format_setup,
    read_setup,
)

__all__ = (
    "DEFAULT",
    "DRAWN_TYPES",
    "GRID",
    "ROBOT",
    "TF",
    "Display",
    "FrameDisplay",
    "GridDisplay",
    "Look",
    "Setup",
    "TopicDisplay",
    "format_setup",
    "read_setup",
)
