"""A holder of a key with few permissions, or all, sends noise to actions, a recorder and a page."""

from __future__ import annotations

import random
import signal

import pytest
from hosts.host import Host
from network import TIMEOUT

import rosz.bags
from rosz.security import Authority

ROBOT = """
    import sys
    from rosz.msgs.example_interfaces.action import Fibonacci
    from rosz.msgs.std_msgs.msg import String
    from rosz.node import Node

    def count(goal):
        print("goal", goal.request.order, flush=True)
        goal.succeed(Fibonacci.Result([goal.request.order]))

    with Node("robot") as node:
        node.action_server("count", Fibonacci, count)
        said = node.publisher("said", String, latch=True)
        said.publish(String("sound"))
        client = node.action_client("count", Fibonacci)
        client.wait_for_server()
        print("up", flush=True)
        for line in sys.stdin:
            print("result", client.send(Fibonacci.Goal(int(line))).result(50).sequence, flush=True)
"""
FORGER = """
    import json, random, struct, sys
    import zenoh
    from rosz.msgs.example_interfaces.action import Fibonacci
    from rosz.msgs.std_msgs.msg import String
    from rosz.wire import dds_type

    keys, seed = sys.argv[1:]
    rng = random.Random(seed)
    config = zenoh.Config()
    for name, value in {
        "mode": "client",
        "connect/endpoints": ["tls/robot:7447"],
        "scouting/multicast/enabled": False,
        "transport/link/tls/root_ca_certificate": f"{keys}/authority.pem",
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/connect_certificate": f"{keys}/certificate.pem",
        "transport/link/tls/connect_private_key": f"{keys}/key.pem",
    }.items():
        config.insert_json5(name, json.dumps(value))
    session = zenoh.open(config)
    zid, token = session.zid(), session.liveliness().declare_token
    known = {
        "said": String,
        "fresh": String,
        "rosout": String,
        "count/_action/feedback": Fibonacci.FeedbackMessage,
        "count/_action/send_goal": Fibonacci.SendGoal,
        "count/_action/get_result": Fibonacci.GetResult,
    }
    goal = Fibonacci.SendGoal.Request(goal=Fibonacci.Goal(4711)).to_cdr()
    forged, kept = String("forged").to_cdr(), []
    how = {"timeout": 1.0, "allowed_destination": zenoh.Locality.REMOTE}

    def answer(query):
        print("asked", query.key_expr, flush=True)
        query.reply(query.key_expr, rng.randbytes(20))

    for number, (name, kind) in enumerate(known.items()):
        rest = f"{dds_type(kind._type_name)}/{kind._type_hash}"
        sort = "SS" if name.endswith(("goal", "result")) else "MP"
        chunk = "%" + name.replace("/", "%")
        for node in ("robot", "forger"):
            text = f"@ros2_lv/0/{zid}/0/{number + 9}/{sort}/%/%/{node}/{chunk}/{rest}/::,1:,:,:,,"
            kept.append(token(text))
        kept.append(session.declare_queryable(f"0/{name}/**", answer))
    print("up", flush=True)
    for line in sys.stdin:
        for _ in range(20):
            for name, kind in known.items():
                key = f"0/{name}/{dds_type(kind._type_name)}/{kind._type_hash}"
                noise = rng.choice((forged, goal, goal[: rng.randrange(20)], rng.randbytes(40)))
                sound = struct.pack("<qqB16s", 1, 2, 16, rng.randbytes(16))
                attachment = rng.choice((sound, sound, None, rng.randbytes(33)))
                session.put(key, noise, attachment=attachment)
                session.delete(key)
                session.get(key, lambda _: None, payload=noise, attachment=sound, **how)
        list(session.get("0/count/**", payload=goal, **how))
        for one in kept:
            one.undeclare()
        print("done", flush=True)
"""


@pytest.mark.parametrize("rules", ["{subscribe: [/odom]}", "all"])
def test_noise_of_a_holder(pair: tuple[Host, Host], authority: Authority, rules: str) -> None:
    pytest.importorskip("nicegui")
    seed = str(random.SystemRandom().randrange(1 << 32))
    print("seed", seed)
    robot, laptop = pair
    (authority.folder / "robot/rules.yaml").write_text(f"laptop: {rules}\n")
    core = robot.rosz("core", "--listen", "tcp/0.0.0.0:7447")
    core.wait_for("started core")
    victim = robot.program(ROBOT)
    victim.wait_for("up")
    page = robot.rosz("web", "--port", "8123")
    recorder = robot.rosz("bag", "record", "-a", "-O", str(robot.home / "a"))
    recorder.wait_for("/said")
    forger = laptop.program(FORGER, laptop.variables["ROSZ_KEYS"], seed)
    forger.wait_for("up")
    forger.say("go")
    forger.wait_for("done", 4 * TIMEOUT)
    victim.say("3")
    victim.wait_for("result")
    page.wait_for("the page is at", 4 * TIMEOUT)
    assert "/robot" in robot.ask("node", "list")
    recorder.send(signal.SIGINT)
    recorder.exit_code()
    for program in (core, victim, page, recorder):
        assert "Traceback" not in program.output
    assert page.process.poll() is None
    with rosz.bags.open_reader(robot.home / "a.mcap") as bag:
        bodies = [bytes(message.data) for message in bag.messages()]
    assert bodies
    if rules != "all":
        assert "asked" not in forger.output
        assert "goal 4711" not in victim.output
        assert "fresh" not in recorder.output
        assert not any(b"forged" in body for body in bodies)
