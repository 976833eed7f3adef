"""Large batches through a client: they have as much time as they need, as long as they get on."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from rosz.errors import WaitTimeout
from rosz.params.replica import Outcome, ParamClient
from rosz.params.writes import Change
from rosz.session import Session, SessionConfig

from .fleet import Cable, Fleet, Process, until_known

LIMIT = 4.0
"""Seconds without any sign of progress, which each process reports ten times in a second."""

SLOW = 1.25 * LIMIT
"""Seconds that each member takes to apply a batch."""

HELD, LIMIT_BELOW = 4.0, 3.0
"""Seconds for which a link takes nothing, below the five after which Zenoh closes it."""

MEMBERS = 3


@pytest.fixture
def fleet(tmp_path: Path) -> Iterator[Fleet]:
    fleet = Fleet(tmp_path)
    yield fleet
    fleet.close()


@pytest.fixture
def slow() -> float:
    return SLOW


@pytest.fixture
def limit() -> float:
    return LIMIT


@pytest.fixture
def members(fleet: Fleet, slow: float) -> dict[str, Process]:
    store = str(fleet.folder / "store")
    processes = [*fleet.start_many(2, slow=slow), fleet.start(file=store, slow=slow)]
    until_known(processes)
    return {f"member {process.pid}": process for process in processes}


@pytest.fixture
def cable(fleet: Fleet, members: dict[str, Process]) -> Iterator[Cable]:
    assert len(members) == MEMBERS
    cable = Cable(int(fleet.rendezvous.rpartition(":")[2]))
    yield cable
    cable.close()


@pytest.fixture
def client(cable: Cable, limit: float) -> Iterator[ParamClient]:
    place = f"tcp/127.0.0.1:{cable.port}"
    with Session.open(SessionConfig(mode="client", rendezvous=place, must_connect=True)) as session:
        yield ParamClient(session, timeout=limit)


def many(count: int) -> list[Change]:
    return [((f"ns{number % 50}", f"p{number}"), number) for number in range(count)]


def large(megabytes: int) -> list[Change]:
    return [((f"text{number}",), "x" * 1_000_000) for number in range(megabytes)]


def check_all_have_it(client: ParamClient, outcome: Outcome) -> None:
    assert outcome.slow == ()
    assert outcome.holders == MEMBERS
    assert client.silent == []


def test_a_batch_that_is_applied_for_long(client: ParamClient) -> None:
    seen: list[int] = []
    outcome = client.write(many(20_000), lambda holders, _: seen.append(holders))
    check_all_have_it(client, outcome)
    assert len(seen) > 1


@pytest.mark.parametrize(("slow", "limit"), [(0.0, LIMIT_BELOW)])
def test_a_batch_that_is_sent_for_long(client: ParamClient, cable: Cable) -> None:
    cable.hold(after=1_000_000)
    release = threading.Timer(HELD, cable.release)
    release.start()
    outcome = client.write(large(10))
    release.join()
    check_all_have_it(client, outcome)


def test_one_that_stops_in_the_midst_is_named(
    client: ParamClient, members: dict[str, Process]
) -> None:
    stopped: list[str] = []

    def stop_one(_: int, waiting: list[str]) -> None:
        if len(waiting) == MEMBERS - 1 and not stopped:
            stopped.append(waiting[0])
            members[waiting[0]].stop()

    outcome = client.write(many(20_000), stop_one)
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
        client.write(many(20_000), stop_the_server)
    assert stopped[0] in str(raised.value)
    assert client.silent == stopped
