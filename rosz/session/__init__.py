"""The network: sessions, and what is declared on them. No other package imports zenoh.

Only ``rosz core`` needs the modules in `PUBLIC_MODULES`.
"""

from rosz.session import at_exit as at_exit  # registers what waits at the exit
from rosz.session.config import SessionConfig, connect_endpoint, keys_of, listen_endpoints
from rosz.session.declared import PullSubscriber, RawPublisher
from rosz.session.dialling import Dialling, Waiting, find_waiting, linked_session, who_answers
from rosz.session.local_peers import LocalPeers, describe_process, is_stopped
from rosz.session.mesh import MeshReadiness, serve_links
from rosz.session.opening import places_of
from rosz.session.probe import first_listening, is_listening, why_refused
from rosz.session.queries import (
    LONGEST_WAIT,
    Cancellation,
    Query,
    Queryable,
    Replies,
    Reply,
    clamp_timeout,
)
from rosz.session.samples import HybridClock, Sample, Stamp
from rosz.session.session import Session
from rosz.session.zenoh_workarounds import SEGMENTS

PUBLIC_MODULES = ("restart", "router", "split", "standstill")
"""Modules that few programs need, and that others may import as they are."""

__all__ = (
    "LONGEST_WAIT",
    "SEGMENTS",
    "Cancellation",
    "Dialling",
    "HybridClock",
    "LocalPeers",
    "MeshReadiness",
    "PullSubscriber",
    "Query",
    "Queryable",
    "RawPublisher",
    "Replies",
    "Reply",
    "Sample",
    "Session",
    "SessionConfig",
    "Stamp",
    "Waiting",
    "clamp_timeout",
    "connect_endpoint",
    "describe_process",
    "find_waiting",
    "first_listening",
    "is_listening",
    "is_stopped",
    "keys_of",
    "linked_session",
    "listen_endpoints",
    "places_of",
    "serve_links",
    "who_answers",
    "why_refused",
)
