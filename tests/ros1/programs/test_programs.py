"""Programs say and do the same on real rospy and on rosz."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from network import Network

from .scenarios import SCENARIOS, Scenario
from .stage import SCRIPTS, Ros, Rosz


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros]:
    made = Ros(tmp_path_factory.mktemp("ros"))
    yield made
    made.close()


@pytest.mark.timeout(120)
@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.name)
def test_it_is_the_same(ros: Ros, network: Network, tmp_path: Path, scenario: Scenario) -> None:
    ros.clean()
    with ThreadPoolExecutor(2) as pool:
        theirs = pool.submit(ros.play, scenario, tmp_path)
        ours = pool.submit(Rosz(network).play, scenario, tmp_path)
    assert ours.result() == theirs.result()


def test_every_program_is_run() -> None:
    run = {part.script for scenario in SCENARIOS for part in scenario.parts}
    assert run == {path.name for path in SCRIPTS.glob("*.py")}
