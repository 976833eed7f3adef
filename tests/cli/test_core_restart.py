"""A core that stood still for longer than others keep its links."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path

import pytest
from network import TIMEOUT, Program, eventually

from .shell import Shell

_SHORT_LEASE = "transport/link/tx/lease=2000"
_AFRESH = "started afresh"
_HASTY = """
    from rosz.cli.main import main
    from rosz.session import stale_links

    stale_links._STABLE_SECONDS = 3.0
    main()
    """
"""A core that takes a difference for lasting after a quarter of the usual time."""


def stop(program: Program, seconds: float) -> None:
    """Let a program stand still, and go on."""
    program.send(signal.SIGSTOP)
    time.sleep(seconds)
    program.send(signal.SIGCONT)


@pytest.mark.parametrize("stored", [False, True])
def test_a_core_that_stood_still_starts_afresh(shell: Shell, tmp_path: Path, stored: bool) -> None:
    options = ["--store", str(tmp_path / "params.db")] if stored else []
    core = shell.start("core", *options, ZENOH_CONFIG_OVERRIDE=_SHORT_LEASE)
    core.wait_for("started core")
    before = shell("param", "get", "/run_id").out
    assert shell("param", "set", "/tree", "{a: 1, b: [x, 2.5]}").code == 0
    said = len(core.lines)
    for _ in range(2):
        stopped = len(core.lines)
        stop(core, 3.0)
        line = core.wait_for(_AFRESH, after=stopped)
        assert line.startswith("stood still for ")
        assert line.endswith("started afresh, with 5 parameters")
    assert [line for line in core.lines[said:] if _AFRESH not in line] == []
    assert shell("param", "get", "/run_id").out == before
    assert shell("param", "get", "/tree").out == "a: 1\nb:\n- x\n- 2.5\n\n"
    core.send(signal.SIGINT)
    assert core.exit_code() == 0


def test_a_core_that_stood_still_for_a_moment_goes_on(shell: Shell) -> None:
    core = shell.start("core", ZENOH_CONFIG_OVERRIDE="transport/link/tx/lease=60000")
    core.wait_for("started core")
    stop(core, 3.0)
    assert shell("param", "set", "/x", "1").code == 0
    core.send(signal.SIGINT)
    assert core.exit_code() == 0
    assert _AFRESH not in core.output


def test_nodes_find_a_core_that_started_afresh(shell: Shell) -> None:
    core = shell.start("core", ZENOH_CONFIG_OVERRIDE=_SHORT_LEASE)
    core.wait_for("started core")
    node = shell.network.node("robot")
    assert shell("param", "set", "/x", "1").code == 0
    stop(core, 3.0)
    core.wait_for(_AFRESH)
    eventually(lambda: shell("node", "list").lines == ["/robot"], "the node", TIMEOUT)
    assert shell("param", "set", "/x", "2").code == 0
    assert node.params.get("/x") == 2


def test_a_core_that_is_linked_but_lacks_tokens_starts_afresh(shell: Shell) -> None:
    """Rules of Zenoh that take no tokens stand for links that it confuses."""
    deaf = {
        "enabled": True,
        "default_permission": "allow",
        "rules": [
            {
                "id": "deaf",
                "messages": ["liveliness_token"],
                "flows": ["ingress"],
                "permission": "deny",
                "key_exprs": ["@rosz/**", "@ros2_lv/**"],
            }
        ],
        "subjects": [{"id": "all"}],
        "policies": [{"rules": ["deaf"], "subjects": ["all"]}],
    }
    far = f"unixsock-stream/{shell.network.folder}/far.sock"
    core = shell.start("core")
    core.wait_for("started core")
    other = shell.network.program(
        _HASTY,
        "core",
        "--connect",
        shell.network.rendezvous,
        ROSZ_RENDEZVOUS=far,
        ZENOH_CONFIG_OVERRIDE=f"access_control={json.dumps(deaf)}",
    )
    other.wait_for("started core")
    line = other.wait_for(_AFRESH)
    assert "although there is a link to it" in line
    assert _AFRESH not in core.output
