"""A page in space for more displays than it shows, opened after a log-in."""

from __future__ import annotations

import time
import urllib.request
from collections.abc import Iterator
from http.cookiejar import CookieJar

import pytest
from network import TIMEOUT, Network

pytestmark = [pytest.mark.system]
LONG = 4 * TIMEOUT
MOST_SECONDS = 15
"""Of the server's processor time; its clock says little on a busy machine."""


@pytest.fixture
def address(network: Network) -> Iterator[tuple[str, int]]:
    """The address of a page that needs a password, and the id of its process."""
    pytest.importorskip("nicegui")
    word = network.folder / "word"
    word.write_text("secret word\n")
    server = network.run("-m", "rosz", "web", "--port", "0", "--password-file", str(word))
    yield server.wait_for("the page is at", LONG).split()[-1].partition("?")[0], server.pid
    assert "Traceback" not in server.output


def processor_seconds(pid: int) -> float:
    """Return how long a process has run."""
    return time.clock_gettime(~pid << 3 | 2)  # CLOCK_PROCESS_CPUTIME_ID of another process


def test_many_displays_after_log_in(address: tuple[str, int]) -> None:
    place, pid = address
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
    show = "/3d?show=" + ",".join(f"/topic_{number}" for number in range(500))
    joiner = f"{place.rstrip('/')}{show}"
    before = processor_seconds(pid)
    with opener.open(f"{joiner}&token=secret+word", timeout=LONG) as first:
        assert "/3d?" in first.url
        assert "token" not in first.url
        page = first.read().decode()
    assert "topic_99" in page
    assert "topic_100" not in page
    assert processor_seconds(pid) - before < MOST_SECONDS
