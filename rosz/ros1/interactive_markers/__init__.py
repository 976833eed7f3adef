"""interactive_markers: markers that people move in RViz (ROS wiki, interactive_markers).

May import rospy and message classes.
"""

from __future__ import annotations

PUBLIC_MODULES = ("interactive_marker_server", "menu_handler")

__all__: tuple[str, ...] = ()
