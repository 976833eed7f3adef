"""The network: sessions, and what is declared on them. No other package imports zenoh.

Public modules beside the names exported here, because few programs need them:
`rosz.session.router`, the session of ``rosz core``.
"""

from rosz.session import at_exit as at_exit  # registers what waits at the exit
from rosz.session.config import SessionConfig, keys_of
from rosz.session.declared import PullSubscriber, RawPublisher
from rosz.session.endpoints import connect_endpoint, listen_endpoints
from rosz.session.local_peers import LocalPeer, LocalPeers
from rosz.session.mesh import MeshReadiness, serve_links
from rosz.session.opening import places_of
from rosz.session.probe import first_listening, is_listening, why_refused
from rosz.session.processes import describe_process, is_stopped
from rosz.session.queries import Cancellation, Querier, Query, Queryable, Replies, Reply, Target
from rosz.session.samples import HybridClock, Sample, Stamp
from rosz.session.session import Session
from rosz.session.timeouts import LONGEST_WAIT, clamp_timeout
from rosz.session.zenoh_workarounds import SEGMENTS

__all__ = (
    "LONGEST_WAIT",
    "SEGMENTS",
    "Cancellation",
    "HybridClock",
    "LocalPeer",
    "LocalPeers",
    "MeshReadiness",
    "PullSubscriber",
    "Querier",
    "Query",
    "Queryable",
    "RawPublisher",
    "Replies",
    "Reply",
    "Sample",
    "Session",
    "SessionConfig",
    "Stamp",
    "Target",
    "clamp_timeout",
    "connect_endpoint",
    "describe_process",
    "first_listening",
    "is_listening",
    "is_stopped",
    "keys_of",
    "listen_endpoints",
    "places_of",
    "serve_links",
    "why_refused",
)
