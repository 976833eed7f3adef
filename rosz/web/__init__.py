"""The page: the running system in a browser.

``model`` observes and changes the system, and knows nothing of pages. ``pages`` shows it, with
NiceGUI, and is imported only by the process that serves them. ``guard`` decides who may connect.
``window`` has ROS 1's names of pages.
Needs the extra ``rosz[web]``.
"""

from rosz.web.opening import PORT, Settings, open_page

PUBLIC_MODULES = ("window",)

__all__ = ("PORT", "Settings", "open_page")
