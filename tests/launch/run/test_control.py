"""Requests to a running launch: its status, and restarting or stopping nodes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from network import eventually, free_port

from rosz.errors import LaunchError, NotFoundError
from rosz.launch.run import Network, StatusClient, Timeouts
from rosz.session import Query, Session, SessionConfig
from rosz.wire import own_key

from .in_thread import TIMEOUT, MemoryNetwork, alive, launch, program, shell

DOMAIN = 3


@pytest.fixture
def rendezvous() -> str:
    return f"tcp/127.0.0.1:{free_port()}"


@pytest.fixture
def network(rendezvous: str) -> Iterator[Network]:
    with Session.open(SessionConfig(rendezvous=rendezvous)) as session:
        yield MemoryNetwork(session, DOMAIN)


@pytest.fixture
def client(rendezvous: str, network: Network) -> Iterator[StatusClient]:
    assert network.session is not None
    config = SessionConfig(mode="client", rendezvous=rendezvous, must_connect=True)
    with Session.open(config) as session:
        yield StatusClient(session, DOMAIN)


SLEEPERS = [
    shell("a", "exec sleep 600"),
    shell("b", "exit 3", namespace="/space"),
    program("c", "/no/such/program"),
]


def test_status(tmp_path: Path, network: Network, client: StatusClient) -> None:
    with launch(tmp_path, *SLEEPERS, network=network) as run:
        run.err.wait_for("[space/b-2] process has died")
        comm = Path(f"/proc/{run.pid('a-1')}/comm")

        def has_changed() -> bool:
            """Return whether it is another program, and past the instant without memory."""
            return comm.read_text() == "sleep\n" and next(
                status.nodes[0].memory > 0 for status in client.running().values()
            )

        eventually(has_changed, "the program of a")
        (status,) = client.running().values()
    assert (status.run_id, status.pid) == (run.runner.run_id, os.getpid())
    a, b, c = status.nodes
    assert (a.name, a.type, a.state, a.detail) == ("/a", "sh -c exec sleep 600", "running", "")
    assert (a.pid, a.restarts) == (run.pid("a-1"), 0)
    assert a.uptime > 0
    assert a.memory > 100_000
    assert (b.name, b.state, b.detail) == ("/space/b", "ended", "ended with exit code 3")
    assert (b.pid, b.memory, b.uptime) == (0, 0, 0)
    assert (c.name, c.state, c.pid) == ("/c", "failed", 0)
    assert c.detail.startswith("unable to launch [c-3]: No such file or directory")
    assert client.running() == {}


def test_restart(tmp_path: Path, network: Network, client: StatusClient) -> None:
    with launch(tmp_path, *SLEEPERS, network=network) as run:
        first = run.pid("a-1")
        run.err.wait_for("[space/b-2] process has died")
        client.request("restart", "a")
        assert not alive(first)
        (status,) = client.running().values()
        assert (status.nodes[0].restarts, status.nodes[0].state) == (1, "running")
        client.request("restart", "/space/b")
        run.err.wait_for("[space/b-2] process has died", times=2)


def test_stop(tmp_path: Path, network: Network, client: StatusClient) -> None:
    with launch(tmp_path, *SLEEPERS, network=network) as run:
        pid = run.pid("a-1")
        run.err.wait_for("[space/b-2] process has died")
        client.request("stop", "/a")
        assert not alive(pid)
        assert run.join() == 1  # of c, which could not be started
    assert "all processes on machine have died" in run.out.getvalue()


def test_output_is_followed_from_the_screen_and_from_files(
    tmp_path: Path, network: Network, client: StatusClient
) -> None:
    more = tmp_path / "more"
    os.mkfifo(more)
    script = f"printf '\\033[31mgrün\\033[0m\\n'; echo oh >&2; cat {more}; exec sleep 600"
    nodes = shell("shown", script, output="screen"), shell("kept", "echo one; echo oh >&2")
    with launch(tmp_path, *nodes, network=network) as run:
        run.pid("kept-2")
        (key,) = client.running()

        def has_come(name: str, *texts: str) -> bool:
            found = client.read_output(key, name).text
            return all(text in found for text in texts)

        eventually(lambda: has_come("/shown", "grün\n", "oh\n"), "the output of /shown")
        eventually(lambda: has_come("/kept", "one\n", "oh\n"), "the output of /kept")
        (known,) = client.newest_output("shown")
        assert "oh\n" in known.text
        assert client.read_output(key, "/shown", known.position).text == ""
        more.write_text("later\n")
        eventually(
            lambda: client.read_output(key, "/shown", known.position).text == "later\n",
            "what comes later",
        )
        with pytest.raises(LaunchError, match="this launch has no node '/none'"):
            client.read_output(key, "/none")
        eventually(
            lambda: client.read_output(key, "/shown", (-1, 1 << 40)).text.endswith("later\n"),
            "what is kept, at a position that is none",
        )


def test_much_output_is_bounded(tmp_path: Path, network: Network, client: StatusClient) -> None:
    script = f"yes some words | head -c 3000000; touch {tmp_path}/done; exec sleep 600"
    with launch(tmp_path, shell("a", script), network=network) as run:
        run.pid("a-1")
        (key,) = client.running()
        first = client.read_output(key, "/a").position
        eventually((tmp_path / "done").exists, "all output")
        newest = client.read_output(key, "/a", (0, 0))
        assert newest.position == (3_000_000, 0)
        assert newest.skipped == 3_000_000 - 65536
        assert 60_000 < len(newest.text) <= 65536
        assert set(newest.text.splitlines()[:-1]) == {"some words"}
        assert first <= newest.position


def test_requests_that_fail(tmp_path: Path, network: Network, client: StatusClient) -> None:
    with pytest.raises(NotFoundError, match=r"no launch runs a node '/a'; no launch is running"):
        client.request("stop", "a")
    with launch(tmp_path, *SLEEPERS, network=network) as run:
        run.pid("a-1")
        with pytest.raises(NotFoundError, match=r"'/space/bb'; did you mean '/space/b'\?"):
            client.request("restart", "/space/bb")
        with pytest.raises(LaunchError, match=r"'/c' did not start again: unable to launch"):
            client.request("restart", "c")


def test_a_launch_that_ends_refuses_requests(
    tmp_path: Path, network: Network, client: StatusClient
) -> None:
    ready, asked = tmp_path / "ready", tmp_path / "asked"
    end = f"kill $!; until test -e {asked}; do sleep 0.02; done; exit 0"
    slow = shell("s", f"trap '{end}' INT; touch {ready}; sleep 600 & wait")
    with launch(tmp_path, slow, network=network, timeouts=Timeouts(TIMEOUT, TIMEOUT)) as run:
        run.pid("s-1")
        eventually(ready.exists, "trap")
        run.runner.stop()
        run.out.wait_for("killing on exit")
        with pytest.raises(LaunchError, match="this launch is ending"):
            client.request("restart", "/s")
        asked.touch()
        run.join()


def test_a_reply_that_is_not_valid(network: Network, client: StatusClient) -> None:
    assert network.session is not None
    key = own_key(DOMAIN, "launch", "1", network.session.zid)

    def answer(query: Query) -> None:
        with query:
            query.reply(key, b"{}")

    with (
        closing(network.session.queryable(key, answer)),
        pytest.raises(LaunchError, match=f"reply of a launch at '{key}' is not valid: .*version"),
    ):
        client.running()
