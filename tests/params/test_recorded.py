"""What real processes did, replayed in the simulation: the same effects, and all checks hold."""

from __future__ import annotations

from typing import Any

import pytest
from network import free_port

from .fleet import Cable, Fleet, Process, states, until_known, until_same
from .recording import plain, read
from .simulation.replay import Replay


def start(fleet: Fleet, name: str, **settings: Any) -> Process:
    """Start a replica that records, and that follows all changes and so defers none."""
    process = fleet.start(record=str(fleet.folder / name), **settings)
    process.do("watch", name="/")
    return process


def test_a_real_run_with_a_cut_and_a_kill_replays(fleet: Fleet) -> None:
    port = free_port()
    cable = Cable(port)
    near = start(
        fleet,
        "near",
        endpoint=f"tcp/127.0.0.1:{port}",
        mode="router",
        file=str(fleet.folder / "params"),
    )
    link = [f"tcp/127.0.0.1:{cable.port}"]
    far_end = f"tcp/127.0.0.1:{free_port()}"
    far = start(fleet, "far", endpoint=far_end, mode="router", connect=link)
    client = start(fleet, "client", endpoint=far_end, mode="client")
    until_known([near, far, client])
    for number, process in enumerate((near, far, client)):
        assert process.do("set", name=f"/ns/p{number}", value=number)["slow"] == []
    near.do("load", namespace="/gains", values={"p": 1, "i": {"x": 2, "y": 3}})
    client.do("delete", name="/gains/i")
    cable.cut()
    for number in range(5):
        near.do("set", name="/both", value=["near", number], timeout=0.3)
        client.do("set", name="/both", value=["client", number], timeout=0.3)
    far.do("delete", name="/ns/p0", timeout=0.3)
    cable.mend()
    until_known([near, far, client])
    until_same([near, far, client], "before the kill")
    client.kill()
    assert far.do("set", name="/after", value=1) is not None
    late = start(fleet, "late", endpoint=far_end, mode="client")
    until_known([near, far, late])
    late.do("set", name="/late", value=True)
    until_same([near, far, late], "at the end")
    digests = {state["digest"] for state in states([near, far, late])}
    root = near.do("root")
    recordings = {name: read(fleet.folder / name) for name in ("near", "far", "client", "late")}
    cable.close()

    replay = Replay(list(recordings.values()))
    replay.play()
    replay.end(recordings["client"].config.member.zid)
    replay.checks.on_quiet()
    for name in ("near", "far", "late"):
        core = replay.processes[recordings[name].config.member.zid].core
        assert {core.history.digest().hex()} == digests
        assert core.history.root == root
    print(f"{replay.steps} steps of real processes are the same in the simulation")
    assert replay.steps > 100


def test_a_replay_that_differs_is_told(fleet: Fleet) -> None:
    one = start(fleet, "one")
    one.do("set", name="/a", value=1)
    recording = read(fleet.folder / "one")
    number = next(n for n, step in enumerate(recording.steps) if step.effects)
    assert plain(recording.steps[number].effects) == recording.steps[number].effects
    recording.steps[number] = recording.steps[number]._replace(effects=[])
    with pytest.raises(AssertionError, match="has other effects than in the real run"):
        Replay([recording]).play()
