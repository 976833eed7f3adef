"""Looking at a running system: what its commands show, measure, send and ask.

``reach`` finds the way into the network and ``survey`` sees who is there; ``topics``, ``services``,
``nodes`` and ``definitions`` put that into ROS 1's words; ``echo``, ``rate``, ``bandwidth``,
``delay`` and ``rosout`` follow topics; ``fill``, ``documents`` and ``publish`` send messages made
from text; ``control`` talks to nodes. Whoever needs one of them imports it alone, so nothing is
imported here.
"""

__all__: tuple[str, ...] = ()
