"""What Zenoh's own storages do, in few words: keep the newest of each key, and answer with it."""

from __future__ import annotations

import threading
from queue import SimpleQueue

from rosz.params.wire import Keys
from rosz.session import Query, Sample, Session, Stamp, is_key_in


class Storage:
    """Keeps all keys of parameters, knowing nothing of what they are."""

    def __init__(self, session: Session, domain: int = 0) -> None:
        self.held: dict[str, tuple[Stamp, bytes]] = {}
        self.tombs: dict[str, Stamp] = {}
        self._queries: SimpleQueue[Query | None] = SimpleQueue()
        key = Keys(domain).all_params
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()
        self._declared = [
            session.queryable(key, self._queries.put, complete=True),
            session.subscriber(key, self._take),
        ]

    def close(self) -> None:
        for declared in self._declared:
            declared.close()
        self._queries.put(None)
        self._thread.join()

    def _take(self, sample: Sample) -> None:
        stamp = sample.stamp
        assert stamp is not None
        key = sample.key
        known = max(self.held.get(key, (Stamp(0, ""),))[0], self.tombs.get(key, Stamp(0, "")))
        if stamp < known:
            return
        if sample.deleted:
            self.held.pop(key, None)
            self.tombs[key] = stamp
        else:
            self.held[key] = (stamp, sample.payload)

    def _answer(self) -> None:
        while (query := self._queries.get()) is not None:
            with query:
                for key, (stamp, payload) in self.held.copy().items():
                    if is_key_in(query.key, key):
                        query.reply(key, payload, stamp=stamp)
