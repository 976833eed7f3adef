"""The network edge: sessions, and all that is declared on them. Nothing else imports zenoh."""

from rosz.session import calls as calls  # waits at the exit
from rosz.session.answers import Answers, Target
from rosz.session.config import SessionConfig, keys_of, secured
from rosz.session.declared import Asker, Closable, RawPublisher, Ring
from rosz.session.samples import Query, Reply, Sample
from rosz.session.session import Session
from rosz.session.stamp import HybridClock, Stamp

__all__ = (
    "Answers",
    "Asker",
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
    "keys_of",
    "secured",
)
