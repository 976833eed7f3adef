"""What goes wrong between real processes, and what is left afterwards.

ROSZ_FAULTS=full tries it at full length; without it each fault is shorter, and the same.
"""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest
from network import TIMEOUT, free_port

from rosz.params.replica.core.work import KEPT_TOMBSTONES

from .fleet import Cable, Fleet, Process, until_known, until_same

FULL = os.environ.get("ROSZ_FAULTS", "") == "full"
WRITES = 10_000 if FULL else 1_500
SECONDS = 20.0 if FULL else 1.5
STOPPED = 10.0 if FULL else 3.5
LOADED = 5_000
MANY = 200 if FULL else 40


def pass_time(seconds: float) -> None:
    """Let a fault last: its length is what is tried."""
    threading.Event().wait(seconds)


def acknowledged(log: Path) -> dict[str, int]:
    names = log.read_text().split()
    return {name: int(name.rpartition("x")[2]) for name in names}


def nothing_is_missing(process: Process, *logs: Path) -> int:
    root = process.do("root")
    count = 0
    for log in logs:
        for name, value in acknowledged(log).items():
            space, _, leaf = name[1:].partition("/")
            assert root[space][leaf] == value, f"{name} was acknowledged and is gone"
            count += 1
    return count


def test_kills_during_a_storm_lose_nothing(fleet: Fleet) -> None:
    first, writer, other, victim = fleet.start_many(4)
    logs = [fleet.folder / "one", fleet.folder / "two"]
    writer.tell("storm", prefix="/one/x", count=WRITES, log=str(logs[0]))
    other.tell("storm", prefix="/two/x", count=WRITES, log=str(logs[1]))
    while not all(log.exists() and log.stat().st_size > 2000 for log in logs):
        pass_time(0.005)
    victim.kill()
    while logs[1].stat().st_size < 4000:
        pass_time(0.005)
    other.kill()
    first.kill()
    late = fleet.start()
    assert writer.answer() > 0
    until_same([writer, late], "kill -9 of three of four replicas during a storm")
    count = nothing_is_missing(late, *logs)
    print(f"{count} acknowledged writes are all there")
    assert count >= WRITES


@pytest.mark.parametrize("kind", ["cut", "held up"])
def test_two_halves_that_were_cut_apart_become_one(fleet: Fleet, kind: str) -> None:
    ports = free_port(), free_port()
    cable = Cable(ports[0])
    left_router = fleet.start(endpoint=f"tcp/127.0.0.1:{ports[0]}", mode="router")
    right_router = fleet.start(
        endpoint=f"tcp/127.0.0.1:{ports[1]}",
        mode="router",
        connect=[f"tcp/127.0.0.1:{cable.port}"],
    )
    left = [left_router, fleet.start(endpoint=f"tcp/127.0.0.1:{ports[0]}", mode="client")]
    right = [right_router, fleet.start(endpoint=f"tcp/127.0.0.1:{ports[1]}", mode="client")]
    until_known(left + right)
    left[1].do("set", name="/both/shared", value="before")
    left[1].do("set", name="/doomed", value={"a": 1, "b": 2})
    if kind == "cut":
        cable.cut()
    else:
        cable.hold()
    logs = [fleet.folder / name for name in ("left", "right")]
    left[1].tell("storm", prefix="/left/x", count=300, log=str(logs[0]), timeout=0.3)
    right[1].tell("storm", prefix="/right/x", count=300, log=str(logs[1]), timeout=0.3)
    left[1].answer()
    right[1].answer()
    left[0].do("set", name="/both/shared", value="left", timeout=0.1)
    right[1].do("set", name="/both/shared", value="right, and later", timeout=0.1)
    left[0].do("delete", name="/doomed/a", timeout=0.1)
    right[0].do("set", name="/doomed/c", value=3, timeout=0.1)
    pass_time(SECONDS)
    if kind == "cut":
        cable.mend()
    else:
        cable.release()
    until_known(left + right)
    until_same(left + right, f"two halves {kind} for {SECONDS:g} s while both wrote")
    assert nothing_is_missing(left[1], *logs) == 600
    root = right[1].do("root")
    assert root["both"] == {"shared": "right, and later"}
    assert root["doomed"] == {"b": 2, "c": 3}
    assert left[1].do("set", name="/after", value=1)["slow"] == []
    assert right[1].do("get", name="/after") == 1
    cable.close()


