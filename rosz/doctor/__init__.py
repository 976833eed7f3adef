"""Checks for faults in a system of nodes; each names a fault with its evidence.

``machine`` looks at this machine, ``tokens`` at what nodes declare, ``replies`` at what they reply.
May import everything up to ``rosz.introspect``.
"""

from rosz.doctor.examine import Examination, examine
from rosz.doctor.finding import Finding, listed

__all__ = ("Examination", "Finding", "examine", "listed")
