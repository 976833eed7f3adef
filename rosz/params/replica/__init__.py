"""The replicated store, on the network: a process's own copy, kept the same as all others.

`replica` is the whole; `reading` its tree and `state` its history behind a lock; `line`, `acks` and
`members` bring writes to everybody; `sync` and `keeper` settle what went wrong meanwhile; `serve`
and `mirror` answer those who are no replicas; `watch` tells programs what changes; `saver` keeps it
on disk.
"""

from rosz.params.replica.replica import ACKNOWLEDGED_BY, Outcome, Replica, process_label
from rosz.params.replica.saver import Keep
from rosz.params.replica.watch import Changed, Watch

__all__ = (
    "ACKNOWLEDGED_BY",
    "Changed",
    "Keep",
    "Outcome",
    "Replica",
    "Watch",
    "process_label",
)
