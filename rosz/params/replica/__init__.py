"""The replicated store on the network: one copy in each process, kept the same as all others.

`core` is all that a copy decides, in pure steps. `runner` runs it on threads, `exchange` sends and
receives its messages, `tokens` shows it to others, `storage` is its file, and `watch` notifies of
changes. `replica` puts the copies together, `reader` reads them, and `serve` holds the services for
programs without a replica. `params` is the store as a node sees it, and `client` the store as seen
by a process that has no replica. The keys and messages are those of `rosz.params.wire`.

The names are imported on first use: a command needs no replica, and few replicas need SQLite.
"""

from __future__ import annotations

from rosz.lazy import exports_of

TYPE_CHECKING = False  # typing takes long to import
if TYPE_CHECKING:
    from rosz.params.replica.client import ParamClient
    from rosz.params.replica.core.effects import Outcome
    from rosz.params.replica.params import Params
    from rosz.params.replica.replica import ACK_TIMEOUT, Follower, Replica
    from rosz.params.replica.storage import Storage, StoreFile
    from rosz.params.replica.watch import Changed, Watch
else:
    __getattr__ = exports_of(__name__)
