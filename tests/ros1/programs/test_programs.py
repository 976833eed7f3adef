"""Programs behave the same on real rospy and on rosz."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from network import Network

from .runners import SCRIPTS, Ros, Rosz
from .scenarios import SCENARIOS, Scenario


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros]:
    runner = Ros(tmp_path_factory.mktemp("ros"))
    yield runner
    runner.close()


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.name)
def test_programs_behave_the_same(
    ros: Ros, network: Network, tmp_path: Path, scenario: Scenario
) -> None:
    ros.clean()
    with ThreadPoolExecutor(2) as pool:
        expected = pool.submit(ros.run, scenario, tmp_path)
        found = pool.submit(Rosz(network).run, scenario, tmp_path)
    assert found.result() == expected.result()


def test_every_program_is_in_a_scenario() -> None:
    run = {part.script for scenario in SCENARIOS for part in scenario.parts}
    assert run == {path.name for path in SCRIPTS.glob("*.py")}
