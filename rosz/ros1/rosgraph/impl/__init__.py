"""rosgraph.impl: the graph of nodes and topics, as programs that draw it take it.

It may import rosgraph.
"""

from __future__ import annotations

from rosz.ros1.rosgraph.impl import graph

__all__ = ("graph",)
