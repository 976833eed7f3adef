"""The network: sessions, and what is declared on them. No other package imports zenoh.

The names that only ``rosz core`` needs are imported on first use.
"""

from __future__ import annotations

from rosz.lazy import exports_of
from rosz.session import at_exit as at_exit  # it registers a function for the exit
from rosz.session.at_exit import on_loss
from rosz.session.config import SessionConfig, connect_endpoint, keys_of, listen_endpoints
from rosz.session.declared import PullSubscriber, RawPublisher
from rosz.session.dialling import Dialling, find_waiting, linked_session
from rosz.session.local_peers import LocalPeers, describe_process, is_stopped
from rosz.session.mesh import MeshReadiness, serve_links
from rosz.session.opening import places_of
from rosz.session.probe import first_listening, is_listening, present_loopback, why_refused
from rosz.session.queries import (
    LONGEST_WAIT,
    Cancellation,
    Query,
    Queryable,
    Replies,
    Reply,
    clamp_timeout,
    is_key_in,
)
from rosz.session.samples import HybridClock, Sample, Stamp
from rosz.session.session import Session
from rosz.session.zenoh_workarounds import SEGMENTS

TYPE_CHECKING = False  # typing takes long to import
if TYPE_CHECKING:
    from rosz.session.restart import restart_program, take_handover
    from rosz.session.router import ExternalRouter, Router, zenoh_configuration
    from rosz.session.stale_links import SplitWatch, SuspensionDetector
else:
    __getattr__ = exports_of(__name__)
