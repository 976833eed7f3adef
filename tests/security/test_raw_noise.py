"""A stranger without keys writes noise to whatever is there: nothing ends, or shows a traceback."""

from __future__ import annotations

import os
import random

import pytest
from network import TIMEOUT, Network, eventually
from web.visitor import Visitor

from rosz.bags import Channel, McapWriter
from rosz.introspect import take_survey
from rosz.msgs.example_interfaces.action import Fibonacci
from rosz.msgs.std_msgs.msg import String
from rosz.wire import Kind, entity_key

pytestmark = [pytest.mark.system]
ROUNDS = 50
OWN = ("param/gain", "param/a/%ff", "control", "x", "core/y")
CHUNKS = ("%", "%%", "%a%", "*", "x" * 3000, "%00", "-1", "NN", "SS", "MP", ":1:,:,:,,", "é")
"""What stands in damaged tokens."""
ROBOT = """
    from rosz.msgs.example_interfaces.action import Fibonacci
    from rosz.msgs.std_msgs.msg import String
    from rosz.msgs.std_srvs.srv import Empty
    from rosz.node import Node

    def count(goal):
        goal.succeed(Fibonacci.Result([goal.request.order]))

    with Node("robot") as node:
        node.params.set("/gain", 1.5)
        node.action_server("count", Fibonacci, count)
        node.service("empty", Empty, lambda _: Empty.Response())
        heard = node.subscription("chatter", String, lambda message: None)
        said = node.publisher("said", String, latch=True)
        said.publish(String("hello"))
        print("up", flush=True)
        node.context.wait_for_shutdown()
"""


def damage(token: str, rng: random.Random) -> str:
    chunks = token.split("/")
    for _ in range(rng.choice((1, 1, 2, 4))):
        chunks[rng.randrange(2, len(chunks))] = rng.choice(CHUNKS)
    return "/".join(chunks)


def test_noise_of_a_stranger(network: Network) -> None:
    pytest.importorskip("nicegui")
    seed = int(os.environ.get("ROSZ_SEED", random.SystemRandom().randrange(1 << 32)))
    print("ROSZ_SEED =", seed)
    rng = random.Random(seed)
    robot = network.program(ROBOT)
    robot.wait_for("up")
    bag = str(network.folder / "a")
    with McapWriter(network.folder / "played.mcap") as writer:
        channel = Channel("/played", "std_msgs/msg/String", definition="string data\n")
        writer.write(writer.add(channel), 1, String("again").to_cdr())
    played = str(network.folder / "played.mcap")
    player = network.run("-m", "rosz", "bag", "play", "--loop", played)
    recorder = network.run("-m", "rosz", "bag", "record", "-a", "-O", bag)
    client = network.node("client").action_client("count", Fibonacci)
    client.wait_for_server()
    recorder.wait_for("/said")
    recorder.wait_for("/played")
    page = network.run("-m", "rosz", "web", "--port", "0")
    address = page.wait_for("the page is at", 4 * TIMEOUT).split()[-1]
    visitors = [Visitor(address, path) for path in ("/actions", "/topics", "/console")]
    stranger = network.session()
    eventually(lambda: stranger.live_tokens("@ros2_lv/**", TIMEOUT), "the tokens")
    own = f"@rosz/{network.domain}"
    sound = sorted(stranger.live_tokens("@ros2_lv/**", TIMEOUT))
    damaged = [stranger.token(damage(rng.choice(sound), rng)) for _ in range(ROUNDS)]
    for _ in range(ROUNDS):
        damaged.pop().close()
        view = take_survey(stranger, network.domain, looks=3).view
        keys = {
            entity_key(network.domain, token.name, token.type_name, token.type_hash)
            for token in view.entities(*(kind for kind in Kind if kind is not Kind.NODE))
        }
        keys |= {
            f"{own}/{word}" for word in ("param/gain", "param/a/%ff", "control", "x", "core/y")
        }
        for key in sorted(keys):
            noise = rng.randbytes(rng.choice((0, 1, 4, 5, 40, 2000)))
            attachment = rng.choice((None, b"", rng.randbytes(33), b"\xff" * 40))
            stranger.put(key, noise, attachment=attachment)
            for reply in stranger.get(key, timeout=0.2, payload=noise, attachment=attachment):
                assert len(reply.payload) < 1 << 20
            if rng.random() < 0.2:
                stranger.delete(key)
    result = client.send(Fibonacci.Goal(3)).result(TIMEOUT)
    assert result.sequence.tolist() == [3]
    network.node("late").publisher("chatter", String).publish(String("after"))
    for visitor in visitors:
        visitor.close()
    Visitor(address, "/graph").close()
    for program in (robot, player, recorder, page):
        assert program.process.poll() is None, program.output
        assert "Traceback" not in program.output
