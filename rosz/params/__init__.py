"""The parameter store.

The pure half knows what parameters are and nothing of the network: values and names (`values`,
`paths`), writes and their replay (`writes`, `tree`, `history`, `digest`, `merge`), YAML (`yaml`)
and the messages between replicas (`keys`, `wire`). It imports nothing above the first floor.

The other half lives on the fourth floor: `replica` and what serves it, `remote` for those who only
ask, `api` for nodes. It is imported by module, so that the pure half stays light.
"""

from rosz.params.history import History
from rosz.params.merge import Change, condense, spread
from rosz.params.paths import Path, climb, joined, resolve, split
from rosz.params.tree import MISSING, Missing, leaves, lookup
from rosz.params.values import Value, normalise
from rosz.params.writes import DELETED, Deleted, Write

__all__ = (
    "DELETED",
    "MISSING",
    "Change",
    "Deleted",
    "History",
    "Missing",
    "Path",
    "Value",
    "Write",
    "climb",
    "condense",
    "joined",
    "leaves",
    "lookup",
    "normalise",
    "resolve",
    "split",
    "spread",
)
