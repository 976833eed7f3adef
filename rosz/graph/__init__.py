"""The nodes and entities of a domain, read from liveliness tokens; no daemon, no polling."""

from rosz.graph.graph import Graph, GraphListener, ProcessListener
from rosz.graph.view import View

__all__ = ("Graph", "GraphListener", "ProcessListener", "View")
