"""Large batches through a client: they have as much time as they need, as long as they get on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from rosz.errors import WaitTimeout
from rosz.params.replica import ParamClient
from rosz.params.writes import Change
from rosz.session import Session, SessionConfig

from .fleet import Fleet, Process

LIMIT = 0.5
"""Seconds without any sign of progress; each of these batches takes longer as a whole."""

MEMBERS = 3


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[Fleet]:
    fleet = Fleet(tmp_path)
    yield fleet
    fleet.close()


@pytest.fixture
def members(fleet: Fleet) -> dict[str, Process]:
    processes = [*fleet.start_many(2), fleet.start(file=str(fleet.folder / "store"))]
    return {f"member {process.pid}": process for process in processes}


@pytest.fixture
def client(fleet: Fleet, members: dict[str, Process]) -> Iterator[ParamClient]:
    assert len(members) == MEMBERS
    config = SessionConfig(mode="client", rendezvous=fleet.rendezvous, must_connect=True)
    with Session.open(config) as session:
        yield ParamClient(session, timeout=LIMIT)


def many(count: int) -> list[Change]:
    return [((f"ns{number % 50}", f"p{number}"), number) for number in range(count)]


def large(megabytes: int) -> list[Change]:
    return [((f"text{number}",), "x" * 1_000_000) for number in range(megabytes)]


@pytest.mark.parametrize("changes", [many(100_000), large(40)], ids=["many", "large"])
def test_size_alone_passes_no_limit(client: ParamClient, changes: list[Change]) -> None:
    seen: list[int] = []
    outcome = client.write(changes, lambda holders, _: seen.append(holders))
    assert outcome.slow == ()
    assert outcome.holders == MEMBERS
    assert len(seen) > 1
    assert client.silent == []


def test_one_that_stops_in_the_midst_is_named(
    client: ParamClient, members: dict[str, Process]
) -> None:
    stopped: list[str] = []

    def stop_one(_: int, waiting: list[str]) -> None:
        if len(waiting) == MEMBERS - 1 and not stopped:
            stopped.append(waiting[0])
            members[waiting[0]].stop()

    outcome = client.write(many(30_000), stop_one)
    assert [label.removesuffix(" (stopped)") for label in outcome.slow] == stopped
    assert outcome.holders == MEMBERS - 1


def test_one_that_serves_and_stops_in_the_midst_is_named(
    client: ParamClient, members: dict[str, Process]
) -> None:
    stopped: list[str] = []

    def stop_the_server(_: int, waiting: list[str]) -> None:
        if len(waiting) == MEMBERS - 1 and not stopped:
            (server,) = members.keys() - set(waiting)
            stopped.append(server)
            members[server].stop()

    with pytest.raises(WaitTimeout) as raised:
        client.write(many(30_000), stop_the_server)
    assert stopped[0] in str(raised.value)
    assert client.silent == stopped
