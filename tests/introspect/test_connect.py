"""How long commands wait for an answer."""

from __future__ import annotations

import signal

from network import Network, eventually

from rosz.introspect.connect import command_config
from rosz.session import is_stopped

NODE = """
    import rosz
    with rosz.Node("there") as node:
        print("up")
        node.spin()
"""


def test_who_is_awake_is_given_time_to_answer(network: Network) -> None:
    environment = network.environment()
    assert command_config(environment).open_timeout == 1.0
    program = network.program(NODE)
    program.wait_for("up")
    assert command_config(environment).open_timeout == 10.0
    elsewhere = network.environment(connect=("tcp/127.0.0.1:1",))
    assert command_config(elsewhere).open_timeout == 1.0
    program.send(signal.SIGSTOP)
    eventually(lambda: is_stopped(program.pid), "the program is stopped")
    assert command_config(environment).open_timeout == 1.0
