"""Checks for faults in a system of nodes; each names a fault with its evidence.

``machine`` looks at this machine, ``tokens`` at declarations of nodes, ``replies`` at their
replies; ``frames`` listens to transforms. May import everything up to ``rosz.introspect``.
"""

from rosz.doctor.examine import Examination, examine
from rosz.doctor.machine import Finding, listed