@pytest.mark.parametrize("count", [10_500, 25_000])
def test_many_deletions_on_one_side_of_a_cut_stay_dead(fleet: Fleet, count: int) -> None:
    port = free_port()
    cable = Cable(port)
    left = fleet.start(endpoint=f"tcp/127.0.0.1:{port}", mode="router")
    right = fleet.start(
        endpoint=f"tcp/127.0.0.1:{free_port()}",
        mode="router",
        connect=[f"tcp/127.0.0.1:{cable.port}"],
    )
    until_known([left, right])
    left.do("load", namespace="/gone", values={f"p{number}": number for number in range(count)})
    until_same([left, right], f"{count} parameters")
    cable.cut()
    assert right.do("set", name="/new/early", value=1, timeout=0.1)
    assert left.do("clear", namespace="/gone") == count
    left.do("forget", keep=KEPT_TOMBSTONES)
    assert right.do("set", name="/new/late", value=2, timeout=0.1)
    cable.mend()
    until_known([left, right])
    until_same([left, right], f"{count} deletions on one side of a cut")
    # Of more deletions than are remembered, any might be one of what was new here before them.
    new = {"early": 1, "late": 2} if count < 2 * KEPT_TOMBSTONES else {"late": 2}
    assert left.do("root") == {"gone": {}, "new": new}
    cable.close()


@pytest.mark.parametrize("skew", [-10.0, 10.0])
def test_a_writer_whose_clock_is_wrong_loses_and_hides_nothing(fleet: Fleet, skew: float) -> None:
    right = fleet.start()
    wrong = fleet.start(skew=skew)
    until_known([right, wrong])
    logs = [fleet.folder / "right", fleet.folder / "wrong"]
    right.tell("storm", prefix="/right/x", count=300, log=str(logs[0]))
    wrong.tell("storm", prefix="/wrong/x", count=300, log=str(logs[1]))
    right.answer()
    wrong.answer()
    for number in range(10):
        right.do("set", name="/turn", value=["right", number])
        assert wrong.do("get", name="/turn") == ["right", number]
        wrong.do("set", name="/turn", value=["wrong", number])
        assert right.do("get", name="/turn") == ["wrong", number]
    late = fleet.start()
    until_same([right, wrong, late], f"a writer whose clock is off by {skew:+g} s")
    assert nothing_is_missing(late, *logs) == 600


def test_a_replica_that_was_stopped_catches_up(fleet: Fleet) -> None:
    one, other, stopped = fleet.start_many(3)
    stopped.stop()
    first = one.do("set", name="/first", value=1, timeout=0.5)
    assert f"member {stopped.pid} (stopped)" in first["slow"]
    log = fleet.folder / "log"
    one.tell("storm", prefix="/ns/x", count=300, log=str(log), timeout=1000.0)
    one.answer(6 * TIMEOUT)  # only the first write waits for the one that is stopped
    other.do("set", name="/other", value=1, timeout=0.5)
    pass_time(STOPPED)
    stopped.resume()
    until_same([one, other, stopped], f"a replica stopped for {STOPPED:g} s")
    assert nothing_is_missing(stopped, log) == 300
    assert one.do("set", name="/again", value=2)["slow"] == []
    assert stopped.do("get", name="/again") == 2
    assert stopped.do("set", name="/mine", value=3)["slow"] == []


def test_a_full_link_to_a_stopped_replica_delays_no_set(fleet: Fleet) -> None:
    one, other, stopped = fleet.start_many(3)
    stopped.stop()
    for number in range(12):
        taken = one.do("set", name=f"/p{number}", value="x" * 2_000_000, timeout=1.0)
        # Zenoh blocks a put for 5 s while a link is full, and gives up the link then.
        assert f"member {stopped.pid} (stopped)" in taken["slow"]
    stopped.resume()
    until_same([one, other, stopped], "a replica with a full link")


def test_joining_during_a_storm_misses_nothing(fleet: Fleet) -> None:
    writers = fleet.start_many(2)
    logs = [fleet.folder / "one", fleet.folder / "two"]
    for writer, log in zip(writers, logs, strict=True):
        writer.tell("storm", prefix=f"/{log.name}/x", count=WRITES, log=str(log))
    while not all(log.exists() and log.stat().st_size > 1000 for log in logs):
        pass_time(0.005)
    joined = []
    for _ in range(3):
        before = [acknowledged(log) for log in logs]
        joined.append(fleet.start())
        root = joined[-1].do("root")
        for log, names in zip(logs, before, strict=True):
            missing = {n for n in names if n.rpartition("/")[2] not in root[log.name]}
            assert not missing, "what was acknowledged before it came is there when it has joined"
    for writer in writers:
        writer.answer()
    until_same([*writers, *joined], "three that joined during a storm of writes")
    assert nothing_is_missing(joined[0], *logs) == 2 * WRITES


