"""Parameters that one machine has written and another may not receive, among others."""

from __future__ import annotations

import pytest
from hosts.host import Host
from network import repeats

from rosz.security import Authority

COUNT = repeats(500, 2000)
WRITER = """
    import logging, sys, time
    import rosz
    from rosz.params import condense, spread
    from rosz.params.replica import exchange
    from rosz.params.replica.core import upkeep
    from rosz.params.replica.core.effects import Publish
    logging.basicConfig()
    upkeep._COMPARE_EVERY = (0.2, 0.2)
    upkeep._TICK_SECONDS = 0.2
    query = exchange.Exchange._query

    def sent(self, effect):
        if effect.paths:
            print("sent", len(effect.paths), min(effect.paths), flush=True)
        query(self, effect)

    exchange.Exchange._query = sent
    with rosz.Node("writer") as node:
        store = node.context.params
        store._runner.handlers[Publish] = bool  # as if the link were cut
        store.write(condense(spread("/", {
            "gains": {f"g{n}": n for n in range(int(sys.argv[1]))},
            "secrets": {"pin": 1, "word": "x"},
            "gains_too": 1,
        })), timeout=0)
        print("wrote", flush=True)
        for line in sys.stdin:
            for _ in range(int(line)):
                while not store.compare(60):  # the keeper compares at this moment
                    time.sleep(0.01)
                print("compared", flush=True)
"""


@pytest.mark.parametrize("permitted", [True, False])
def test_forbidden_parameters_delay_nothing_and_are_logged_once(
    pair: tuple[Host, Host], authority: Authority, permitted: bool
) -> None:
    robot, laptop = pair
    some = ", set: ['/gains/**']" if permitted else ""
    (authority.folder / "robot/rules.yaml").write_text(f"laptop: {{get: true{some}}}\n")
    robot.rosz("core", "--listen", "tcp/0.0.0.0:7447").wait_for("started core")
    writer = laptop.program(WRITER, str(COUNT), ROSZ_CONNECT="tcp/robot:7447")
    warning = writer.wait_for("which differs there from now on", 60)
    assert f" and {2 if permitted else COUNT + 2} more" in warning
    begun = len(writer.lines)
    writer.say("5")
    writer.wait_for("compared", 60, times=5)
    assert [line for line in writer.lines[begun:] if line.startswith("sent")] == []
    assert writer.output.count("differs there from now on") == 1
    held = robot.ask("param", "list").split()
    assert (f"/gains/g{COUNT - 1}" in held) == permitted
    assert not {"/secrets/pin", "/secrets/word", "/gains_too"} & {*held}
    # Those that pass do so together.
    assert len([line for line in writer.lines if line.startswith("sent")]) < 10 or not permitted
