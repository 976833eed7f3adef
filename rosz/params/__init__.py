"""The parameter store.

The modules exported here are pure. They know what parameters are, and nothing of the network:
values (`values`), names (`paths`), writes and batches of them (`writes`), the tree that writes give
(`tree`) and the set of writes behind it (`history`). They import nothing above the first floor. The
replicated store is the package `rosz.params.replica`.

`PUBLIC_MODULES` are imported by name, so that start-up loads only the one that it needs:

- `wire`: keys and messages of the store on the network (pure);
- `ros2_file`: the nodes that values of a ROS 2 parameter file belong to (pure);
- `yaml`: parameters as YAML text, and any YAML text read safely (pure, needs PyYAML).
"""

from rosz.params.history import History
from rosz.params.paths import Path, climb, joined, resolve, split
from rosz.params.tree import MISSING, Difference, Draft, Missing, ends, leaves, lookup, preview
from rosz.params.values import Value, normalise, type_name
from rosz.params.writes import DELETED, Change, Deleted, Write, condense, spread

PUBLIC_MODULES = (
    "ros2_file",
    "wire",
    "yaml",
)

__all__ = (
    "DELETED",
    "MISSING",
    "Change",
    "Deleted",
    "Difference",
    "Draft",
    "History",
    "Missing",
    "Path",
    "Value",
    "Write",
    "climb",
    "condense",
    "ends",
    "joined",
    "leaves",
    "lookup",
    "normalise",
    "preview",
    "resolve",
    "split",
    "spread",
    "type_name",
)
