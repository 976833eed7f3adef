"""The network edge: sessions, and all that is declared on them. Nothing else imports zenoh."""

from rosz.session import calls as calls  # waits at the exit
from rosz.session.answers import Answers, Cancellation, Target
from rosz.session.config import SessionConfig, keys_of
from rosz.session.declared import Asker, Closable, RawPublisher, Ring
from rosz.session.endpoints import connect_endpoint, listen_endpoints
from rosz.session.opening import places_of
from rosz.session.probe import first_listening, is_listening, why_refused
from rosz.session.samples import Query, Reply, Sample
from rosz.session.session import Session
from rosz.session.stamp import HybridClock, Stamp

__all__ = (
    "Answers",
    "Asker",
    "Cancellation",
    "Closable",
    "HybridClock",
    "Query",
    "RawPublisher",
    "Reply",
    "Ring",
    "Sample",
    "Session",
    "SessionConfig",
    "Stamp",
    "Target",
    "connect_endpoint",
    "first_listening",
    "is_listening",
    "keys_of",
    "listen_endpoints",
    "places_of",
    "why_refused",
)
