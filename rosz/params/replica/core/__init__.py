"""The core of a replica: all that it decides, in steps without threads, clocks, sockets or chance.

`ReplicaCore.step` takes an event (`events`) and returns effects (`effects`). Its parts:

- `store`: the writes, and which ones are taken; `disk`: what of them is stored;
- `members`: the other replicas, visible and absent; `seeds`: who follows all of them;
- `deliveries`: the batches of this replica, which others acknowledge;
- `comparisons`: the exchange of differences;
- `joining`: how a replica gets all at its beginning; `ending`: how it hands over what only it has;
- `calls`: calls that wait for the other replicas; `upkeep`: the periodic work.

`work` is what they share during a step, and `replica_core` hands each event to its part.
"""

from rosz.params.replica.core.replica_core import ReplicaCore
from rosz.params.replica.core.work import Config

__all__ = ("Config", "ReplicaCore")
