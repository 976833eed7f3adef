"""The page: the running system in a browser.

``model`` observes and changes the system, and knows nothing of pages. ``pages`` shows it, with
NiceGUI, and is imported only by the process that serves them. ``middleware`` refuses those who may
not connect. ``window`` has ROS 1's names of pages.
Needs the extra ``rosz[web]``.
"""

from rosz.web.opening import PORT, PageSettings, open_page
