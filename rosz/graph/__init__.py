"""The nodes and entities of a domain, read from liveliness tokens; no daemon, no polling."""

from rosz.graph.followed import Followed
from rosz.graph.graph import Graph
from rosz.graph.view import View

__all__ = ("Followed", "Graph", "View")
