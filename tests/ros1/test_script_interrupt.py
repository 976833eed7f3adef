"""Ctrl-C before a script runs, or while it imports, ends it without a traceback."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from network import Network

SLOW = "import os, sys, time\nos.write(1, b'loading\\n')\ntime.sleep(600)\n"


@pytest.mark.parametrize("module", ["rosz.script", "rosz.ros1"])
def test_ctrl_c_during_imports(network: Network, module: str) -> None:
    (network.folder / "slow.py").write_text(SLOW)
    script = network.folder / "script.py"
    script.write_text("import slow\n")
    program = network.run("-P", "-m", module, str(script))
    program.wait_for("loading")
    program.send(signal.SIGINT)
    assert program.exit_code() == -signal.SIGINT
    assert program.output == "loading"


def test_ctrl_c_while_rosz_loads(network: Network) -> None:
    # The folder comes before that of the real msgspec on the path.
    (network.folder / "msgspec.py").write_text(SLOW)
    script = network.folder / "script.py"
    script.write_text("print('begun')\n")
    root = Path(__file__).parents[2]
    program = network.run(
        "-P", "-m", "rosz.script", str(script), PYTHONPATH=f"{network.folder}:{root}"
    )
    program.wait_for("loading")
    program.send(signal.SIGINT)
    assert program.exit_code() == -signal.SIGINT
    assert program.output == "loading"


@pytest.mark.parametrize("module", ["rosz.script", "rosz.ros1"])
def test_a_running_script_catches_ctrl_c(network: Network, module: str) -> None:
    script = network.folder / "script.py"
    script.write_text(
        "import time\n"
        "try:\n"
        "    print('begun', flush=True)\n"
        "    time.sleep(600)\n"
        "except KeyboardInterrupt:\n"
        "    print('caught')\n"
    )
    program = network.run("-P", "-m", module, str(script))
    program.wait_for("begun")
    program.send(signal.SIGINT)
    assert program.exit_code() == 0
    assert program.lines == ["begun", "caught"]
