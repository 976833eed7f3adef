"""The network edge: sessions, and all that is declared on them. Nothing else imports zenoh."""

from rosz.session import calls as calls  # waits at the exit
from rosz.session.answers import Answers, Cancellation, Target
from rosz.session.config import SessionConfig, keys_of
from rosz.session.declared import Asker, Closable, RawPublisher, Ring
from rosz.session.endpoints import dialled, is_local, listening, secured
from rosz.session.opening import places_of
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
    "dialled",
    "is_local",
    "keys_of",
    "listening",
    "places_of",
    "secured",
)
