"""The replicated store on the network: one copy in each process, kept the same as all others.

`replica` holds the copies themselves, `state` the history and tree of a copy, `broadcast` writes
and their acknowledgements, `sync` joining, comparing and anti-entropy, `members` the replicas that
are alive, `serve` what a replica does for programs that have none, and `watch` the notification of
changes. The keys and messages are those of `rosz.params.wire`.

`PUBLIC_MODULES`: `storage` is imported by name, because only a replica with a file needs SQLite.
"""

from rosz.params.replica.replica import (
    ACK_TIMEOUT,
    NO_REPLICA,
    Follower,
    Outcome,
    Replica,
    process_label,
)
from rosz.params.replica.state import not_found
from rosz.params.replica.watch import Changed, Watch

PUBLIC_MODULES = ("storage",)

__all__ = (
    "ACK_TIMEOUT",
    "NO_REPLICA",
    "Changed",
    "Follower",
    "Outcome",
    "Replica",
    "Watch",
    "not_found",
    "process_label",
)
