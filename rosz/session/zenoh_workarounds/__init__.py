"""Workarounds for Zenoh's behaviour, seen with eclipse-zenoh 1.10.2.

Each module says what it works around, what happens without it, and which upstream report it waits
for. The session uses only the names exported here, so that the folder can be deleted whole one day:

- `prepare_process` sets up the process before the first session opens;
- `reachable_config` and `connect_to_running` change where a session connects to;
- `open_and_listen` opens a session that should hold the rendezvous;
- `close_links_at_once` and `close_links` deal with links whose other end does not answer;
- `remove_abandoned_segments` frees shared memory of killed processes, kept in `SEGMENTS`;
- `new_interfaces.NewInterfaces`, which only the router needs, follows network interfaces.
"""

from rosz.session.zenoh_workarounds.links import close_links, close_links_at_once
from rosz.session.zenoh_workarounds.opening import (
    connect_to_running,
    open_and_listen,
    prepare_process,
    reachable_config,
)
from rosz.session.zenoh_workarounds.shared_memory import SEGMENTS, remove_abandoned_segments

__all__ = (
    "SEGMENTS",
    "close_links",
    "close_links_at_once",
    "connect_to_running",
    "open_and_listen",
    "prepare_process",
    "reachable_config",
    "remove_abandoned_segments",
)
