"""The network edge: sessions, and all that is declared on them. Nothing else imports zenoh."""

from rosz.session import at_exit as at_exit  # registers what waits at the exit
from rosz.session.config import SessionConfig, keys_of
from rosz.session.declared import PullSubscriber, RawPublisher
from rosz.session.endpoints import connect_endpoint, listen_endpoints
from rosz.session.mesh import MeshReadiness, serve_links
from rosz.session.opening import places_of
from rosz.session.probe import first_listening, is_listening, why_refused
from rosz.session.queries import Cancellation, Querier, Query, Queryable, Replies, Reply, Target
from rosz.session.samples import HybridClock, Sample, Stamp
from rosz.session.session import Session
from rosz.session.timeouts import LONGEST_WAIT, clamp_timeout

__all__ = (
    "LONGEST_WAIT",
    "Cancellation",
    "HybridClock",
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
    "first_listening",
    "is_listening",
    "keys_of",
    "listen_endpoints",
    "places_of",
    "serve_links",
    "why_refused",
)
