"""What Zenoh does with samples that find no room on a link."""

from __future__ import annotations

import json

import pytest
import zenoh

from rosz.session import SessionConfig
from rosz.session.config import zenoh_settings


@pytest.mark.parametrize(
    ("listen", "expected"), [((), [50_000, 150_000]), (("tcp/0.0.0.0:0",), [1000, 50_000])]
)
def test_only_links_of_the_machine_wait(listen: tuple[str, ...], expected: list[int]) -> None:
    """There a full link means a busy machine; beyond it, a slow link must not hold up others."""
    settings = zenoh_settings(SessionConfig(rendezvous="tcp/127.0.0.1:7447", listen=listen))
    config = zenoh.Config.from_json5(json.dumps(settings))
    drop = json.loads(config.get_json("transport/link/tx/queue/congestion_control/drop"))
    assert [drop["wait_before_drop"], drop["max_wait_before_drop_fragments"]] == expected
