"""Messages as drawings in space; nothing here imports NiceGUI.

A `Display` receives messages while it is shown, and draws the newest one in the coordinates of the
fixed frame when a browser asks for it. Needs numpy.
"""

from rosz.web.scene.display import Display
from rosz.web.scene.handles import HANDLE_TYPE, HandleDisplay, Held
from rosz.web.scene.meshes import Meshes
from rosz.web.scene.opening import list_displays, open_display
from rosz.web.scene.setup import (
    AXES,
    DEFAULT,
    DEPTH,
    DESCRIPTION,
    GRID,
    MOST_DISPLAYS,
    ROBOT,
    TF,
    Look,
    SceneSetup,
    format_setup,
    read_setup,
)
from rosz.web.scene.tools import TOOLS, Tools
