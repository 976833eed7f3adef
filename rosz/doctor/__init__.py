"""What is wrong with a system of nodes: one check per fault, each naming it with its evidence.

The machine first (shared memory, sockets, endpoints), then what the tokens of the network show,
then what the nodes answer. May import anything up to ``rosz.introspect``.
"""

from rosz.doctor.examine import Examination, examine
from rosz.doctor.finding import Finding, listed

__all__ = ("Examination", "Finding", "examine", "listed")