def test_two_loads_at_once_end_the_same_everywhere(fleet: Fleet) -> None:
    one, other, third = fleet.start_many(3)
    values = {f"ns{number % 50}/p{number}": number for number in range(LOADED)}
    one.tell("load", namespace="/", values={**values, "by": "one", "only": {"one": 1}})
    other.tell("load", namespace="/", values={**values, "by": "other", "only": {"other": 1}})
    print("two loads of 5000 at once took", one.answer(), other.answer())
    until_same([one, other, third], "two loads of 5000 parameters at once")
    root = third.do("root")
    assert root["only"] == {"one": 1, "other": 1}
    assert len(third.do("root")) == 52


def test_a_kept_store_survives_the_kill_of_everybody(fleet: Fleet) -> None:
    file = str(fleet.folder / "params")
    keeper = fleet.start(file=file)
    writer = fleet.start()
    until_known([keeper, writer])
    log = fleet.folder / "log"
    writer.tell("storm", prefix="/ns/x", count=200, log=str(log))
    while not (log.exists() and log.stat().st_size > 200):
        pass_time(0.005)
    sure = acknowledged(log)
    keeper.kill()
    writer.kill()
    again = fleet.start(file=file)
    root = again.do("root")["ns"]
    assert all(root[name.rpartition("/")[2]] == value for name, value in sure.items())
    print(f"{len(sure)} writes acknowledged before kill -9 of all are back from the file")


def test_a_full_disk_undoes_nothing_that_others_acknowledged(fleet: Fleet) -> None:
    """The one with the full disk writes while it is cut off, and so do the others."""
    port = free_port()
    cable = Cable(port)
    keeper = fleet.start(
        endpoint=f"tcp/127.0.0.1:{port}", mode="router", file=str(fleet.folder / "params")
    )
    link = [f"tcp/127.0.0.1:{cable.port}"]
    other = fleet.start(endpoint=f"tcp/127.0.0.1:{free_port()}", mode="router", connect=link)
    until_known([keeper, other])
    assert keeper.do("set", name="/ns", value={"kept": 1, "gone": 1})["slow"] == []
    until_same([keeper, other], "before the cut")
    keeper.do("fill")
    cable.cut()
    keeper.tell("set", name="/ns", value={"kept": 2, "gone": 2, "big": "x" * 100_000}, timeout=3.0)
    pass_time(1.0)
    assert other.do("set", name="/ns/kept", value=3, timeout=0.1)
    assert other.do("delete", name="/ns/gone", timeout=0.1) is not None
    assert "not kept at member" in keeper.answer()["partly"]
    cable.mend()
    until_known([keeper, other])
    until_same([keeper, other], "a full disk beside a cut")
    root = other.do("root")["ns"]
    assert root["kept"] == 3
    assert "gone" not in root
    assert len(root["big"]) == 100_000
    cable.close()


def test_the_last_write_of_a_program_that_ends_is_handed_over(fleet: Fleet) -> None:
    one, writer = fleet.start_many(2)
    for number in range(30):
        writer.do("set", name=f"/last/{number}", value=number, timeout=0)
    writer.end()
    root = one.do("root")
    assert root["last"] == {str(number): number for number in range(30)}


def test_many_replicas_in_one_domain(fleet: Fleet) -> None:
    port = free_port()
    router = fleet.start(endpoint=f"tcp/127.0.0.1:{port}", mode="router")
    crowds = [
        fleet.start(endpoint=f"tcp/127.0.0.1:{port}", mode="client", more=MANY // 2 - 1, wait=False)
        for _ in range(2)
    ]
    for crowd in crowds:
        assert crowd.answer(250) == "up"
    until_known([router, *crowds], MANY)
    loaded = router.do("load", namespace="/", values={f"p{n}": n for n in range(1000)})
    assert loaded["slow"] == []
    taken = [crowds[number % 2].do("set", name="/x", value=number) for number in range(10)]
    assert all(answer["slow"] == [] for answer in taken)
    for crowd in crowds:
        assert set(crowd.do("everywhere", name="/x")) == {9}
        assert len(crowd.do("digests")) == 1
    seconds = sorted(answer["seconds"] for answer in taken)[5]
    print(f"set acknowledged by {MANY} replicas in three processes: {seconds * 1000:.1f} ms")
    until_same([router, *crowds], f"{MANY + 1} replicas in one domain")
