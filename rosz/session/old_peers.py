"""Making the tokens of old peers known that a router of Zenoh 1.9 or newer drops.

A peer of Zenoh 1.8 or older, such as a node of ROS 2 Kilted, sends the tokens that it already has
over each new link with the interest id 0. A router of Zenoh 1.9 or newer takes tokens with such an
id from no peer, and logs "Received token with interest id from south-bound face". So if the nodes
start before the router, its clients never see them; tokens that are declared later pass. See
`tests/upstream/dropped_tokens.py`.

Peers do take such tokens. So the router opens a further session, a peer, as soon as it is linked to
a session of another program that has no token of a node, and declares what that one sees.
"""

from __future__ import annotations

import logging
import threading
from typing import Final

import msgspec

from rosz.errors import RoszError
from rosz.lifecycle import Closable
from rosz.session.config import SessionConfig
from rosz.session.session import Session
from rosz.wire import SPACE, is_rosz_id

_PERIOD: Final = 1.0
_TIMEOUT: Final = 3.0
_CHECKS: Final = 2
"""Checks without a token of a node that make a peer an old one; a new one may be about to start."""

_log = logging.getLogger("rosz.core")


class OldPeers:
    """Declares the tokens of old peers on a router, until closed.

    Args:
        session: Session of the router.
        config: Its configuration.
    """

    def __init__(self, session: Session, config: SessionConfig) -> None:
        self._session = session
        # Without the keys: only peers of this machine are asked, and they need none. What the
        # router says of a token is what this session makes it say, which would never end.
        from_router = {
            "enabled": True,
            "default_permission": "allow",
            "rules": [
                {
                    "id": "tokens",
                    "permission": "deny",
                    "flows": ["ingress"],
                    "messages": ["liveliness_token"],
                    "key_exprs": [f"{SPACE}/**"],
                }
            ],
            "subjects": [{"id": "router", "zids": [session.zid]}],
            "policies": [{"rules": ["tokens"], "subjects": ["router"]}],
        }
        self._config = SessionConfig(
            rendezvous=config.rendezvous,
            hold_rendezvous=False,
            override=f"access_control={msgspec.json.encode(from_router).decode()}",
        )
        self._checks: dict[str, int] = {}
        self._peer: Session | None = None
        self._token_watch: Closable
        self._tokens: dict[str, Closable | None] = {}
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="rosz-old-peers", daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        while not self._closing.wait(_PERIOD):
            try:
                self._check()
            except RoszError as error:
                _log.debug("cannot look for old peers: %s", error)

    def _check(self) -> None:
        """Count the checks in which a peer has no token of a node; 0 stands for one that has."""
        linked = {zid for zid in self._session.peers(routers=False) if not is_rosz_id(zid)}
        checks = {zid: self._checks.get(zid, 1) for zid in linked}
        for zid, number in checks.items():
            if 0 < number <= _CHECKS:
                nodes = f"{SPACE}/*/{zid}/*/*/NN/**"
                checks[zid] = 0 if self._session.live_tokens(nodes, _TIMEOUT) else number + 1
        with self._lock:
            self._checks = checks
            for key in self._tokens:
                self._declare(key)
        is_any_old = any(number > _CHECKS for number in checks.values())
        if is_any_old and self._peer is None:
            self._peer = Session.open(self._config)
            self._token_watch = self._peer.watch_tokens(f"{SPACE}/**", self._on_token, many=True)
        elif not is_any_old:
            self._forget()

    def _on_token(self, key: str, alive: bool) -> None:
        with self._lock:
            if alive:
                self._tokens.setdefault(key, None)
                self._declare(key)
            elif token := self._tokens.pop(key, None):
                token.close()

    def _declare(self, key: str) -> None:
        """Declare a token on the router if it is one of an old peer."""
        if self._tokens[key] is None and self._checks.get(key.split("/")[2], 0) > _CHECKS:
            self._tokens[key] = self._session.token(key)

    def _forget(self) -> None:
        """Close the further session, and the tokens that came from there."""
        peer, self._peer = self._peer, None
        if peer is not None:
            self._token_watch.close()
            peer.close()
        with self._lock:
            while self._tokens:
                if token := self._tokens.popitem()[1]:
                    token.close()

    def close(self) -> None:
        """Stop declaring tokens; a second call has no effect."""
        self._closing.set()
        self._thread.join()
        self._forget()
